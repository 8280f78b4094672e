"""Settings that all runs of a study share, requests for single runs, and the check of a machine."""

from __future__ import annotations

import itertools
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.errors import ActiveSteerError, StudyError
from activesteer.files import make_folder, writing
from activesteer.scenario import FileOrTable, Scenario, resolve
from activesteer.studies.engine.run_identity import controller_digest, deciding_versions, files_digest
from activesteer.studies.engine.study_file import StudyFile
from activesteer.studies.engine.workers import Workers
from activesteer.vehicle.native_forces import install_native_forces

_VERSION: Final = "version of "


@dataclass(frozen=True)
class Settings:
    """Settings that all runs of a study share; small, because every task carries them.

    Attributes:
        study: The study without its cases and searches.
        maneuvers: Label and name, path or table of each manoeuvre.
        vehicles: Label and name, path or table of each vehicle.
        controllers: Label and name or file of each controller.
        folder: Folder of the recordings.
        named: Indices of manoeuvre and vehicle with overrides, one for each combination of text factors, which may name
            other files.
        expected: Hashes at the start of the study: of the files of each pair of manoeuvre and vehicle with each
            combination of texts, of each controller, and of the versions.
    """

    study: StudyFile
    maneuvers: tuple[tuple[str, FileOrTable], ...]
    vehicles: tuple[tuple[str, FileOrTable], ...]
    controllers: tuple[tuple[str, str], ...]
    folder: Path | None
    named: tuple[tuple[int, int, dict[str, Any]], ...]
    expected: dict[str, str]


class Request(NamedTuple):
    """Request for one run."""

    run: int
    sample: int
    maneuver: int
    vehicle: int
    controller: int
    factors: dict[str, Any]
    overrides: dict[str, Any]


def present_inputs(settings: Settings) -> dict[str, str]:
    """Return the hashes of `Settings.expected` for the files on this machine."""
    found = {f"{_VERSION}{key}": value for key, value in deciding_versions().items()}
    places = itertools.product(range(len(settings.maneuvers)), range(len(settings.vehicles)))
    for maneuver, vehicle, overrides in (*((*place, settings.study.overrides) for place in places), *settings.named):
        scenario = scenario_of(settings, maneuver, vehicle, overrides)
        found[files_key(settings, maneuver, vehicle, overrides)] = files_digest(scenario)
    for label, controller in settings.controllers:
        found[f"controller {label}"] = controller_digest(controller)
    return found


def scenario_of(settings: Settings, maneuver: int, vehicle: int, overrides: dict[str, Any]) -> Scenario:
    """Return the scenario for these indices of manoeuvre and vehicle."""
    controllers = [controller for _, controller in settings.controllers]
    return resolve(
        settings.maneuvers[maneuver][1], settings.vehicles[vehicle][1], overrides, settings.study.driver, controllers
    )


def files_key(settings: Settings, maneuver: int, vehicle: int, overrides: dict[str, Any]) -> str:
    """Return the key of these files in `Settings.expected`."""
    texts = [
        f"{key} = {value}"
        for key, value in sorted(overrides.items())
        if isinstance(value, str) and value != settings.study.overrides.get(key)
    ]
    words = f"files of {settings.maneuvers[maneuver][0]} and {settings.vehicles[vehicle][0]}"
    return f"{words} with {', '.join(texts)}" if texts else words


def differences(settings: Settings) -> str:
    """Return the differences from the start of the study in words; empty if there are none."""
    try:
        here = present_inputs(settings)
    except ActiveSteerError as error:
        return str(error)
    wrong = [
        f"{key} (now {here.get(key)}, then {value})" if key.startswith(_VERSION) else key
        for key, value in settings.expected.items()
        if here.get(key) != value
    ]
    return f"changed since the study began: {', '.join(wrong)}" if wrong else ""


def prepare(workers: Workers, settings: Settings) -> None:
    """Prepare the workers, once per machine."""
    if problem := workers.everywhere(prepare_worker, settings):
        raise StudyError(problem)


def prepare_worker(settings: Settings) -> str:
    """Compile the native code; return in words why this machine cannot make the runs, or an empty text."""
    if problem := differences(settings):
        return problem
    install_native_forces()
    if settings.folder is None:
        return ""
    try:
        make_folder(settings.folder, StudyError)
        with writing(settings.folder, StudyError), tempfile.TemporaryFile(dir=settings.folder):
            return ""
    except StudyError as error:
        return str(error)

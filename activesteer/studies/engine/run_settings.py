"""What all runs of a study share, what says which run it is, and whether a machine can make them."""

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
from activesteer.studies.engine.workers import Workers
from activesteer.vehicle.native_forces import install_native_forces

_VERSION: Final = "version of "


@dataclass(frozen=True)
class Settings:
    """What all runs of a study share; small, because it travels with every task.

    Attributes:
        maneuvers: Label and name, path or table of each manoeuvre.
        vehicles: The same of each vehicle.
        controllers: Label and name or file of each controller.
        driver: Name, path or table of who drives, or his code.
        overrides: What is the same in all runs.
        seed: Of the study.
        timestep_s: Step of the simulation [s].
        metrics: Patterns of the metrics that are kept; all where empty.
        recordings: `none`, `failed`, `all`, or n for every n-th sample.
        folder: Where recordings go.
        claims: Whether the paper's claims are checked for every sample.
        curves: Channels that are kept of every run that was driven to its end.
        named: Numbers of manoeuvre and vehicle and overrides, one for each combination of factors that are text: they
            may name other files.
        expected: Hash of the files of each pair of manoeuvre and vehicle, with each combination of texts, of each
            controller, and the versions, as the study began with them.
    """

    maneuvers: tuple[tuple[str, FileOrTable], ...]
    vehicles: tuple[tuple[str, FileOrTable], ...]
    controllers: tuple[tuple[str, str], ...]
    driver: FileOrTable
    overrides: dict[str, Any]
    seed: int
    timestep_s: float
    metrics: tuple[str, ...]
    recordings: str | int
    folder: Path | None
    claims: bool
    curves: tuple[str, ...]
    named: tuple[tuple[int, int, dict[str, Any]], ...]
    expected: dict[str, str]


class Request(NamedTuple):
    """One run.

    Attributes:
        run: Its number in the study.
        sample: Number of the combination of factors.
        maneuver: Number of the manoeuvre.
        vehicle: Number of the vehicle.
        controller: Number of the controller.
        factors: Values of the factors.
        overrides: What they, and what is the same in all runs, are here.
    """

    run: int
    sample: int
    maneuver: int
    vehicle: int
    controller: int
    factors: dict[str, Any]
    overrides: dict[str, Any]


def present_inputs(settings: Settings) -> dict[str, str]:
    """The hashes of `Settings.expected`, of what is found here.

    Raises:
        ActiveSteerError: something is not found.
    """
    found = {f"{_VERSION}{key}": value for key, value in deciding_versions().items()}
    places = itertools.product(range(len(settings.maneuvers)), range(len(settings.vehicles)))
    for maneuver, vehicle, overrides in (*((*place, settings.overrides) for place in places), *settings.named):
        scenario = scenario_of(settings, maneuver, vehicle, overrides)
        found[files_key(settings, maneuver, vehicle, overrides)] = files_digest(scenario)
    for label, controller in settings.controllers:
        found[f"controller {label}"] = controller_digest(controller)
    return found


def scenario_of(settings: Settings, maneuver: int, vehicle: int, overrides: dict[str, Any]) -> Scenario:
    """What is driven for these numbers of a manoeuvre and a vehicle."""
    return resolve(settings.maneuvers[maneuver][1], settings.vehicles[vehicle][1], overrides, settings.driver)


def files_key(settings: Settings, maneuver: int, vehicle: int, overrides: dict[str, Any]) -> str:
    """The key of the files in `Settings.expected`."""
    texts = [
        f"{key} = {value}"
        for key, value in sorted(overrides.items())
        if isinstance(value, str) and value != settings.overrides.get(key)
    ]
    words = f"files of {settings.maneuvers[maneuver][0]} and {settings.vehicles[vehicle][0]}"
    return f"{words} with {', '.join(texts)}" if texts else words


def differences(settings: Settings) -> str:
    """What is not here as the study began with it, in words; empty where all is."""
    try:
        here = present_inputs(settings)
    except ActiveSteerError as error:
        return str(error)
    wrong = [
        f"{key} ({here.get(key)}, there {value})" if key.startswith(_VERSION) else key
        for key, value in settings.expected.items()
        if here.get(key) != value
    ]
    return f"not as where the study was begun: {', '.join(wrong)}" if wrong else ""


def prepare(workers: Workers, settings: Settings) -> None:
    """Gets workers ready, each machine once.

    Args:
        workers: Who makes the runs.
        settings: What all runs of the study share.

    Raises:
        StudyError: one of them cannot make the runs.
    """
    if problem := workers.everywhere(prepare_worker, settings):
        raise StudyError(problem)


def prepare_worker(settings: Settings) -> str:
    """Compiles what is compiled, and looks whether this machine can make the runs.

    Args:
        settings: What all runs of the study share.

    Returns:
        What stands against it, in words; nothing where all is well.
    """
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

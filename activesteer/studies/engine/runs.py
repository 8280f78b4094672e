"""Runs of a study: settings that they share, their identity, and the command that repeats one."""

from __future__ import annotations

import functools
import hashlib
import itertools
import json
import os
import platform
import shlex
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final, NamedTuple

import activesteer
from activesteer.config import toml_value
from activesteer.controllers import controller_spec, is_variant, read_variant
from activesteer.errors import ActiveSteerError, StudyError
from activesteer.files import make_folder, writing
from activesteer.plugins.file import format_of, source_of
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, Scenario, describe, resolve
from activesteer.studies.engine.study_file import StudyFile
from activesteer.studies.engine.workers import Workers
from activesteer.vehicle.native_forces import install_native_forces
from activesteer.version import __version__

_DECIDING: Final = (
    "config", "conventions.py", "coupling", "signals.py", "theory", "road", "maneuver", "driver", "controllers",
    "estimation", "tyre", "brakes", "sensors", "faults", "vehicle", "scenario", "simulation", "analysis",
)  # fmt: skip
"""Parts of the package that a result depends on."""


def digest(value: Any) -> str:
    """Return the hash of JSON values that may contain bytes."""
    return hashlib.sha256(json.dumps(value, sort_keys=True, default=_of_bytes).encode()).hexdigest()


def _of_bytes(value: object) -> str:
    if not isinstance(value, bytes):
        raise TypeError(f"{type(value).__name__} has no hash that is the same everywhere")
    return hashlib.sha256(value).hexdigest()


@functools.cache
def source_digest() -> str:
    """Return the hash of the sources that results depend on; the version number does not change with every edit."""
    package = Path(activesteer.__file__).parent
    found = {}
    for part in _DECIDING:
        inside = (path for path in (package / part).rglob("*") if path.suffix in (".py", ".txt"))
        for path in [package / part] if part.endswith(".py") else sorted(inside):
            found[path.relative_to(package).as_posix()] = path.read_bytes()
    return digest(found)[:12]


@functools.cache
def versions() -> dict[str, str]:
    """Return the versions of activesteer, its sources and its dependencies."""
    found = {"activesteer": __version__, "source": source_digest(), "python": platform.python_version()}
    for package in ("mujoco", "numpy", "scipy", "numba"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found


def deciding_versions() -> dict[str, str]:
    """Return the versions that the identity of a run depends on."""
    return {key: versions()[key] for key in ("activesteer", "source", "mujoco")}


def files_digest(scenario: Scenario) -> str:
    """Return the hash of the content of all files of a scenario."""
    return digest(scenario.files)


def controller_digest(controller: str) -> str:
    """Return the hash of a controller: its name, its parameters, and the source of a user's own controller."""
    path, _, name = controller.partition(":")
    if format_of(controller) is not None:
        source: Any = {"fmu": controller_spec(controller).files}
    else:
        source = read_variant(controller).files if is_variant(controller) else source_of(controller)
    return digest({"name": f"{Path(path).name}:{name}", "source": source})


def run_id(scenario: Scenario, controller: str, seed: int, timestep_s: float) -> str:
    """Return the identity of a run: equal if and only if everything that decides the result is equal."""
    parts = {
        "scenario": describe(scenario) | {"overrides": None},
        "files": scenario.files,
        "controller": controller_digest(controller),
        "seed": seed,
        "timestep_s": timestep_s,
        "versions": deciding_versions(),
    }
    return digest(parts)[:16]


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


def run_command(
    maneuver: FileOrTable,
    controller: str,
    vehicle: FileOrTable,
    overrides: Mapping[str, Any],
    driver: Any = DEFAULT_DRIVER,
) -> str:
    """Return the `activesteer run` that repeats a run to the last bit.

    A manoeuvre or vehicle given as a table appears as its name. The override `driver` replaces the driver.
    """
    changes = dict(overrides)
    driver = changes.pop("driver", driver)
    words = ["activesteer", "run", _name(maneuver), "-c", controller]
    if _name(vehicle) != "compact":
        words += ["--vehicle", _name(vehicle)]
    if _name(driver) != DEFAULT_DRIVER:
        words += ["--driver", _name(driver)]
    for key, value in changes.items():
        words += ["--set", f"{key}={toml_value(value)}"]
    return shlex.join(words)


def _name(item: Any) -> str:
    return str(item.get("name", "table")) if isinstance(item, Mapping) else os.fspath(item)

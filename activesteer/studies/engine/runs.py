"""Runs of a study: tasks and their results."""

from __future__ import annotations

import contextlib
import ctypes
import fnmatch
import functools
import hashlib
import itertools
import json
import math
import os
import platform
import shlex
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.analysis.claims.judge import SCENARIOS
from activesteer.config import toml_value
from activesteer.controllers import controller_spec, is_variant, read_variant
from activesteer.core.conventions import CURVE_STEP_S
from activesteer.core.files import file_word, make_folder, writing
from activesteer.core.version import __version__
from activesteer.errors import ActiveSteerError, StudyError
from activesteer.plugins.file import format_of, source_of
from activesteer.recording import Recording
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, Scenario, describe
from activesteer.simulation import preparation
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.simulation.runner import run_scenario
from activesteer.studies.engine.study_file import StudyFile, label_of
from activesteer.studies.engine.workers import Workers
from activesteer.vehicle.native_forces import install_native_forces

_DECIDING: Final = (
    "config", "core", "coupling", "native", "theory", "road", "maneuver", "driver", "controllers", "estimation",
    "tyre", "sensors", "vehicle", "scenario", "simulation", "analysis",
)  # fmt: skip
"""Parts of the package that a result depends on."""


def digest(value: Any) -> str:
    """Return the hash of JSON values that may contain bytes."""
    text = json.dumps(value, sort_keys=True, default=lambda content: hashlib.sha256(content).hexdigest())
    return hashlib.sha256(text.encode()).hexdigest()


@functools.cache
def source_digest() -> str:
    """Return the hash of the sources that affect results."""
    package = Path(__file__).parents[2]
    found = {}
    for part in _DECIDING:
        for path in sorted((package / part).rglob("*")):
            if path.suffix in (".py", ".txt"):
                found[path.relative_to(package).as_posix()] = path.read_bytes()
    return digest(found)[:12]


@functools.cache
def versions() -> dict[str, str]:
    """Return the versions of activesteer, its sources and its dependencies."""
    found = {"activesteer": __version__, "source": source_digest(), "python": platform.python_version()}
    return found | {package: version(package) for package in ("mujoco", "numpy", "scipy", "numba")}


def deciding_versions() -> dict[str, str]:
    """Return the versions that are part of the identity of a run."""
    return {key: versions()[key] for key in ("activesteer", "source", "mujoco")}


def controller_digest(controller: str) -> str:
    """Return the hash of a controller: its name, its parameters, and the source of a user's own controller."""
    path, _, name = controller.partition(":")
    if format_of(controller) is not None:
        source: Any = {"fmu": controller_spec(controller).files}
    else:
        source = read_variant(controller).files if is_variant(controller) else source_of(controller)
    return digest({"name": f"{Path(path).name}:{name}", "source": source})


def run_id(scenario: Scenario, controller: str, seed: int, timestep_s: float) -> str:
    """Return the identity of a run, equal only for equal inputs."""
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
    """Settings of all runs of a study, kept small because every task carries them."""

    study: StudyFile  # the study without its cases and searches
    folder: Path | None
    # Indices of manoeuvre and vehicle with overrides, one for each combination of text factors, which may name other
    # files.
    named: tuple[tuple[int, int, dict[str, Any]], ...]
    # Hashes at the start of the study: of the files of each pair of manoeuvre and vehicle with each combination of
    # texts, of each controller, and of the versions.
    expected: dict[str, str]


class Request(NamedTuple):
    """Request for one run, by manoeuvre, car, sample and controller."""

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
    study = settings.study
    places = itertools.product(range(len(study.maneuvers)), range(len(study.vehicles)), [study.overrides])
    for place in (*places, *settings.named):
        found[files_key(study, *place)] = digest(study.scenario(*place).files)
    return found | {f"controller {label_of(each)}": controller_digest(each) for each in study.controllers}


def files_key(study: StudyFile, maneuver: int, vehicle: int, overrides: dict[str, Any]) -> str:
    """Return the key of these files in `Settings.expected`."""
    texts = [
        f"{key} = {value}"
        for key, value in sorted(overrides.items())
        if isinstance(value, str) and value != study.overrides.get(key)
    ]
    words = f"files of {label_of(study.maneuvers[maneuver])} and {label_of(study.vehicles[vehicle])}"
    return f"{words} with {', '.join(texts)}" if texts else words


def differences(settings: Settings) -> str:
    """Return a description of the changes since the start of the study, empty if there are none."""
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
    """Compile the native code, and return the reason why this machine cannot drive the runs, empty if it can."""
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
    """Return the `activesteer run` command that repeats a run bit-identically, with the names of tables."""
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


_ERROR_CHARACTERS: Final = 500
"""Largest length of an error message in a row."""
CLAIM: Final = "claim_"
"""Prefix of the columns with the verdict of a claim for the sample."""
DISTANCE: Final = "distance_"
"""Prefix of the columns with the distance of a claim from passing (see `Claim.distance`)."""
CURVE: Final = "curve_"
"""Prefix of the columns that hold a channel over time."""


class Status(StrEnum):
    """Status of a run in the results."""

    OK = "ok"
    UNEVALUATED = "unevaluated"
    """The run is complete but has no metrics. `error` gives the reason."""
    FAILED = "failed"
    """The run could not start, or ended early."""
    CRASHED = "crashed"
    """The process of the run died every time."""


Row = dict[str, Any]


def drive(settings: Settings, requests: Sequence[Request], most_s: float = math.inf) -> list[Row]:
    """Drive requested runs, and return their rows."""
    end_s = time.monotonic() + most_s
    if problem := _problem(digest({"expected": settings.expected}), settings):
        return [failed_row(settings, request, Status.FAILED, problem) for request in requests]
    rows: list[Row] = []
    for _, group in itertools.groupby(requests, lambda one: (one.maneuver, one.vehicle, one.sample, one.factors)):
        if rows and time.monotonic() >= end_s:
            break
        rows += _drive_sample(settings, list(group))
    # Return free memory to the system. The C library would otherwise fragment it; others have no such function.
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
    return rows


_seen: dict[str, str] = {}


def _problem(key: str, settings: Settings) -> str:
    """Check, once per process, that files and versions are unchanged since the start of the study."""
    if key not in _seen:
        _seen[key] = differences(settings)
    return _seen[key]


def _drive_sample(settings: Settings, requests: Sequence[Request]) -> list[Row]:
    """Drive the runs of one sample: one car on one road with each controller in turn."""
    study, first = settings.study, requests[0]
    place = first.maneuver, first.vehicle, first.overrides
    try:
        scenario, key = study.scenario(*place), files_key(study, *place)
        if digest(scenario.files) != settings.expected[key]:
            raise StudyError(f"{key}: changed while the study ran")
        with preparation.not_on_disk():
            ready = with_amplitude_found(scenario, study.timestep_s)
    except ActiveSteerError as error:
        return [failed_row(settings, request, Status.FAILED, _words_of(error)) for request in requests]
    rows = []
    recordings: dict[str, Recording] = {}
    for request in requests:
        controller, row = study.controllers[request.controller], _row(study, request)
        row["run_id"] = run_id(scenario, controller, study.seed, study.timestep_s)
        recording = _drive_one(settings, request, row, ready, controller)
        if study.claims and recording is not None:
            recordings[label_of(controller)] = recording
        rows.append(row)
    if study.claims:
        claims = _claims(label_of(study.maneuvers[first.maneuver]), recordings)
        for row in rows:
            row.update(claims)
    return rows


def _drive_one(settings: Settings, request: Request, row: Row, ready: Scenario, controller: str) -> Recording | None:
    """Drive one run, fill its row, and return the recording of a complete run."""
    study = settings.study
    every, path = study.recordings, None
    if settings.folder is not None and every != "none":
        path = settings.folder / f"{request.run:07d}-{row['maneuver']}-{file_word(row['controller'])}.mcap"
    keeps = every == "all" or (isinstance(every, int) and request.sample % every == 0)
    try:
        recording = run_scenario(ready, controller, path=path if keeps else None, timestep_s=study.timestep_s)
    except ActiveSteerError as error:
        row |= {"status": Status.FAILED.value, "error": _words_of(error)}
        if every == "failed" and path is not None and error.recording is not None and len(error.recording):
            try:
                error.recording.save(path)
            except ActiveSteerError as reason:
                row["error"] = f"{row['error']}; {reason}"
        return None
    every_steps = max(1, round(CURVE_STEP_S / study.timestep_s))
    row.update((f"{CURVE}{name}", np.float32(recording[name][::every_steps])) for name in study.curves)
    if problem := recording.metadata.get("metrics_error"):
        row |= {"status": Status.UNEVALUATED.value, "error": str(problem)[:_ERROR_CHARACTERS]}
        return None
    row["status"] = Status.OK.value
    row.update((name, float(value)) for name, value in recording.metrics.items() if _is_kept(study.metrics, name))
    return recording


@functools.lru_cache(maxsize=4096)
def _is_kept(patterns: tuple[str, ...], name: str) -> bool:
    return not patterns or any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def _claims(maneuver: str, recordings: Mapping[str, Recording]) -> dict[str, float]:
    """Return verdicts and distances of the paper's claims, empty if a run is missing."""
    try:
        claims = SCENARIOS[maneuver](recordings)
    except (KeyError, ActiveSteerError):
        return {}
    failed = sum(not claim.passed for claim in claims)
    verdicts = {f"{CLAIM}{claim.id}": float(claim.passed) for claim in claims}
    return verdicts | {f"{DISTANCE}{claim.id}": claim.distance for claim in claims} | {"claims_failed": float(failed)}


def failed_row(settings: Settings, request: Request, status: Status, problem: str) -> Row:
    """Return the row of an incomplete run."""
    return _row(settings.study, request) | {"status": status.value, "error": problem}


def _row(study: StudyFile, request: Request) -> Row:
    return {
        "run": request.run,
        "run_id": "",
        "sample": request.sample,
        "maneuver": label_of(study.maneuvers[request.maneuver]),
        "vehicle": label_of(study.vehicles[request.vehicle]),
        "controller": label_of(study.controllers[request.controller]),
        **request.factors,
        "status": Status.FAILED.value,
        "error": "",
    }


def _words_of(error: ActiveSteerError) -> str:
    text = "; ".join([f"{type(error).__name__}: {error}", *getattr(error, "__notes__", [])])
    return text[:_ERROR_CHARACTERS]

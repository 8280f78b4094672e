"""Task of a worker: a few runs, each of which becomes a row of the results."""

from __future__ import annotations

import contextlib
import ctypes
import fnmatch
import functools
import math
import time
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.analysis.claims.statements import SCENARIOS
from activesteer.conventions import CURVE_STEP_S
from activesteer.errors import ActiveSteerError, StudyError
from activesteer.files import file_word
from activesteer.recording import Recording
from activesteer.scenario import Scenario
from activesteer.simulation import amplitude_store
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.simulation.runner import run_scenario
from activesteer.studies.engine.runs import (
    Request,
    Settings,
    differences,
    digest,
    files_digest,
    files_key,
    run_id,
    scenario_of,
)

_ERROR_CHARACTERS: Final = 500
"""Largest length of an error message in a row."""
CLAIM: Final = "claim_"
"""Prefix of the columns that say whether a claim holds for the sample."""
DISTANCE: Final = "distance_"
"""Prefix of the columns that say how far a claim is from holding; see `Claim.distance`."""
CURVE: Final = "curve_"
"""Prefix of the columns that hold a channel over time."""


class Status(StrEnum):
    """Status of a run."""

    OK = "ok"
    UNEVALUATED = "unevaluated"
    """The run is complete but has no metrics; `error` says why."""
    FAILED = "failed"
    """The run could not start, or ended early."""
    CRASHED = "crashed"
    """The process of the run died every time."""


Row = dict[str, Any]


def drive(settings: Settings, requests: Sequence[Request], most_s: float = math.inf) -> list[Row]:
    """Make some runs."""
    end_s = time.monotonic() + most_s
    if problem := _problem(digest({"expected": settings.expected}), settings):
        return [failed_row(settings, request, Status.FAILED, problem) for request in requests]
    rows: list[Row] = []
    place = 0
    while place < len(requests) and (not rows or time.monotonic() < end_s):
        group = [other for other in requests[place:] if _same_drive(other, requests[place])]
        rows += _drive_sample(settings, group)
        place += len(group)
    _give_memory_back()
    return rows


def _give_memory_back() -> None:
    """Return free memory to the system; glibc would keep it in pieces, and a worker would use more and more."""
    with contextlib.suppress(OSError, AttributeError, TypeError):  # other C libraries have no such function
        ctypes.CDLL(None).malloc_trim(0)


_seen: dict[str, str] = {}


def _problem(key: str, settings: Settings) -> str:
    """Check once per process that this worker has the files and versions of the start of the study."""
    if key not in _seen:
        _seen[key] = differences(settings)
    return _seen[key]


def _same_drive(a: Request, b: Request) -> bool:
    return (a.maneuver, a.vehicle, a.sample, a.factors) == (b.maneuver, b.vehicle, b.sample, b.factors)


def _drive_sample(settings: Settings, requests: Sequence[Request]) -> list[Row]:
    """Make the runs of one sample: the same car on the same road with one controller after the other."""
    first = requests[0]
    place = first.maneuver, first.vehicle, first.overrides
    try:
        scenario, key = scenario_of(settings, *place), files_key(settings, *place)
        if files_digest(scenario) != settings.expected[key]:
            raise StudyError(f"{key}: changed while the study ran")
        with amplitude_store.not_on_disk():
            ready = with_amplitude_found(scenario, settings.study.timestep_s)
    except ActiveSteerError as error:
        return [failed_row(settings, request, Status.FAILED, _words_of(error)) for request in requests]
    rows = []
    recordings: dict[str, Recording] = {}
    for request in requests:
        label, controller = settings.controllers[request.controller]
        row = _row(settings, request)
        row["run_id"] = run_id(scenario, controller, settings.study.seed, settings.study.timestep_s)
        recording = _drive_one(settings, request, row, ready, controller)
        if settings.study.claims and recording is not None:
            recordings[label] = recording
        rows.append(row)
    if settings.study.claims:
        claims = _claims(settings.maneuvers[first.maneuver][0], recordings)
        for row in rows:
            row.update(claims)
    return rows


def _drive_one(settings: Settings, request: Request, row: Row, ready: Scenario, controller: str) -> Recording | None:
    """Make one run and fill its row; return the recording of a complete run."""
    path = _recording_path(settings, request)
    every = settings.study.recordings
    keeps = every == "all" or (isinstance(every, int) and request.sample % every == 0)
    try:
        recording = run_scenario(ready, controller, path=path if keeps else None, timestep_s=settings.study.timestep_s)
    except ActiveSteerError as error:
        row |= {"status": Status.FAILED.value, "error": _words_of(error)}
        if every == "failed" and path is not None and error.recording is not None and len(error.recording):
            try:
                error.recording.save(path)
            except ActiveSteerError as reason:
                row["error"] = f"{row['error']}; {reason}"
        return None
    every_steps = max(1, round(CURVE_STEP_S / settings.study.timestep_s))
    row.update((f"{CURVE}{name}", np.float32(recording[name][::every_steps])) for name in settings.study.curves)
    if problem := recording.metadata.get("metrics_error"):
        row |= {"status": Status.UNEVALUATED.value, "error": str(problem)[:_ERROR_CHARACTERS]}
        return None
    row["status"] = Status.OK.value
    row.update(
        (name, float(value)) for name, value in recording.metrics.items() if _is_kept(settings.study.metrics, name)
    )
    return recording


def _recording_path(settings: Settings, request: Request) -> Path | None:
    if settings.folder is None or settings.study.recordings == "none":
        return None
    maneuver, controller = settings.maneuvers[request.maneuver][0], settings.controllers[request.controller][0]
    return settings.folder / f"{request.run:07d}-{maneuver}-{file_word(controller)}.mcap"


@functools.lru_cache(maxsize=4096)
def _is_kept(patterns: tuple[str, ...], name: str) -> bool:
    return not patterns or any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def _claims(maneuver: str, recordings: Mapping[str, Recording]) -> dict[str, float]:
    """Return the verdicts (1 if a claim of the paper holds, else 0) and distances; empty if a run is missing."""
    try:
        claims = SCENARIOS[maneuver](recordings)
    except (KeyError, ActiveSteerError):
        return {}
    failed = sum(not claim.passed for claim in claims)
    verdicts = {f"{CLAIM}{claim.id}": float(claim.passed) for claim in claims}
    return verdicts | {f"{DISTANCE}{claim.id}": claim.distance for claim in claims} | {"claims_failed": float(failed)}


def failed_row(settings: Settings, request: Request, status: Status, problem: str) -> Row:
    """Return the row of an incomplete run."""
    return _row(settings, request) | {"status": status.value, "error": problem}


def _row(settings: Settings, request: Request) -> Row:
    return {
        "run": request.run,
        "run_id": "",
        "sample": request.sample,
        "maneuver": settings.maneuvers[request.maneuver][0],
        "vehicle": settings.vehicles[request.vehicle][0],
        "controller": settings.controllers[request.controller][0],
        **request.factors,
        "status": Status.FAILED.value,
        "error": "",
    }


def _words_of(error: ActiveSteerError) -> str:
    text = "; ".join([f"{type(error).__name__}: {error}", *getattr(error, "__notes__", [])])
    return text[:_ERROR_CHARACTERS]

"""The runs of a report: opened, named, and put together by the manoeuvre that they drive."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.analysis.claims import SCENARIOS
from activesteer.conventions import RunLook, run_looks
from activesteer.errors import ParameterError, RecordingError
from activesteer.recording import Recording
from activesteer.recording.run_names import run_names

MAX_RUNS: Final = 60
"""More runs than this make a page that nobody can read, and that a browser is slow to open."""


class Run(NamedTuple):
    """A recording as it is shown.

    Attributes:
        source: Where it comes from, such as the name of its file.
        recording: The recording.
        name: What its column is called, short (`ars`).
        look: Label, colour and dashes of its curves.
    """

    source: str
    recording: Recording
    name: str
    look: RunLook

    @property
    def problem(self) -> str:
        """Why the run did not end properly; empty where it did."""
        metadata = self.recording.metadata
        return "" if metadata.get("complete", True) else str(metadata.get("error", "the run did not end properly"))


class Group(NamedTuple):
    """Runs of one manoeuvre, in the paper's order.

    Attributes:
        name: Name of the manoeuvre.
        title: The same in words.
        runs: At least one.
    """

    name: str
    title: str
    runs: tuple[Run, ...]

    def by_name(self) -> dict[str, Recording]:
        """Recordings by name of the run."""
        return {run.name: run.recording for run in self.runs}


def open_all(paths: Iterable[str | os.PathLike[str]]) -> dict[str, Recording]:
    """Recordings by path; of a file that was cut short or damaged, what can be read.

    Raises:
        ParameterError: a file is named twice.
        RecordingError: a file cannot be read.
    """
    recordings: dict[str, Recording] = {}
    for path in paths:
        if str(path) in recordings:
            raise ParameterError(f"{path} is named twice", value=path)
        recordings[str(path)] = Recording.open(Path(path), recover=True)
    return recordings


def groups_of(recordings: Mapping[str, Recording]) -> list[Group]:
    """The runs by manoeuvre: those of the paper in its order, then the others as they come.

    Args:
        recordings: By where they come from.

    Raises:
        ParameterError: there is none, or there are more than `MAX_RUNS`.
        RecordingError: a recording has no rows.
    """
    if not 1 <= len(recordings) <= MAX_RUNS:
        raise ParameterError(f"{len(recordings)} recordings; a report is made of 1 to {MAX_RUNS}", allowed=MAX_RUNS)
    by_maneuver: dict[str, dict[str, Recording]] = {}
    for source, recording in recordings.items():
        if len(recording) == 0:
            raise RecordingError(f"{source} has no rows: nothing was recorded before the run ended", value=source)
        by_maneuver.setdefault(entry(recording, "maneuver", "name") or "run", {})[source] = recording
    ordered = [name for name in SCENARIOS if name in by_maneuver]
    ordered += [name for name in by_maneuver if name not in SCENARIOS]
    return [_group(name, by_maneuver[name]) for name in ordered]


def entry(recording: Recording, table: str, key: str) -> str:
    """An entry of a table of the metadata as text; empty where it does not exist."""
    values: Any = recording.metadata.get(table)
    return str(values.get(key, "")) if isinstance(values, Mapping) else ""


def _group(name: str, recordings: Mapping[str, Recording]) -> Group:
    named = dict(zip(run_names(list(recordings), recordings.values()), recordings.items(), strict=True))
    runs = tuple(Run(*named[run], run, look) for run, look in run_looks(named).items())
    return Group(name, entry(runs[0].recording, "maneuver", "title") or name, runs)

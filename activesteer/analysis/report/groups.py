"""The runs of a report, opened, named and grouped by manoeuvre."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from activesteer.analysis.claims.judge import SCENARIOS, SYSTEMS
from activesteer.analysis.claims.scorecard import (
    LITERATURE,
    PAPER,
    SETTINGS,
    Scorecard,
    claims_for,
    scorecard,
    setting_of,
)
from activesteer.analysis.harm import failures, kept
from activesteer.analysis.path_following import judged_metrics
from activesteer.analysis.source import entry
from activesteer.analysis.step_response import without_response
from activesteer.core.conventions import RunLook, run_looks
from activesteer.core.metric_table import SIDESLIP_PEAKS, metric
from activesteer.errors import ActiveSteerError, ParameterError, RecordingError
from activesteer.recording import Recording
from activesteer.recording.contents import Event, events_of
from activesteer.recording.recording import run_names


def judge(group: Group) -> Scorecard:
    """Check the paper's claims about the runs of a group. If that is impossible, return the reason."""
    # The group must hold a complete run of each of the three systems, in the same manoeuvre with the same car.
    recordings = {run.name: run.recording for run in group.runs}
    check = claims_for(group.runs[0].recording)
    if check is None:
        return Scorecard(())
    if missing := [system for system in SYSTEMS if system not in recordings]:
        return Scorecard((), obstacle=f"no run of {', '.join(missing)}, and the claims compare {', '.join(SYSTEMS)}")
    systems = [recordings[system] for system in SYSTEMS]
    for system, recording in zip(SYSTEMS, systems, strict=True):
        if not recording.metadata.get("complete", True):
            return Scorecard((), obstacle=f"the run {system} is not complete")
    if not (_same(systems, "maneuver") and _same(systems, "vehicle")):
        return Scorecard((), obstacle="the three runs differ in manoeuvre or vehicle; see the parameters")
    try:
        claims, setting = check(recordings), setting_of(systems[0])
        return scorecard(claims, entry(systems[0], "vehicle", "name"), setting=setting or LITERATURE)
    except ActiveSteerError as error:
        return Scorecard((), obstacle=str(error))


def _same(recordings: list[Recording], table: str) -> bool:
    return all(recording.metadata.get(table) == recordings[0].metadata.get(table) for recording in recordings)


MAX_RUNS: Final = 60
"""Largest number of runs in a report. With more runs, nobody can read the page and a browser is slow to open it."""

MOST_EVENTS: Final = 20
"""Largest number of events of a run in a report."""


class ReportedRun(NamedTuple):
    """A recording in a report."""

    source: str  # its origin, such as the name of its file
    recording: Recording  # the recording
    name: str  # short name of its column (`ars`)
    look: RunLook  # label, colour and dashes of its curves

    @property
    def problem(self) -> str:
        """Reason why the run is incomplete, empty for a complete run."""
        metadata = self.recording.metadata
        return "" if metadata.get("complete", True) else str(metadata.get("error", "the run did not end properly"))

    @property
    def metrics(self) -> Mapping[str, float]:
        """Metrics to show: see `judged_metrics` and `without_response`."""
        return without_response(self.recording, judged_metrics(self.recording))

    @property
    def by_hand(self) -> bool:
        """True if a person drove."""
        return entry(self.recording, "driver", "name") == "by hand"

    @property
    def events(self) -> list[Event]:
        """Events during the run, without the result of a drive."""
        listed = events_of(self.recording.metadata)
        return listed[:-1] if self.result else listed

    @property
    def result(self) -> str:
        """Result of a drive from its last event, such as the time of the last lap. Empty if there is none."""
        last = events_of(self.recording.metadata)[-1:] if self.by_hand else []
        end_s = self.recording.time_s[-1]
        return "".join(event.what for event in last if event.kind == "note" and event.time_s >= end_s)


class Group(NamedTuple):
    """Runs of one manoeuvre, in the paper's order."""

    name: str  # name of the manoeuvre
    title: str  # its name in words
    runs: tuple[ReportedRun, ...]  # the runs, at least one


def open_all(paths: Iterable[str | os.PathLike[str]]) -> dict[str, Recording]:
    """Open recordings, or the readable part of an incomplete or damaged recording."""
    recordings: dict[str, Recording] = {}
    for path in paths:
        if str(path) in recordings:
            raise ParameterError(f"{path} is given twice; leave one out", value=path)
        recordings[str(path)] = Recording.open(Path(path), recover=True)
    return recordings


def groups_of(recordings: Mapping[str, Recording]) -> list[Group]:
    """Return the runs by manoeuvre, in the paper's order. Runs in the paper's setting form separate groups."""
    if not 1 <= len(recordings) <= MAX_RUNS:
        raise ParameterError(f"{len(recordings)} recordings; a report takes 1 to {MAX_RUNS}", allowed=MAX_RUNS)
    by_maneuver: dict[tuple[str, bool], dict[str, Recording]] = {}
    for source, recording in recordings.items():
        if len(recording) == 0:
            raise RecordingError(f"{source} has no rows: nothing was recorded before the run ended", value=source)
        key = entry(recording, "maneuver", "name") or "run", setting_of(recording) == PAPER
        by_maneuver.setdefault(key, {})[source] = recording
    ordered = [(name, paper) for name in SCENARIOS for paper in (True, False) if (name, paper) in by_maneuver]
    ordered += [key for key in by_maneuver if key not in ordered]
    return [_group(name, by_maneuver[name, paper], paper=paper) for name, paper in ordered]


def _group(name: str, recordings: Mapping[str, Recording], *, paper: bool) -> Group:
    named = dict(zip(run_names(list(recordings), recordings.values()), recordings.items(), strict=True))
    looks = run_looks(named)
    # As in the tables, a run has its name; the label of a system explains the name, without the paper's number.
    labels = {run: run if look.label == run else f"{run}: {look.label[2:]}" for run, look in looks.items()}
    runs = tuple(ReportedRun(*named[run], run, look._replace(label=labels[run])) for run, look in looks.items())
    title = entry(runs[0].recording, "maneuver", "title") or name
    return Group(name, f"{title}: {SETTINGS[PAPER]}" if paper else title, runs)


_ALSO: Final = ("yaw_rate_steady_state_radps", "stopping_distance_m", "steering_wheel_rms_rad")
"""Metrics that the outcome names if a manoeuvre has them."""


def outcome(recording: Recording) -> str:
    """Describe failures, met requirements and key figures of a run, in the words of the report."""
    metadata, metrics = recording.metadata, judged_metrics(recording)
    if not metadata.get("complete", True):
        return f"the run did not end properly: {metadata.get('error', 'no reason is recorded')}"
    said = [*failures(recording), *kept(metrics)]
    peaks = [name for name in SIDESLIP_PEAKS if name in metrics]
    for name in (*peaks[:1], *_ALSO):
        if name in metrics:
            shown = metric(name)
            said.append(f"{shown.label} {shown.text(metrics[name])} {shown.unit.name}")
    return ", ".join(said)


def verdict(recordings: Mapping[str, Recording]) -> list[str]:
    """Return a line for each run, then a line for each claim of the paper about them."""
    lines = [f"{name}: {outcome(recording)}" for name, recording in recordings.items()]
    groups = groups_of({f"{name}.mcap": recording for name, recording in recordings.items()})
    judged = judge(groups[0]).judged if len(groups) == 1 else ()
    return lines + [f"{item.claim.id} {item.verdict.value}: {item.claim.text}" for item in judged]

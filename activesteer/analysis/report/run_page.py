"""The report of runs as one HTML page that needs no other file and no network."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Final, NamedTuple

from activesteer.analysis.claims.scorecard import Scorecard, Verdict, number_lines
from activesteer.analysis.report.curves import plots
from activesteer.analysis.report.groups import Group, Judgement, entry, groups_of, judge
from activesteer.analysis.report.tables import (
    HEADLINE,
    Change,
    MetricRow,
    Result,
    Row,
    changed_parameters,
    file_rows,
    key_titles,
    metric_rows,
    metric_titles,
    results,
    rows,
    verdict_counts,
)
from activesteer.analysis.tables import notes
from activesteer.errors import ParameterError
from activesteer.files import write_text
from activesteer.pages import render
from activesteer.recording import Recording
from activesteer.recording.contents import events_of
from activesteer.theory.proportions import percent
from activesteer.units import typeset

TITLE: Final = "activesteer report"
_VERDICT_CLASS: Final = {
    Verdict.PASSED: "passed",
    Verdict.FAILED: "failed",
    Verdict.NOT_REPRODUCED: "known",
    Verdict.UNEXPECTED: "passed",
}
_VERDICT_MARK: Final = {
    Verdict.PASSED: "\N{CHECK MARK}",
    Verdict.FAILED: "\N{BALLOT X}",
    Verdict.NOT_REPRODUCED: "\N{NOT EQUAL TO}",
    Verdict.UNEXPECTED: "\N{CHECK MARK}",
}
_CHANGE_MARK: Final = {
    Change.BETTER: "\N{CHECK MARK}",
    Change.WORSE: "\N{BALLOT X}",
    Change.SAME: "\N{ALMOST EQUAL TO}",
    Change.OTHER: "",
}
"""Marks beside the colours, for readers who cannot see these."""


_MOST_EVENTS: Final = 20


class _Section(NamedTuple):
    """Content of one manoeuvre. The template uses these names."""

    anchor: str
    group: Group
    judgement: Judgement
    changed: list[str]
    key_titles: list[str]
    results: list[Result]
    metric_titles: list[str]
    metrics: list[MetricRow]
    parameters: list[Row]
    names: list[str]


def write_report(recordings: Mapping[str, Recording], path: str | os.PathLike[str]) -> Path:
    """Write the report of runs and return its path. An existing file is replaced.

    Args:
        recordings: Recordings by their origin, such as the names of their files.
        path: The HTML file.

    Raises:
        ParameterError: there is no recording, or the file cannot be written.
        RecordingError: a recording has no rows.
    """
    return write_text(path, report_page(recordings), ParameterError)


def report_page(recordings: Mapping[str, Recording], made: date | None = None) -> str:
    """Return the report of runs as HTML. The same recordings and date give the same page."""
    groups = groups_of(recordings)
    sections = [_section(group, f"group-{number}") for number, group in enumerate(groups, start=1)]
    several = len(groups) > 1
    runs = [run for group in groups for run in group.runs]
    every = [run.recording for run in runs]
    file_titles, files = file_rows(groups)
    cards = [section.judgement.scorecard for section in sections]
    everything = Scorecard(
        tuple(item for card in cards for item in card.judged),
        next((card.population for card in cards if card.population is not None), None),
    )
    return render(
        "report.html",
        title=TITLE if several else f"{TITLE}: {groups[0].title}",
        heading=f"Report: {len(groups)} manoeuvres" if several else groups[0].title,
        headline=HEADLINE if any(HEADLINE in section.key_titles for section in sections) else "",
        facts=_facts(groups, made or date.today()),
        runs=runs,
        sections=sections,
        verdicts=verdict_counts(cards),
        verdict_class=_VERDICT_CLASS,
        verdict_mark=_VERDICT_MARK,
        change_mark=_CHANGE_MARK,
        by_proportion=everything.by_proportion(),
        population=everything.population,
        number_lines=number_lines,
        typeset=typeset,
        percent=percent,
        friction_utilisation_notes=lambda runs: notes({run.name: run.recording.metrics for run in runs}),
        names=[f"{group.name} {run.name}" if several else run.name for group in groups for run in group.runs],
        vehicle=rows(every, "vehicle"),
        versions=rows(every, "versions"),
        file_titles=file_titles,
        files=files,
        data=[{"anchor": section.anchor, **plots(section.group)} for section in sections],
    )


def _section(group: Group, anchor: str) -> _Section:
    recordings = [run.recording for run in group.runs]
    return _Section(
        anchor,
        group,
        judge(group),
        [*dict.fromkeys(filter(None, map(changed_parameters, group.runs))), *_events(group)],
        key_titles(group),
        results(group),
        metric_titles(group),
        metric_rows(group),
        rows(recordings, "controller", "maneuver", "timestep_s"),
        [run.name for run in group.runs],
    )


def _events(group: Group) -> list[str]:
    """Return what happened on the way, a line for each run."""
    listed = {run.name: events_of(run.recording.metadata) for run in group.runs}
    return [
        f"{name}, on the way: {', '.join(f'{event.what} at {event.time_s:.4g} s' for event in events[:_MOST_EVENTS])}"
        + (f" and {len(events) - _MOST_EVENTS} more" if len(events) > _MOST_EVENTS else "")
        for name, events in listed.items()
        if events
    ]


def _facts(groups: Sequence[Group], made: date) -> list[str]:
    """Return date, car, driver and versions of the program."""
    recordings = [run.recording for group in groups for run in group.runs]

    def every(table: str, key: str) -> str:
        return ", ".join(dict.fromkeys(value for run in recordings if (value := entry(run, table, key))))

    facts = [made.isoformat()]
    for word, value in (
        ("vehicle", every("vehicle", "name")),
        ("driver", every("driver", "name")),
        ("activesteer", every("versions", "activesteer")),
        ("MuJoCo", every("versions", "mujoco")),
    ):
        facts += [f"{word} {value}"] if value else []
    return facts

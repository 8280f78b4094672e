"""The report of runs as one HTML page that needs no other file and no network."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.analysis.claims.scorecard import Scorecard, Verdict, number_lines
from activesteer.analysis.harm import LOST, is_controlled, kept, losses, shown
from activesteer.analysis.metrics import KEY_FIGURES
from activesteer.analysis.report.curves import plots
from activesteer.analysis.report.groups import Group, ReportedRun, groups_of, judge
from activesteer.analysis.source import entry
from activesteer.analysis.tables import Cell, Change, difference_text, is_near, notes, number, significance
from activesteer.config import leaves
from activesteer.core.files import write_text
from activesteer.core.metric_table import Better, recorded_metric
from activesteer.core.units import display_unit, parameter_label, typeset
from activesteer.errors import ParameterError
from activesteer.pages import render
from activesteer.recording import Recording
from activesteer.recording.contents import events_of

TITLE: Final = "activesteer report"
_VERDICT_LOOK: Final = {
    Verdict.PASSED: ("passed", "\N{CHECK MARK}"),
    Verdict.FAILED: ("failed", "\N{BALLOT X}"),
    Verdict.NOT_REPRODUCED: ("known", "\N{NOT EQUAL TO}"),
    Verdict.UNEXPECTED: ("passed", "\N{CHECK MARK}"),
}
"""Verdict -> its class in the stylesheet, and its mark."""
_CHANGE_MARK: Final = {
    Change.BETTER: "\N{CHECK MARK}",
    Change.WORSE: "\N{BALLOT X}",
    Change.SAME: "\N{ALMOST EQUAL TO}",
    Change.OTHER: "",
}
"""Marks beside the colours, for readers who cannot see these."""
_MOST_EVENTS: Final = 20


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
    cards = [section["scorecard"] for section in sections]
    everything = Scorecard(tuple(item for card in cards for item in card.judged))
    return render(
        "report.html",
        title=TITLE if several else f"{TITLE}: {groups[0].title}",
        heading=f"Report: {len(groups)} manoeuvres" if several else groups[0].title,
        headline=HEADLINE if any(HEADLINE in section["key_titles"] for section in sections) else "",
        facts=_facts(groups, made or date.today()),
        runs=runs,
        sections=sections,
        verdicts=everything.counts,
        verdict_class={verdict: look[0] for verdict, look in _VERDICT_LOOK.items()},
        verdict_mark={verdict: look[1] for verdict, look in _VERDICT_LOOK.items()},
        change_mark=_CHANGE_MARK,
        number_lines=number_lines,
        typeset=typeset,
        friction_utilisation_notes=lambda runs: notes({run.name: run.recording.metrics for run in runs}),
        names=[f"{group.name} {run.name}" if several else run.name for group in groups for run in group.runs],
        vehicle=rows(every, "vehicle"),
        versions=rows(every, "versions"),
        file_titles=file_titles,
        files=files,
        data=[{"anchor": section["anchor"], **plots(section["group"])} for section in sections],
    )


def _section(group: Group, anchor: str) -> dict[str, Any]:
    """Return the content of one manoeuvre, by the names of the template."""
    recordings, first = [run.recording for run in group.runs], group.runs[0].name
    others = [title for run in group.runs[1:] for title in (run.name, f"{run.name} against {first}")]
    return {
        "anchor": anchor,
        "group": group,
        "scorecard": judge(group),
        "changed": [*dict.fromkeys(filter(None, map(changed_parameters, group.runs))), *_events(group)],
        "key_titles": list(key_figures(group)),
        "results": results(group),
        "metric_titles": ["Metric", "Unit", first, *others],
        "metrics": metric_rows(group),
        "parameters": rows(recordings, "controller", "maneuver", "timestep_s"),
        "names": [run.name for run in group.runs],
    }


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
    facts = [made.isoformat()]
    for word, table, key in (
        ("vehicle", "vehicle", "name"), ("driver", "driver", "name"), ("activesteer", "versions", "activesteer"),
        ("MuJoCo", "versions", "mujoco"),
    ):  # fmt: skip
        if values := dict.fromkeys(value for run in recordings if (value := entry(run, table, key))):
            facts.append(f"{word} {', '.join(values)}")
    return facts


class Row(NamedTuple):
    """A parameter."""

    key: str  # its name, with the names of its tables
    values: tuple[str, ...]  # its value in each run; a single value if all runs have the same

    @property
    def differs(self) -> bool:
        """True if the runs differ in this parameter."""
        return len(self.values) > 1


def rows(recordings: Sequence[Recording], *tables: str) -> list[Row]:
    """Return the entries of tables of the metadata: those of the first run in its order, then those of later runs."""
    flat = []
    for run in recordings:
        chosen = {key: run.metadata[key] for key in tables if key in run.metadata}
        one = chosen.get(tables[0])
        table = one if len(tables) == 1 and isinstance(one, Mapping) else chosen
        flat.append({".".join(path): _text(path[-1], value) for path, value in leaves(table).items()})
    found = []
    for key in dict.fromkeys(key for entries in flat for key in entries):
        values = tuple(entries.get(key, "") for entries in flat)
        found.append(Row(key, values if len(set(values)) > 1 else values[:1]))
    return found


def _text(key: str, value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return str(value).lower()
    if isinstance(value, int | float):
        unit, factor = display_unit(key)
        return typeset(f"{value:.6g}" if factor == 1.0 else f"{value:.6g} ({value * factor:.4g} {unit})")
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


MAX_FIGURES: Final = 6
"""Most key figures that can be read at a glance."""


HEADLINE: Final = "Peak sideslip [deg]"
"""Title of the key figure that is shown where there is room for only one."""


def results(group: Group) -> list[dict[str, Any]]:
    """Return failures, met requirements and key figures of each run of a group, compared with the first run."""
    chosen = key_figures(group).values()
    first = group.runs[0].recording.metrics
    lost = [[*(["incomplete"] if run.problem else []), *losses(run.recording.metrics)] for run in group.runs]
    found = []
    for place, run in enumerate(group.runs):
        metrics = run.recording.metrics
        well = [*kept(metrics)] or (["stays under control"] if any(lost) and not lost[place] else [])
        figures = [_figure(name, metrics, first if place else None) for name in chosen]
        if not (_is_judged(group.runs[0]) and _is_judged(run)):
            figures = [figure | {"change": Change.OTHER} for figure in figures]
        found.append({"run": run, "losses": lost[place], "kept": well, "figures": figures})
    return found


def _is_judged(run: ReportedRun) -> bool:
    """Return whether a change from or to this run can be good or bad: it is complete, and the car is controlled."""
    return not run.problem and is_controlled(run.recording.metrics)


def key_figures(group: Group) -> dict[str, str]:
    """Return the titles of the columns of key figures, with their units, and the metrics that any run has of them."""
    names = {name for run in group.runs for name in run.recording.metrics}
    found = {}
    for title, metrics in KEY_FIGURES.items():
        if name := next(filter(names.__contains__, metrics), ""):
            unit = recorded_metric(name).unit_name
            found[f"{title} [{unit}]" if unit else title] = name
    return dict(list(found.items())[:MAX_FIGURES])


def _figure(name: str, metrics: Mapping[str, float], first: Mapping[str, float] | None) -> dict[str, Any]:
    """Return the text of a key figure, and its difference from the first run with the significance, if it has one."""
    sizes = abs if recorded_metric(name).better is Better.SMALLER else float
    value = sizes(metrics.get(name, math.nan))
    text = shown(name, metrics, number(name, value))
    before = math.nan if first is None else sizes(first.get(name, math.nan))
    if LOST in (text, shown(name, first or {}, "")) or not math.isfinite(value - before):
        return {"text": text, "difference": "", "change": Change.OTHER}
    difference = difference_text(name, value, before)
    if is_near(name, value, before):
        return {"text": text, "difference": difference.text, "change": Change.SAME}
    change = significance(name, value, before)
    return {"text": text, "difference": difference.percent or difference.text, "change": change}


def file_rows(groups: Sequence[Group]) -> tuple[list[str], list[list[str]]]:
    """Return the titles of the table of files, and a row for each run."""
    runs = [(group, run) for group in groups for run in group.runs]
    changed = [changed_parameters(run) for _, run in runs]
    titles = ["File", "Manoeuvre", "Controller", "Vehicle", "Duration", *(["Changed"] if any(changed) else [])]
    rows = []
    for (group, run), overrides in zip(runs, changed, strict=True):
        span_s = float(run.recording.time_s[-1] - run.recording.time_s[0])
        controller = str(run.recording.metadata.get("controller", ""))
        vehicle = entry(run.recording, "vehicle", "name")
        rows.append([run.source, group.name, controller, vehicle, f"{span_s:.3f} s", overrides][: len(titles)])
    return titles, rows


def changed_parameters(run: ReportedRun) -> str:
    """Describe the overrides of a run, with their values and keys, or empty without overrides."""
    changed: Any = run.recording.metadata.get("overrides")
    labels = {key: parameter_label(key) for key in changed} if isinstance(changed, Mapping) else {}
    return ", ".join(f"{words} {changed[key]} {unit}".rstrip() + f" ({key})" for key, (words, unit) in labels.items())


def metric_rows(group: Group) -> list[dict[str, Any]]:
    """Return the metrics, with their differences from the first run."""
    values = [run.recording.metrics for run in group.runs]
    rows = []
    for name in dict.fromkeys(name for metrics in values for name in metrics):
        metric = recorded_metric(name)
        first, *others = (metrics.get(name, math.nan) for metrics in values)
        texts = [shown(name, run, number(name, run.get(name, math.nan))) for run in values]
        cells = [Cell(texts[0])]
        for value, text in zip(others, texts[1:], strict=True):
            compared = difference_text(name, value, first) if LOST not in (text, texts[0]) else Cell("\N{EN DASH}")
            cells += [Cell(text), compared]
        rows.append({"name": metric.label, "unit": metric.unit_name, "cells": cells})
    return rows

"""Puts a report together: one HTML page with everything in it, which needs nothing else and no network."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Final

from activesteer.analysis.report import tables
from activesteer.analysis.report.curves import plots
from activesteer.analysis.report.judgement import Judgement, judge
from activesteer.analysis.report.parameters import rows
from activesteer.analysis.report.runs import Group, entry, groups_of
from activesteer.errors import ParameterError
from activesteer.files import write_text
from activesteer.recording import Recording
from activesteer.version import __version__

TITLE: Final = "activesteer report"


def write_report(recordings: Mapping[str, Recording], path: str | os.PathLike[str]) -> Path:
    """Writes the report of runs; a file that exists is replaced.

    Args:
        recordings: By where they come from, such as the names of their files.
        path: The HTML file.

    Returns:
        The path.

    Raises:
        ParameterError: there is no recording, or the file cannot be written.
        RecordingError: a recording has no rows.
    """
    return write_text(path, report_page(recordings), ParameterError)


def report_page(recordings: Mapping[str, Recording]) -> str:
    """The report of runs, HTML: the same recordings give the same page.

    Args:
        recordings: By where they come from.

    Raises:
        ParameterError: there is no recording.
        RecordingError: a recording has no rows.
    """
    groups = groups_of(recordings)
    judgements = [judge(group) for group in groups]
    anchors = [f"group-{number}" for number in range(1, len(groups) + 1)]
    sections = [
        _section(group, anchor, judgement) for group, anchor, judgement in zip(groups, anchors, judgements, strict=True)
    ]
    data = [{"anchor": anchor, **plots(group)} for group, anchor in zip(groups, anchors, strict=True)]
    return Template(_asset("page.html")).substitute(
        title=escape(_title(groups)),
        summary=_summary(groups, anchors, judgements),
        sections="".join(sections),
        common=_common(groups),
        version=escape(__version__),
        styles=_asset("uPlot.min.css") + _asset("page.css"),
        # Inside a script element `</script` ends it, and `<!--<script` makes the browser look for the end elsewhere.
        data=json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        library=_asset("uPlot.iife.min.js"),
        licence=escape(" ".join(_asset("uPlot.LICENSE").split())),
        script=_asset("page.js"),
    )


def _title(groups: Sequence[Group]) -> str:
    return f"{TITLE}: {groups[0].title}" if len(groups) == 1 else TITLE


def _summary(groups: Sequence[Group], anchors: Sequence[str], judgements: Sequence[Judgement]) -> str:
    cards = [judgement.scorecard for judgement in judgements]
    runs = [run for group in groups for run in group.runs]
    vehicles = dict.fromkeys(entry(run.recording, "vehicle", "name") or "?" for run in runs)
    lines = [
        f"{len(runs)} run{'s' * (len(runs) > 1)} of {len(groups)} manoeuvre{'s' * (len(groups) > 1)}, "
        f"vehicle{'s' * (len(vehicles) > 1)} {escape(', '.join(vehicles))}."
    ]
    if verdicts := tables.verdict_counts(cards):
        counts = ", ".join(f"<b>{number}</b> {verdict.value}" for verdict, number in verdicts.items())
        lines.append(f"Of {sum(verdicts.values())} claims of the paper: {counts}.")
    incomplete = "".join(
        f'<p class="failed"><b>Incomplete:</b> {escape(run.source)}: {escape(problem)}</p>'
        for run in runs
        if (problem := run.problem)
    )
    contents = tables.contents(list(zip(groups, anchors, cards, strict=True)))
    return f"<p>{' '.join(lines)}</p>{incomplete}{contents}"


def _section(group: Group, anchor: str, judgement: Judgement) -> str:
    parts = [f'<section id="{anchor}" class="group"><h2>{escape(group.title)}</h2>']
    parts.append(f'<div class="toolbar" data-group="{anchor}"></div>')
    parts.append(f'<div class="plots" data-group="{anchor}"><noscript>The plots need JavaScript.</noscript></div>')
    if judgement.scorecard.judged:
        parts.append("<h3>What the paper claims</h3>" + tables.claims(judgement.scorecard, anchor))
    elif judgement.obstacle:
        parts.append(f'<p class="quiet">The claims of the paper are not judged: {escape(judgement.obstacle)}.</p>')
    if metrics := tables.metrics(group):
        parts.append(f"<h3>Metrics</h3>{metrics}")
    for run in group.runs:
        if problem := run.recording.metadata.get("metrics_error"):
            parts.append(f"<p>{escape(run.name)}: no metrics: {escape(str(problem))}</p>")
    found = rows([run.recording for run in group.runs], "controller", "maneuver", "timestep_s")
    names = [run.name for run in group.runs]
    parts.append(_folded("Manoeuvre: parameters", tables.parameters(found, names)))
    return "".join([*parts, "</section>"])


def _common(groups: Sequence[Group]) -> str:
    """What belongs to all runs: the vehicle, the files, and the versions that they were made with."""
    several = len(groups) > 1
    named = [(f"{group.name} {run.name}" if several else run.name, run) for group in groups for run in group.runs]
    recordings, names = [run.recording for _, run in named], [name for name, _ in named]
    vehicle, versions = rows(recordings, "vehicle"), rows(recordings, "versions")
    parts = []
    if differing := [row for row in vehicle if row.differs]:
        parts.append(f"<h3>Vehicle: what the runs differ in</h3>{tables.parameters(differing, names)}")
    same = [row for row in vehicle if not row.differs]
    parts.append(_folded("Vehicle: parameters of all runs", tables.parameters(same, names)))
    parts.append(f"<h3>Files</h3>{tables.files(groups)}")
    parts.append(f"<h3>Versions</h3>{tables.parameters(versions, names)}")
    return "".join(parts)


def _folded(title: str, content: str) -> str:
    return f"<details><summary>{escape(title)}</summary>{content}</details>"


def _asset(name: str) -> str:
    return files("activesteer.analysis.report").joinpath("assets", name).read_text(encoding="utf-8")

"""Content of the tables of a report, as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from activesteer.analysis.claims.scorecard import Scorecard, Verdict
from activesteer.analysis.harm import LOST, shown
from activesteer.analysis.report.groups import Group, Run, entry
from activesteer.metric_table import recorded_metric
from activesteer.units import parameter_label, typeset


class Cell(NamedTuple):
    """A number, or a difference with its percentage of the first run's value, if that has a meaning."""

    text: str
    percent: str = ""


class MetricRow(NamedTuple):
    """A metric of all runs of a group.

    Attributes:
        name: Its name in words.
        unit: Unit of the numbers.
        cells: Value of the first run, then value and difference from the first run of each other run.
    """

    name: str
    unit: str
    cells: tuple[Cell, ...]


def verdict_counts(scorecards: Iterable[Scorecard]) -> dict[Verdict, int]:
    """Return the number of claims by verdict, without verdicts of no claim."""
    verdicts = [item.verdict for card in scorecards for item in card.judged]
    return {verdict: verdicts.count(verdict) for verdict in Verdict if verdict in verdicts}


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


def changed_parameters(run: Run) -> str:
    """Describe the overrides of a run, with their values and keys; empty without overrides."""
    changed: Any = run.recording.metadata.get("overrides")
    return ", ".join(_told(*one) for one in changed.items()) if isinstance(changed, Mapping) else ""


def _told(key: str, value: Any) -> str:
    words, unit = parameter_label(key)
    return f"{words} {value} {unit}".rstrip() + f" ({key})"


def metric_titles(group: Group) -> list[str]:
    """Return the titles of the columns of `metric_rows`."""
    first, *others = (run.name for run in group.runs)
    return ["Metric", "Unit", first, *(title for name in others for title in (name, f"{name} against {first}"))]


def metric_rows(group: Group) -> list[MetricRow]:
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
        rows.append(MetricRow(metric.label, metric.unit_name, tuple(cells)))
    return rows


def number(name: str, value: float) -> str:
    """Write the value of a metric [SI] for display: three decimals, fewer for large values; a dash for nan."""
    if not math.isfinite(value):
        return "\N{EN DASH}"
    metric = recorded_metric(name)
    return metric.text(value) if metric.whole else _decimal(value * metric.unit.factor)


def difference_text(name: str, value: float, first: float) -> Cell:
    """Write the difference of a metric [SI] from its value in the first run.

    The cell has a percentage too, if the first value is significant and positive.
    """
    if not (math.isfinite(value) and math.isfinite(first)):
        return Cell("\N{EN DASH}")
    metric = recorded_metric(name)
    difference = (value - first) * metric.unit.factor
    if metric.whole:
        return Cell(typeset(f"{difference:+.0f}") if difference else "0")
    if abs(difference) < 0.0005:
        return Cell("0")
    text = f"{'+' if difference > 0.0 else ''}{_decimal(difference)}"
    nearly_nothing = max(metric.significance * metric.unit.factor, 0.01)
    if metric.unit.name == "%" or first * metric.unit.factor <= nearly_nothing:
        return Cell(text)
    if not 0.005 <= abs(share := (value - first) / first) < 10.0:
        return Cell(text)
    return Cell(text, typeset(f"{share * 100.0:+.0f}\N{NO-BREAK SPACE}%"))


def _decimal(value: float) -> str:
    decimals = next((decimals for top, decimals in ((10.0, 3), (100.0, 2), (1000.0, 1)) if abs(value) < top), 0)
    text = f"{value:.{decimals}f}"
    return typeset(text.lstrip("-") if float(text) == 0.0 else text)

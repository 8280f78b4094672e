"""Metrics as text in degrees and km/h: values, significant differences, and a table of runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Final, NamedTuple

from activesteer.analysis.harm import LOST, shown
from activesteer.core.metric_table import FRICTION_UTILISATION, recorded_metric
from activesteer.core.text_table import text_table, wrapped_line
from activesteer.core.units import typeset

Paint = Callable[[str, str, float, float, str], str]
"""Function from label of the run, name, values in this and the first run, and text to the shown text of a metric."""

_FRICTION_NOTE: Final = (
    "friction utilisation is the force of a tyre relative to its longitudinal and lateral peaks at pure slip; "
    "combined slip and shifts of the tyre file let it exceed 1"
)


def comparison(runs: Mapping[str, Mapping[str, float]], paint: Paint | None = None) -> str:
    """Return a table of metrics (rows) and runs (columns)."""
    names = list(dict.fromkeys(name for metrics in runs.values() for name in metrics))
    rows, first = [["", "", *runs]], next(iter(runs.values()), {})
    for name in names:
        metric = recorded_metric(name)
        numbers = [
            shown(name, metrics, metric.text(metrics[name])) if name in metrics else "" for metrics in runs.values()
        ]
        for place, (run, metrics) in enumerate(runs.items()):
            if paint is not None and place and name in metrics and name in first and LOST not in numbers:
                numbers[place] = paint(run, name, metrics[name], first[name], numbers[place])
        rows.append([metric.label, metric.unit.name, *numbers])
    return "\n".join(
        (*text_table(rows, text=2, repeat=2, least=8), *(line for note in notes(runs) for line in wrapped_line(note)))
    )


def notes(runs: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Return explanations of values that a reader may mistake for errors."""
    above = any(metrics.get(name, 0.0) > 1.0 for metrics in runs.values() for name in FRICTION_UTILISATION)
    return [_FRICTION_NOTE] if above else []


_NEAR_SHARE: Final = 0.005
"""Fraction of a value below which a difference is shown without a percentage. Values of a metric without a known
significance count as equal below it."""


class Change(StrEnum):
    """Significance of a difference from the first run."""

    BETTER = "better"
    WORSE = "worse"
    SAME = "same"
    """Neither a driver nor a sensor in a test car can distinguish the values."""
    OTHER = "other"
    """The values differ, and neither is better."""


def significance(name: str, value: float, first: float) -> Change:
    """Compare a metric with its value in the first run."""
    metric = recorded_metric(name)
    if metric.better is None or not math.isfinite(value - first):
        return Change.OTHER
    size, before = metric.cost(value), metric.cost(first)
    if is_near(name, size, before):
        return Change.SAME
    return Change.BETTER if size < before else Change.WORSE


def is_near(name: str, value: float, first: float) -> bool:
    """Return whether two values [SI] differ by less than a driver or a sensor can notice."""
    least = recorded_metric(name).significance or _NEAR_SHARE * abs(first)
    return abs(value - first) <= least or difference_text(name, value, first).text == "0"


class Cell(NamedTuple):
    """Cell of a table: a number or a difference, and a percentage of the first run's value if meaningful."""

    text: str
    percent: str = ""


def number(name: str, value: float) -> str:
    """Format the value of a metric [SI]."""
    if not math.isfinite(value):
        return "\N{EN DASH}"
    metric = recorded_metric(name)
    return metric.text(value) if metric.whole else _decimal(value * metric.unit.factor)


def difference_text(name: str, value: float, first: float) -> Cell:
    """Format the difference of a metric [SI] from its value in the first run."""
    # The cell has a percentage too, if the first value is significant and positive.
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
    if not _NEAR_SHARE <= abs(share := (value - first) / first) < 10.0:
        return Cell(text)
    return Cell(text, typeset(f"{share * 100.0:+.0f}\N{NO-BREAK SPACE}%"))


def _decimal(value: float) -> str:
    decimals = next((decimals for top, decimals in ((10.0, 3), (100.0, 2), (1000.0, 1)) if abs(value) < top), 0)
    return typeset(f"{value:z.{decimals}f}")

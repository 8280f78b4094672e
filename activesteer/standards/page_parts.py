"""Tables and panels of the pages of several standards."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from activesteer.metric_table import metric
from activesteer.pages import Table
from activesteer.plotting import Curve, Panel
from activesteer.units import quantity_of


def metrics_table(title: str, runs: Mapping[str, Mapping[str, float]]) -> Table:
    """Return a table of metrics with a column for each run; a run without a metric has an empty cell."""
    names = list(dict.fromkeys(name for metrics in runs.values() for name in metrics))
    rows = [
        [shown.label, shown.unit.name, *(shown.text(metrics.get(shown.name, math.nan)) for metrics in runs.values())]
        for shown in map(metric, names)
    ]
    return Table(title, ("", "unit", *runs), rows)


def axis_label(name: str) -> str:
    """Return label and unit of a channel, for an axis."""
    shown = quantity_of(name)
    return f"{shown.label} [{shown.unit.name}]"


class OverTime(Protocol):
    """A run whose channels can be drawn."""

    def over_time(self, channel: str, *, begin_s: float = 0.0, **words: Any) -> Curve:
        """Return a channel over the time from an instant [s]."""
        ...


def time_panels(runs: Mapping[str, OverTime], channels: Sequence[str], begin_s: float, begin: str) -> list[Panel]:
    """Return channels of runs over time, a panel each; time counts from an instant, which is also given in words."""
    return [
        Panel(
            f"time from {begin} [s]",
            axis_label(channel),
            [run.over_time(channel, begin_s=begin_s, label=label) for label, run in runs.items()],
        )
        for channel in channels
    ]


def cell(value: float | None, digits: int) -> str:
    """Format a number for a table: a hyphen for None or nan, and no minus before a zero."""
    return "-" if value is None or math.isnan(value) else f"{round(value, digits) + 0.0:.{digits}f}"

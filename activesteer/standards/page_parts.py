"""What a page of a test shows: tables, and pictures of curves in panels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from numpy.typing import ArrayLike

from activesteer.metric_table import metric
from activesteer.quantities import quantity_of


class Curve(NamedTuple):
    """A curve in a panel, in the units of its axes.

    Attributes:
        x: Abscissa, shape (n,).
        y: Ordinate, shape (n,).
        label: Its name in the legend; none where empty.
        shade: Place on a scale of colours from 0 to 1, of a curve that is one of many; None for a colour of its own.
        marked: Whether its points are drawn.
        joined: Whether they are joined by a line.
    """

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    shade: float | None = None
    marked: bool = False
    joined: bool = True


class Panel(NamedTuple):
    """A pair of axes.

    Attributes:
        x_label: Name and unit of the abscissa.
        y_label: Name and unit of the ordinate.
        curves: What is drawn.
        title: What stands above.
        limits: Values of the ordinate that a standard sets, with their names.
        log: Whether the abscissa is logarithmic.
        names: Names of the ordinates 0, 1, ... from above, where these are no numbers.
    """

    x_label: str
    y_label: str
    curves: Sequence[Curve]
    title: str = ""
    limits: Sequence[tuple[float, str]] = ()
    log: bool = False
    names: Sequence[str] = ()


class Picture(NamedTuple):
    """Panels beside each other.

    Attributes:
        title: What they show.
        panels: The panels.
        scale: What the colours of curves with a shade mean: name, least and greatest value.
    """

    title: str
    panels: Sequence[Panel]
    scale: tuple[str, float, float] | None = None


class Table(NamedTuple):
    """A table.

    Attributes:
        title: What it shows.
        columns: Heads, with units.
        rows: Cells, as they are read.
        outside: Numbers of the rows that break a limit.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    outside: frozenset[int] = frozenset()


def metrics_table(title: str, runs: Mapping[str, Mapping[str, float]]) -> Table:
    """Metrics of runs beside each other.

    Args:
        title: What they are.
        runs: Head of a column -> metrics; a run without a metric has an empty cell.
    """
    names = list(dict.fromkeys(name for metrics in runs.values() for name in metrics))
    rows = [
        [shown.label, shown.unit.name, *(shown.text(metrics.get(shown.name, math.nan)) for metrics in runs.values())]
        for shown in map(metric, names)
    ]
    return Table(title, ("", "unit", *runs), rows)


def axis_label(name: str) -> str:
    """Label and unit of a channel, as they stand at an axis."""
    shown = quantity_of(name)
    return f"{shown.label} [{shown.unit.name}]"


class OverTime(Protocol):
    """A run whose channels can be drawn."""

    def over_time(self, channel: str, *, begin_s: float = 0.0, **words: Any) -> Curve:
        """A channel over the time from an instant [s]."""
        ...


def time_panels(runs: Mapping[str, OverTime], channels: Sequence[str], begin_s: float, begin: str) -> list[Panel]:
    """Channels of runs over time, a panel each.

    Args:
        runs: Label -> run.
        channels: Channels.
        begin_s: What time is counted from [s].
        begin: What that is, in words.
    """
    return [
        Panel(
            f"time from {begin} [s]",
            axis_label(channel),
            [run.over_time(channel, begin_s=begin_s, label=label) for label, run in runs.items()],
        )
        for channel in channels
    ]


def cell(value: float | None, digits: int) -> str:
    """A number in a table: a hyphen where there is none, and no minus before a zero."""
    return "-" if value is None or math.isnan(value) else f"{round(value, digits) + 0.0:.{digits}f}"

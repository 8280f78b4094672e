"""Parts of a figure: panels with curves and areas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from numpy.typing import ArrayLike

from activesteer.core.conventions import Array

Dashes = str | tuple[float, tuple[float, ...]]
"""Dashes of a line as matplotlib takes them, or empty for points without a line."""


class Curve(NamedTuple):
    """A curve of a panel."""

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    colour: str = ""  # empty for the next colour of the panel
    dashes: Dashes | None = None  # None for a full or a dashed line in turn
    width: float = 1.2  # of the line [pt]
    marker: str = ""  # as matplotlib names it
    size: float = 3.0  # of the marker [pt]
    shade: float | None = None  # place on the figure's colour scale, 0 to 1; None for a separate colour


class Area(NamedTuple):
    """A filled area between two curves."""

    x: ArrayLike
    low: ArrayLike
    high: ArrayLike
    label: str = ""
    colour: str = "#cfe0ee"
    alpha: float = 1.0  # opacity, 0 to 1
    edge: str = ""  # colour of its outline; empty for none


class Panel(NamedTuple):
    """A panel: a pair of axes with curves, and areas behind them."""

    x_label: str  # empty where the panel below has the same abscissa
    y_label: str
    curves: Sequence[Curve] = ()
    title: str = ""
    areas: Sequence[Area] = ()
    limits: Sequence[tuple[float, str]] = ()  # ordinates that a standard sets, with their names
    names: Sequence[str] = ()  # of the ordinates 0, 1, ... from above, if the ordinates are not numbers
    notes: Sequence[tuple[float, float, str]] = ()  # at x, y: hang below their points, or next to them in named rows
    log: str = ""  # logarithmic axes: empty, `x` or `xy`
    x_range: tuple[float | None, float | None] | None = None  # None for what the curves need
    y_range: tuple[float | None, float | None] | None = None
    zero: bool = False  # whether lines through zero are drawn
    equal: bool = False  # whether a unit is equally long on both axes
    legend: str | None = ""  # its title; None for no legend
    # Label of a second abscissa above the panel, and pairs of values of the first and the second abscissa.
    above: tuple[str, Array, Array] | None = None


class Heat(NamedTuple):
    """A panel with a grid of coloured cells."""

    values: ArrayLike  # depth of the colour of each field; nan for a blank field
    texts: Sequence[Sequence[str]]
    columns: Sequence[str]
    rows: Sequence[str]
    span: tuple[float, float]  # values at the ends of the colours
    colours: str | Sequence[str]  # or the name of a colour map of matplotlib
    title: str = ""
    x_label: str = ""
    rules: Sequence[int] = ()  # rows with a line above them


class Picture(NamedTuple):
    """A figure: panels in rows and columns."""

    title: str
    panels: Sequence[Panel | Heat]
    scale: tuple[str, float, float] | None = None  # meaning of the shades of curves: name, least and greatest value
    columns: int = 0  # next to each other; 0 for a number that fits
    width_in: float = 9.0
    height_in: float = 0.0  # 0 for a height that fits
    legend: Sequence[tuple[str, str]] = ()  # label and colour of more entries below all panels
    widths: Sequence[float] = ()  # of the columns, relative; empty for equal ones

"""Parts of a figure: panels with curves and areas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from numpy.typing import ArrayLike

from activesteer.core.conventions import Array

Dashes = str | tuple[float, tuple[float, ...]]
"""Dashes of a line as matplotlib takes them, or empty for points without a line."""


class Curve(NamedTuple):
    """A curve of a panel.

    Attributes:
        x: Abscissa, shape (n,).
        y: Ordinate, shape (n,).
        label: Its name in the legend; empty for none.
        colour: Its colour; empty for the next colour of the panel.
        dashes: Its dashes; None for a full or a dashed line in turn.
        width: Width of the line [pt].
        marker: Marker of its points, as matplotlib names it; empty for none.
        size: Size of the marker [pt].
        shade: Place on the figure's colour scale, from 0 to 1; None for a separate colour.
    """

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    colour: str = ""
    dashes: Dashes | None = None
    width: float = 1.2
    marker: str = ""
    size: float = 3.0
    shade: float | None = None


class Area(NamedTuple):
    """A filled area between two curves.

    Attributes:
        x: Abscissa, shape (n,).
        low: Lower edge, shape (n,) or a number.
        high: Upper edge, likewise.
        label: Its name in the legend; empty for none.
        colour: Its colour.
        alpha: Its opacity, from 0 to 1.
        edge: Colour of its outline; empty for none.
    """

    x: ArrayLike
    low: ArrayLike
    high: ArrayLike
    label: str = ""
    colour: str = "#cfe0ee"
    alpha: float = 1.0
    edge: str = ""


class Panel(NamedTuple):
    """A panel: a pair of axes with curves.

    Attributes:
        x_label: Name and unit of the abscissa; empty where the panel below has the same abscissa.
        y_label: Name and unit of the ordinate.
        curves: The curves.
        title: Text above the panel.
        areas: Areas behind the curves.
        limits: Ordinates that a standard sets, with their names.
        names: Names of the ordinates 0, 1, ... from above, if the ordinates are not numbers.
        notes: Abscissa, ordinate and text of notes, which hang below their points, or next to them in named rows.
        log: Axes with a logarithmic scale: empty, `x` or `xy`.
        x_range: Least and greatest abscissa; None for what the curves need.
        y_range: Least and greatest ordinate, likewise.
        zero: Whether lines through zero are drawn.
        equal: Whether a unit is equally long on both axes.
        legend: Title of the legend; None for no legend.
        above: Label of a second abscissa above the panel, and pairs of values of the first and the second abscissa;
            None for no second one.
    """

    x_label: str
    y_label: str
    curves: Sequence[Curve] = ()
    title: str = ""
    areas: Sequence[Area] = ()
    limits: Sequence[tuple[float, str]] = ()
    names: Sequence[str] = ()
    notes: Sequence[tuple[float, float, str]] = ()
    log: str = ""
    x_range: tuple[float | None, float | None] | None = None
    y_range: tuple[float | None, float | None] | None = None
    zero: bool = False
    equal: bool = False
    legend: str | None = ""
    above: tuple[str, Array, Array] | None = None


class Heat(NamedTuple):
    """A panel with a grid of coloured cells.

    Attributes:
        values: Depth of the colour of each field; nan for a blank field, shape (rows, columns).
        texts: Text of each field.
        columns: Names of the columns.
        rows: Names of the rows.
        span: Values at the ends of the colours.
        colours: Colours from the one end to the other, or the name of a colour map of matplotlib.
        title: Text above the panel.
        x_label: Name and unit of what varies over the columns.
        rules: Rows with a line above them.
    """

    values: ArrayLike
    texts: Sequence[Sequence[str]]
    columns: Sequence[str]
    rows: Sequence[str]
    span: tuple[float, float]
    colours: str | Sequence[str]
    title: str = ""
    x_label: str = ""
    rules: Sequence[int] = ()


class Picture(NamedTuple):
    """A figure: panels in rows and columns.

    Attributes:
        title: Title of the figure.
        panels: The panels, row by row.
        scale: Meaning of the shades of curves: name, least and greatest value.
        columns: Number of panels next to each other; 0 for a number that fits.
        width_in: Width [in].
        height_in: Height [in]; 0 for a height that fits.
        legend: Label and colour of more entries of a legend below all panels.
        widths: Relative widths of the columns; empty for equal ones.
    """

    title: str
    panels: Sequence[Panel | Heat]
    scale: tuple[str, float, float] | None = None
    columns: int = 0
    width_in: float = 9.0
    height_in: float = 0.0
    legend: Sequence[tuple[str, str]] = ()
    widths: Sequence[float] = ()

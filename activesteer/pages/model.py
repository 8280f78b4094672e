"""Parts of a page: paragraphs, tables, points and figures, in sections."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from activesteer.core.conventions import RUN_COLOURS, Array
from activesteer.core.text_table import text_table, wrapped_line
from activesteer.plotting.model import Curve, Panel, Picture

_MOST_POINTS: Final = 2000
"""Largest number of points of a curve: twice the pixels of a chart."""
_DASHES: Final = {"-": (), "--": (4.0, 2.0), ":": (1.0, 1.6), "": None}
_GREY: Final = "#777777"


def picture_values(picture: Picture) -> dict[str, Any]:
    """Return a figure as JSON values; a panel without labels or title has those of its column or row."""
    panels = [panel for panel in picture.panels if isinstance(panel, Panel)]
    columns = picture.columns or len(panels)
    shown = []
    for place, panel in enumerate(panels):
        column, row = panels[place % columns :: columns], panels[place - place % columns : place + 1]
        values = _panel_values(panel)
        values["x"] = next((each.x_label for each in column[place // columns :] if each.x_label), "")
        values["y"] = _one_line(next((each.y_label for each in reversed(row) if each.y_label), ""))
        values["title"] = panel.title or (column[0].title if len(panels) > columns else "")
        shown.append(values)
    return {"panels": shown, "scale": picture.scale}


def _panel_values(panel: Panel) -> dict[str, Any]:
    own = 0
    curves = []
    for curve in panel.curves:
        colour, dashes = curve.colour, curve.dashes
        if curve.shade is None and not colour:
            colour = RUN_COLOURS[own % len(RUN_COLOURS)]
            dashes = ("--" if own % 2 else "-") if dashes is None else dashes
            own += 1
        curves.append(_curve_values(curve, _colour(colour), _DASHES.get(dashes) if isinstance(dashes, str) else dashes))
    areas = [
        {
            "x": _numbers(area.x), "label": area.label, "colour": _colour(area.colour), "alpha": area.alpha,
            "low": _numbers(area.low, area.x), "high": _numbers(area.high, area.x), "edge": area.edge,
        }
        for area in panel.areas
    ]  # fmt: skip
    above = panel.above and {
        "label": panel.above[0], "first": _numbers(panel.above[1]), "second": _numbers(panel.above[2])
    }  # fmt: skip
    return {
        "curves": curves, "areas": areas, "limits": list(panel.limits), "names": list(panel.names),
        "notes": list(panel.notes), "log": panel.log, "x_range": panel.x_range, "y_range": panel.y_range,
        "zero": panel.zero, "equal": panel.equal, "legend": panel.legend, "above": above,
    }  # fmt: skip


def _curve_values(curve: Curve, colour: str, dashes: Any) -> dict[str, Any]:
    x, y = np.asarray(curve.x, np.float64), np.asarray(curve.y, np.float64)
    if len(y) > _MOST_POINTS:
        kept = _extremes(y)
        x, y = x[kept], y[kept]
    if isinstance(dashes, tuple) and len(dashes) == 2 and isinstance(dashes[1], tuple):
        dashes = dashes[1]
    elif curve.dashes is None and dashes is None:
        dashes = ()
    steps = np.diff(x[np.isfinite(x)])
    return {
        "x": _numbers(x), "y": _numbers(y), "label": curve.label, "colour": colour, "dashes": dashes,
        "width": curve.width, "marker": curve.marker, "size": curve.size, "shade": curve.shade,
        "turns": bool((steps > 0.0).any() and (steps < 0.0).any()),
    }  # fmt: skip


def _colour(colour: str) -> str:
    """Return the page's name of a run colour, for light and dark mode, or the colour itself."""
    return f"run-{RUN_COLOURS.index(colour)}" if colour in RUN_COLOURS else colour if len(colour) == 7 else _GREY


def _extremes(y: Array) -> NDArray[np.intp]:
    """Return the indices of the extreme values in equal stretches of a long curve."""
    edges = np.linspace(0, len(y), _MOST_POINTS // 2 + 1).astype(int)
    low, high = np.where(np.isnan(y), np.inf, y), np.where(np.isnan(y), -np.inf, y)
    places = [
        start + np.array([low[start:end].argmin(), high[start:end].argmax()])
        for start, end in itertools.pairwise(edges.tolist())
    ]
    return np.unique(np.concatenate([[0], *places, [len(y) - 1]]))


def _numbers(values: ArrayLike, along: ArrayLike | None = None) -> list[float | None]:
    """Thin numbers and round them to five digits, with None for values that are not finite."""
    each = np.asarray(values, np.float64)
    if along is not None:
        each = np.broadcast_to(each, np.shape(along))
    every = -(-len(each) // _MOST_POINTS) or 1
    return [float(f"{value:.5g}") if np.isfinite(value) else None for value in each[::every].tolist()]


def _one_line(label: str) -> str:
    return " ".join(label.split())


Text = str | Markup
"""Content of a page. Text is escaped, and markup must be made by `Markup`."""


_NARROW: Final = 3
"""Largest number of columns that fit on a phone."""
_LONG: Final = 60
"""Length of a cell that needs a separate line on a phone."""
_LONG_WORD: Final = 24
"""Length of a word that needs a separate line on a phone."""
_NUMBER: Final = re.compile(r"[+\-\N{MINUS SIGN}]?\d[\d.]*(e[+-]?\d+)?|none|-|\N{EN DASH}")


def _is_numeric(column: Sequence[str]) -> bool:
    """Return whether all cells are numbers or say that there is none. The controller `none` is a word."""
    return all(map(_NUMBER.fullmatch, column)) and any(cell[-1:].isdigit() for cell in column)


class Table(NamedTuple):
    """Table of a page: columns, rows, and their layout."""

    title: str
    columns: Sequence[str]  # heads, with units
    rows: Sequence[Sequence[Text]]
    outside: frozenset[int] = frozenset()  # numbers of the rows that break a limit
    quiet: frozenset[int] = frozenset()  # numbers of the rows that nothing is asked of
    kind: str = "findings"  # class of the stylesheet
    numbers: int = 0  # number of columns at the end that hold numbers
    folded: bool = False  # a page shows only the title until a reader opens the table; paper shows up to 100 rows
    note: Text = ""

    @property
    def cards(self) -> bool:
        """True for a wide table, whose rows become cards on a phone."""
        if self.kind == "contents":  # its rows belong together
            return False
        cells = [_plain(cell) for row in self.rows for cell in row]
        # A long word, such as a key, would be broken.
        long = any(len(cell) > _LONG or any(len(word) > _LONG_WORD for word in cell.split()) for cell in cells)
        return long or len(self.columns) > _NARROW

    @property
    def number_columns(self) -> frozenset[int]:
        """Indices of the right-aligned columns: the last `numbers` columns, and numeric columns."""
        columns = [[_plain(cell) for cell in column] for column in zip(*self.rows, strict=True)]
        found = {place for place, column in enumerate(columns) if place and _is_numeric(column)}
        return frozenset(found.union(range(len(self.columns) - self.numbers, len(self.columns))))

    def lines(self) -> Iterator[str]:
        """Yield the table as aligned lines. `!` marks rows that break a limit, `~` rows without one."""
        rows = [[_plain(cell) for cell in row] for row in (self.columns, *self.rows)]
        places = range(-1, len(self.rows))
        marks = ["! " if place in self.outside else "~ " if place in self.quiet else "  " for place in places]
        yield from text_table(rows, text=len(self.columns), marks=marks)
        if self.note:
            yield from wrapped_line(_plain(self.note))


class Section(NamedTuple):
    """Section of a page: heading, paragraphs, tables, list, and figures."""

    title: str = ""
    texts: Sequence[Text] = ()
    tables: Sequence[Table] = ()  # before the figures, because a reader wants the verdict first
    points: Sequence[Text] = ()  # items of a list
    pictures: Sequence[Picture] = ()
    level: int = 2  # of its heading: 2, or 3 for a part of the section before
    kind: str = ""  # class of the list, or "repeated" for pictures of a table's values, which paper leaves out
    anchor: str = ""  # name for links and the page's script; the section ends with what the script draws


class Page(NamedTuple):
    """A page with its head, lead and sections, the first of which has level 2."""

    title: str  # of the window
    heading: Text
    lead: Sequence[Text]
    sections: Sequence[Section]
    scripts: Sequence[str] = ()  # in the order in which they run
    data: Mapping[str, Any] = MappingProxyType({})  # what these scripts draw, as JSON values

    def lines(self) -> Iterator[str]:
        """Yield heading, paragraphs and tables as lines."""
        for text in map(_plain, (self.heading, *self.lead)):
            yield from wrapped_line(text)
        for section in self.sections:
            if section.texts or section.tables:
                for text in map(_plain, filter(None, (section.title, *section.texts))):
                    yield from wrapped_line(text)
            for table in section.tables:
                if table.title:
                    yield from wrapped_line(_plain(table.title))
                yield from table.lines()


def _plain(text: Text) -> str:
    """Remove markup, ticks and crosses from a string."""
    if isinstance(text, Markup):
        text = Markup(str(text).replace("<br>", ", ")).striptags()
    return re.sub("[\N{CHECK MARK}\N{BALLOT X}] ", "", text)


def passed(words: str, *, chip: bool = False) -> Markup:
    """Return a string with a tick."""
    return Markup('<b class="{}passed">\N{CHECK MARK} {}</b>').format("chip " if chip else "", words)


def failed(words: str, *, chip: bool = False) -> Markup:
    """Return a string with a cross."""
    return Markup('<b class="{}failed">\N{BALLOT X} {}</b>').format("chip " if chip else "", words)

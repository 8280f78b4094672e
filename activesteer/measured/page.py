"""Measured beside simulated as one HTML page with its pictures in it, made to be printed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from activesteer.conventions import RUN_COLOURS
from activesteer.errors import ParameterError
from activesteer.files import write_text
from activesteer.measured.comparison import STANDARDS, Compared, Comparison, assumptions, words
from activesteer.pages import render
from activesteer.plotting import as_svg, new_figure, page_axis
from activesteer.quantities import quantity_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_page(found: Comparison, measured: list[str], simulated: str, path: Path) -> Path:
    """Writes the page; a file that exists is replaced.

    Args:
        found: What came out.
        measured: Names of the measured runs.
        simulated: Name of the simulated run.
        path: The HTML file.

    Raises:
        ParameterError: matplotlib is not installed, or the file cannot be written.
    """
    text = render(
        "comparison.html",
        found=found,
        standard=STANDARDS[found.standard],
        measured=measured,
        simulated=simulated,
        rows=[(words(each), each.inside) for each in found.quantities],
        assumptions=assumptions(found),
        pictures=[as_svg(draw(each, found.standard, len(measured))) for each in found.quantities],
    )
    return write_text(path, text, ParameterError)


def draw(found: Compared, standard: str, runs: int) -> Figure:
    """Overlay with the corridor, and the residual in it.

    Raises:
        ParameterError: matplotlib is not installed.
    """
    shown = quantity_of(found.channel)
    factor, across = shown.factor, standard == "iso19364"
    figure = new_figure(9.0, 2.6)
    left, right = figure.subplots(1, 2)
    order = found.simulated.argsort() if across else slice(None)
    x = found.x[order]
    if across:
        left.plot(x, factor * found.low[order], ".", color="#9bbbd4", ms=1.5, label="corridor of the simulation")
        left.plot(x, factor * found.high[order], ".", color="#9bbbd4", ms=1.5)
        left.plot(x, factor * found.simulated[order], ".", color=RUN_COLOURS[2], ms=2, label="simulated, nearest point")
    else:
        left.fill_between(x, factor * found.low, factor * found.high, color="#cfe0ee", lw=0.0, label="corridor")
        left.plot(x, factor * found.simulated, color=RUN_COLOURS[2], lw=1.2, label="simulated")
    style = {"ls": "", "marker": ".", "ms": 2.0} if across else {"lw": 1.2, "ls": "--"}
    label = "measured" if runs == 1 else f"measured, mean of {runs}"
    left.plot(x, factor * found.measured[order], color=RUN_COLOURS[1], label=label, **style)
    if runs > 1 and not across:
        edges = factor * (found.measured - found.confidence), factor * (found.measured + found.confidence)
        left.fill_between(x, *edges, color=RUN_COLOURS[1], alpha=0.3, lw=0.0, label="its 95 % interval")
    low, high = (factor * (edge - found.simulated)[order] for edge in (found.low, found.high))
    if across:
        right.plot(x, low, ".", color="#9bbbd4", ms=1.5)
        right.plot(x, high, ".", color="#9bbbd4", ms=1.5)
    else:
        right.fill_between(x, low, high, color="#cfe0ee", lw=0.0)
    right.plot(x, factor * found.residual[order], color="#333333", **(style | ({} if across else {"ls": "-"})))
    outside = ~found.within[order]
    if outside.any():
        right.plot(x[outside], factor * found.residual[order][outside], ".", color="#b3261e", ms=3, label="outside")
    for axis, title in ((left, shown.title), (right, f"Measured less simulated [{shown.unit.name}]")):
        page_axis(axis, title, "lateral acceleration [m/s²]" if across else "time of the simulation [s]")
    return figure

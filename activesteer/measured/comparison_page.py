"""Measured beside simulated as one HTML page with its pictures in it, made to be printed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from activesteer.conventions import RUN_COLOURS, Array
from activesteer.measured.comparison import STANDARDS, Compared, Comparison, assumptions, words
from activesteer.pages import Page, Section, Table, failed, passed
from activesteer.plotting import Area, Curve, Panel, Picture, as_svg, draw
from activesteer.units import quantity_of

_EDGE: Final = "#9bbbd4"


def comparison_page(found: Comparison, measured: list[str], simulated: str) -> Page:
    """Return the page.

    Args:
        found: Result of the comparison.
        measured: Names of the measured runs.
        simulated: Name of the simulated run.

    Raises:
        ParameterError: matplotlib is not installed.
    """
    lead = [
        f"Measured: {', '.join(measured)}. Simulated: {simulated}. {STANDARDS[found.standard]}.",
        f"Measured {', '.join(map(_shift, found.shifts_s))} than simulated; the runs are shown without this shift.",
    ]
    columns = ["quantity", "rms of the residual", "tolerance", "share inside", ""]
    outside = frozenset(number for number, each in enumerate(found.quantities) if not each.inside)
    table = Table("", columns, [words(each) for each in found.quantities], outside)
    pictures = [as_svg(draw(picture(each, found.standard, len(measured)))) for each in found.quantities]
    heading = "Measured and simulated: " + (passed("inside") if found.inside else failed("outside"))
    sections = [Section(tables=[table]), Section(pictures=pictures), Section("Assumptions", points=assumptions(found))]
    return Page(f"activesteer compare: {simulated}", heading, lead, sections)


def _shift(shift_s: float) -> str:
    """Return in words how much later a measured run is."""
    if math.isnan(shift_s):
        return "by an unknown time later"
    return f"{1e3 * abs(shift_s):.1f} ms {'earlier' if shift_s < 0.0 else 'later'}"


def picture(found: Compared, standard: str, runs: int, more: Sequence[Area] = ()) -> Picture:
    """Return the overlay with its corridor and more areas, and the residual in the same corridor."""
    across = standard == "iso19364"
    x_label = "lateral acceleration [m/s²]" if across else "time of the simulation [s]"
    shown = quantity_of(found.channel)
    overlay, residual = (_across if across else _over_time)(
        found, shown.factor, "measured" if runs == 1 else f"measured, mean of {runs}"
    )
    panels = overlay._replace(areas=[*more, *overlay.areas]), residual
    titles = (shown.title, f"Measured less simulated [{shown.unit.name}]")
    return Picture(
        "", [panel._replace(x_label=x_label, title=title) for panel, title in zip(panels, titles, strict=True)],
        columns=2, height_in=2.6,
    )  # fmt: skip


def _over_time(found: Compared, factor: float, measured: str) -> tuple[Panel, Panel]:
    areas = [Area(found.x, factor * found.low, factor * found.high, "corridor")]
    if found.confidence.any():
        low, high = found.measured - found.confidence, found.measured + found.confidence
        areas.append(Area(found.x, factor * low, factor * high, "its 95 % interval", RUN_COLOURS[1], 0.3))
    curves = [
        Curve(found.x, factor * found.simulated, "simulated", RUN_COLOURS[2]),
        Curve(found.x, factor * found.measured, measured, RUN_COLOURS[1], "--"),
    ]
    around = Area(found.x, factor * (found.low - found.simulated), factor * (found.high - found.simulated))
    residual = Curve(found.x, factor * found.residual, colour=RUN_COLOURS[0])
    return Panel("", "", curves, areas=areas), Panel("", "", [residual, *_outside(found, factor)], areas=[around])


def _across(found: Compared, factor: float, measured: str) -> tuple[Panel, Panel]:
    def dots(values: Array, label: str = "", colour: str = _EDGE, size: float = 1.5) -> Curve:
        return Curve(found.x, factor * values, label, colour, "", marker=".", size=size)

    overlay = [
        dots(found.low, "corridor of the simulation"),
        dots(found.high),
        dots(found.simulated, "simulated, nearest point", RUN_COLOURS[2], 2.0),
        dots(found.measured, measured, RUN_COLOURS[1], 2.0),
    ]
    residual = [
        dots(found.low - found.simulated),
        dots(found.high - found.simulated),
        dots(found.residual, colour=RUN_COLOURS[0], size=2.0),
        *_outside(found, factor),
    ]
    return Panel("", "", overlay), Panel("", "", residual)


def _outside(found: Compared, factor: float) -> list[Curve]:
    outside = ~found.within
    if not outside.any():
        return []
    residual = factor * found.residual[outside]
    return [Curve(found.x[outside], residual, "outside", "#b3261e", "", marker=".")]

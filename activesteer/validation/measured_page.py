"""A validation against measured runs as printed lines, and as one HTML page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from activesteer.display_units import quantity_of
from activesteer.errors import ParameterError
from activesteer.files import make_folder, write_text
from activesteer.measured.comparison import words
from activesteer.measured.comparison_page import picture
from activesteer.measured.fit_page import correlation_table, parameter_table
from activesteer.measured.fit_result import Fit, rests_on
from activesteer.pages import Page, Section, Table, failed, passed, render_page
from activesteer.plotting import Area, Picture, as_svg, draw
from activesteer.validation.measured_folder import Band, MeasuredValidation, Part

_HEAD: Final = ["run", "window", "quantity", "rms of the residual", "tolerance", "share inside", ""]
_BAND_COLOUR: Final = "#b3a369"


def measured_text(result: MeasuredValidation) -> str:
    """Return the text that the command prints."""
    lines = [result.file.table.title or result.file.table.vehicle]
    for stage, found in _stages(result):
        lines.append(f"{stage}: {_free(found)}")
        for one in result.parts:
            if one.stage == stage:
                run, part, label, residual, tolerance, share, verdict = _row(one)
                lines.append(f"  {run} {part:5} {label:22} rms {residual:>12}  {tolerance:>34}  {share:>7} {verdict}")
        if found is not None:
            lines += [f"  {one.key:40} {one.words}" for one in found.parameters]
            lines += [f"  correlation {value:+.2f}  {one}, {other}" for one, other, value in found.pairs(0.5)]
            lines += [f"  ! {note}" for note in found.notes]
    for band in result.bands:
        lines.append("band of the intervals: " + ", ".join(_band_row(band)[1:]))
    lines += [f"  {head:42} {effect}" for head, effect in _end_rows(result)]
    lines.append("inside" if result.inside else "outside")
    return "\n".join(lines)


def write_measured_page(result: MeasuredValidation, path: Path) -> Path:
    """Write the page and return its path; an existing file is replaced.

    Args:
        result: The result.
        path: The HTML file.

    Raises:
        ParameterError: matplotlib is not installed, or the file cannot be written.
    """
    make_folder(path.parent, ParameterError)
    return write_text(path, render_page(_page(result)), ParameterError)


def _page(result: MeasuredValidation) -> Page:
    table = result.file.table
    kept = sum(one.compared.inside for one in result.judged)
    verdict = (passed if result.inside else failed)(f"{kept} of {len(result.judged)}")
    stage = "prediction" if result.fitted is None else "fitted car"
    lead = [verdict + f" quantities of the {stage} keep their tolerance in the check windows, which no fit has seen."]
    sections = []
    for name, found in _stages(result):
        shown = [one for one in result.parts if one.stage == name]
        outside = frozenset(number for number, one in enumerate(shown) if not one.compared.inside)
        tables = [Table("", _HEAD, [_row(one) for one in shown], outside)]
        if found is not None:
            tables.append(parameter_table(found))
            if len(found.parameters) > 1:
                tables.append(correlation_table(found))
        pictures = [as_svg(draw(_picture(result, one))) for one in shown if one.part == "check"]
        points = [] if found is None else [*found.notes, *rests_on(found)]
        sections.append(Section(name.capitalize(), [_free(found)], pictures, tables, points))
    if result.bands:
        text = (
            "The band contains the prediction with each value at either end of its interval. Before that, the free "
            "factors of the prediction are found again. Effects of several intervals add up."
        )
        bands = Table(
            "", ["run", "quantity", "mean width", "measured inside"], [_band_row(one) for one in result.bands]
        )
        ends = Table("", ["interval", "rms change of the prediction"], _end_rows(result))
        sections.append(Section("Band of the intervals", [text], tables=[bands, ends]))
    sections.append(Section("Assumptions", points=result.assumptions))
    if result.notes:
        sections.append(Section("Notes of the import", points=result.notes))
    title = table.title or table.vehicle
    return Page(f"activesteer validate: {table.vehicle}", title, lead, sections)


def _stages(result: MeasuredValidation) -> Iterator[tuple[str, Fit | None]]:
    yield "predicted", result.predicted
    if result.fitted is not None:
        yield "fitted", result.fitted


def _free(found: Fit | None) -> str:
    if found is None:
        return "no value comes from the data"
    return f"free in the fit windows: {', '.join(one.key for one in found.parameters)}"


def _row(one: Part) -> tuple[str, ...]:
    return one.run, one.part, *words(one.compared)


def _band_row(band: Band) -> tuple[str, str, str, str]:
    shown = quantity_of(band.part.compared.channel)
    width = f"{shown.factor * band.width:.3g} {shown.unit.name} wide"
    return band.part.run, shown.label, width, f"{100.0 * band.share_inside:.1f} % of the measured samples inside"


def _end_rows(result: MeasuredValidation) -> list[tuple[str, str]]:
    rows = []
    for end in result.ends:
        effects = []
        for channel, value in end.effect.items():
            shown = quantity_of(channel)
            effects.append(f"{shown.label} {shown.factor * value:.2g} {shown.unit.name}")
        rows.append((f"{end.key} {end.ends[0]:g} to {end.ends[1]:g}", f"{', '.join(effects)} ({end.source})"))
    return rows


def _picture(result: MeasuredValidation, one: Part) -> Picture:
    band = next((band for band in result.bands if band.part is one), None)
    if band is None:
        return picture(one.compared, "iso19365", 1)
    factor = quantity_of(one.compared.channel).factor
    area = Area(one.compared.x, factor * band.low, factor * band.high, "band of the intervals", _BAND_COLOUR, 0.25)
    return picture(one.compared, "iso19365", 1, [area])

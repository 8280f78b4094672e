"""Comparisons with measured runs, and fits, as printable pages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Final

import numpy as np
from markupsafe import Markup

from activesteer.analysis.series import rms
from activesteer.config import toml_value
from activesteer.core.conventions import RUN_COLOURS, Array
from activesteer.core.files import json_text, make_folder, write_text
from activesteer.core.units import parameter_title, quantity_of, typeset
from activesteer.errors import StudyError
from activesteer.measured.circle import CircleValidation
from activesteer.measured.comparison import STANDARDS, Compared, Comparison, Tolerance, assumptions
from activesteer.measured.fit_result import Compared as FitCompared
from activesteer.measured.fit_result import Fit, rests_on
from activesteer.measured.folder import MeasuredValidation, Part
from activesteer.measured.folder_file import STEERING
from activesteer.pages import Page, Section, Table, Text, failed, passed, render_page
from activesteer.plotting import Area, Curve, Panel, Picture

_EDGE: Final = "#9bbbd4"
_START: Final = "#888888"
_WIDE: Final = 3.2
"""Width of a simulated curve, at which a measured curve that coincides with it remains visible [pt]."""
_SEEN: Final = 1e-3
"""Noise relative to the tolerance below which a table leaves the noise out."""
_SAME_TIME_S: Final = 0.05e-3
"""Shift below which a table shows 0.0 ms [s]."""


def comparison_page(found: Comparison, measured: list[str], simulated: str) -> Page:
    """Return the page of a comparison."""
    shifts = f"Measured {', '.join(map(_shift, found.shifts_s))} than simulated; this shift is removed."
    if all(abs(shift_s) < _SAME_TIME_S for shift_s in found.shifts_s):
        shifts = "There is no time shift between measurement and simulation."
    lead = [f"Measured: {', '.join(measured)}. Simulated: {simulated}. {STANDARDS[found.standard]}.", shifts]
    columns = ["quantity", "rms of the residual", "tolerance", "share inside", ""]
    outside = frozenset(number for number, each in enumerate(found.quantities) if not each.inside)
    table = Table("", columns, [_cells(each) for each in found.quantities], outside)
    pictures = [picture(each, found.standard, len(measured)) for each in found.quantities]
    heading = "Measured and simulated: " + (passed("inside") if found.inside else failed("outside"))
    sections = [Section(tables=[table]), Section(pictures=pictures), Section("Assumptions", points=assumptions(found))]
    return Page(f"activesteer compare: {simulated}", heading, lead, sections)


def _cells(found: Compared) -> tuple[Text, ...]:
    """Return the cells of a channel: name, rms of the residual, tolerance, share inside, verdict."""
    shown = quantity_of(found.channel)
    unit, factor = shown.unit.name, shown.factor
    allowed = f"{found.tolerance.offset * factor:.3g} {unit} + {100.0 * found.tolerance.gain:g} %"
    allowed += f" + noise {found.noise * factor:.2g}" if found.noise > _SEEN * found.tolerance.offset else ""
    return (
        shown.label,
        f"{rms(found.residual) * factor:.3g} {unit}",
        allowed,
        f"{100.0 * found.share_inside:.1f} %",
        passed("inside", chip=True) if found.inside else failed("outside", chip=True),
    )


def _shift(shift_s: float) -> str:
    """Describe the delay of a measured run."""
    if math.isnan(shift_s):
        return "by an unknown time later"
    return f"{1e3 * abs(shift_s):.1f} ms {'earlier' if shift_s < 0.0 else 'later'}"


def picture(
    found: Compared, standard: str = "iso19365", runs: int = 1, areas: Sequence[Area] = (), start: Array | None = None
) -> Picture:
    """Return the plots of a channel: overlay with its corridor and the start of a fit, and residual."""
    across = standard == "iso19364"
    x_label = "lateral acceleration [m/s²]" if across else "time of the simulation [s]"
    shown = quantity_of(found.channel)

    def line(values: Array, label: str = "", colour: str = RUN_COLOURS[0], dashes: str = "-") -> Curve:
        curve = Curve(found.x, shown.factor * values, label, colour, dashes)
        # The points of a cross plot are in no order.
        return curve._replace(dashes="", marker=".", size=2.0) if across else curve

    def panel(title: str, middle: Array | float, curves: list[Curve], more: Sequence[Area], label: str = "") -> Panel:
        low, high = found.low - middle, found.high - middle
        if across:
            curves = [line(low, label, _EDGE), line(high, "", _EDGE), *curves]
        else:
            more = [*more, Area(found.x, shown.factor * low, shown.factor * high, label)]
        return Panel(x_label, "", curves, title, more)

    simulated = line(found.simulated, "simulated, nearest point" if across else "simulated", RUN_COLOURS[2])
    overlay = [
        simulated._replace(width=_WIDE),
        line(found.measured, "measured" if runs == 1 else f"measured, mean of {runs}", RUN_COLOURS[1]),
    ]
    residual = [line(found.residual, "" if start is None else "difference after the fit")]
    if start is not None:
        overlay.append(line(start, "at the start", _START, ":"))
        residual.append(line(found.measured - start, "", _START, ":"))
    if (outside := ~found.within).any():
        points = shown.factor * found.residual[outside]
        residual.append(Curve(found.x[outside], points, "outside", "#b3261e", "", marker="."))
    if found.confidence.any() and not across:
        low, high = found.measured - found.confidence, found.measured + found.confidence
        interval = Area(found.x, shown.factor * low, shown.factor * high, "its 95 % interval", RUN_COLOURS[1], 0.3)
        areas = [*areas, interval]
    corridor = "corridor of the simulation" if across else "corridor"
    panels = [
        panel(shown.title, 0.0, overlay, areas, corridor),
        panel(f"Measured minus simulated [{shown.unit.name}]", found.simulated, residual, ()),
    ]
    return Picture("", panels, columns=2, height_in=2.6)


_HEAD: Final = ["quantity", "run", "window", "rms of the residual", "tolerance", "share inside", ""]
_BAND_COLOUR: Final = "#b3a369"


def measured_page(result: MeasuredValidation | CircleValidation) -> Page:
    """Return the page of a result."""
    table = result.file.table
    is_circle = isinstance(result, CircleValidation)
    lead, sections = _circle(result) if is_circle else _runs(result)
    sections.append(Section("Assumptions", points=table.assumptions if is_circle else result.assumptions))
    return Page(f"activesteer: {table.vehicle} and its measurement", table.title or table.vehicle, lead, sections)


def _runs(result: MeasuredValidation) -> tuple[list[Text], list[Section]]:
    kept = sum(one.compared.inside for one in result.judged)
    verdict = (passed if result.inside else failed)(f"{kept} of {len(result.judged)}")
    stage = "prediction" if result.fitted is None else "fitted car"
    lead: list[Text] = [
        verdict + f" quantities of the {stage} are within their tolerance in the check windows, which no fit has used."
    ]
    sections: list[Section] = []
    stages = {"predicted": result.predicted} | ({} if result.fitted is None else {"fitted": result.fitted})
    for name, found in stages.items():
        shown = [one for one in result.parts if one.stage == name]
        outside = frozenset(number for number, one in enumerate(shown) if not one.compared.inside)
        rows = [
            (quantity, one.run, one.part, *others) for one in shown for quantity, *others in (_cells(one.compared),)
        ]
        tables = [Table("", _HEAD, rows, outside)]
        if found is not None:
            tables.append(_parameter_table(found))
            if len(found.parameters) > 1:
                tables.append(_correlation_table(found))
        text = "No value comes from the data."
        if found is not None:
            text = f"Free in the fit windows: {', '.join(one.key for one in found.parameters)}."
        sections.append(Section(name.capitalize(), [text], tables))
        if found is not None and found.notes:
            sections.append(Section("Notes", [*map(_sentence, found.notes)], level=3))
        checked = groupby((one for one in shown if one.part == "check"), lambda one: one.run)
        sections += [
            Section(f"{run}: check window", pictures=[*map(_picture, parts)], level=3) for run, parts in checked
        ]
        if found is not None:
            sections.append(Section("Assumptions of the fit", points=rests_on(found), level=3))
    if result.ends:
        text = (
            "The band contains the predictions with each value at either end of its interval. For each of them, the "
            "free factors are fitted again. Effects of several intervals add up."
        )
        widths, ends = [], []
        for box in (one.box() for one in result.parts if one.band):
            shown = quantity_of(box["channel"])
            width = f"{shown.factor * box['width']:.3g} {shown.unit.name} wide"
            inside = f"{100.0 * box['share_inside']:.1f} % of the measured samples inside"
            widths.append((box["run"], shown.label, width, inside))
        for end in result.ends:
            quantities = [(quantity_of(channel), value) for channel, value in end.effect.items()]
            effects = [f"{one.label} {one.factor * value:.2g} {one.unit.name}" for one, value in quantities]
            ends.append((f"{end.key} {end.ends[0]:g} to {end.ends[1]:g}", f"{', '.join(effects)} ({end.source})"))
        tables = [
            Table("", ["run", "quantity", "mean width", "measured inside"], widths),
            Table("", ["interval", "rms change of the prediction"], ends),
        ]
        sections.append(Section("Band of the intervals", [text], tables=tables))
    if result.notes:
        sections.append(Section("Notes of the import", points=result.notes))
    return lead, sections


def _picture(one: Part) -> Picture:
    areas = []
    if one.band is not None:
        low, high = (quantity_of(one.compared.channel).factor * edge for edge in one.band)
        areas = [Area(one.compared.x, low, high, "band of the intervals", _BAND_COLOUR, 0.25)]
    return picture(one.compared, areas=areas)


def _circle(result: CircleValidation) -> tuple[list[Text], list[Section]]:
    found, ours, measured = result.numbers, result.numbers["ours_deg"], result.numbers["measured_deg"]
    lead: list[Text] = [
        Markup("The mean difference of <b>{} deg</b> is {} the tolerance of {} deg ({}).").format(
            typeset(f"{found['difference_deg']:+.1f}"), passed("inside") if result.inside else failed("outside"),
            f"{found['tolerance_deg']:.1f}", result.file.tolerances[STEERING].source,
        ),
        f"Area metric {found['area_metric_deg']:.1f} deg, overlap of the distributions {100 * found['overlap']:.0f} %.",
    ]  # fmt: skip
    spread = [f"{one['mean']:.1f} +- {one['std']:.1f}" for one in (measured, ours)]
    rows = [
        ("measured", spread[0], f"{measured['n']} values"),
        ("predicted", spread[1], f"{ours['n']} samples, nominal {ours['nominal']:.1f}"),
    ]
    if two := found["with_assumptions_deg"] != ours["nominal"]:
        second = f"{found['with_assumptions_deg']:.1f}"
        rows.append(("second prediction, without [circle.prediction]", second, "nominal"))
    table = Table("", ["steering wheel", "deg", ""], rows)
    sections = [Section(tables=[table], pictures=[_distributions(result)])]
    if box := found["box"]:
        text = (
            f"From {box['low_deg']:.1f} to {box['high_deg']:.1f} deg, {box['width_deg']:.1f} deg wide: "
            f"{box['measured_inside']} of {measured['n']} measured angles are inside. Values with one unknown true "
            "value are intervals; the others vary from lap to lap. The table gives the "
            f"{'second ' * two}prediction with both ends of each interval, one interval at a time."
        )
        ends = [
            (each["name"], f"{each['low_deg']:.1f}", f"{each['high_deg']:.1f}", each["source"])
            for each in box["intervals"]
        ]
        head = ["interval", "low end, deg", "high end, deg", "source"]
        sections.append(Section("Probability box", [text], tables=[Table("", head, ends)]))
    return lead, sections


def _distributions(result: CircleValidation) -> Picture:
    measured, tolerance = (result.numbers[key] for key in ("measured_deg", "tolerance_deg"))
    around = [measured["mean"] - tolerance, measured["mean"] + tolerance]
    box = RUN_COLOURS[1]
    looks = [("measured", "#777777"), ("predicted", RUN_COLOURS[2]), ("probability box", box), ("", box)]
    curves = []
    for values, (label, colour) in zip(result.distributions, looks, strict=True):
        if not len(values):  # without intervals
            continue
        fraction = np.repeat(np.arange(len(values) + 1) / len(values), 2)[1:-1]
        curves.append(Curve(np.repeat(np.sort(values), 2), fraction, label, colour))
    area = Area(around, 0.0, 1.0, "tolerance", "#777777", 0.15)
    panel = Panel("steering wheel angle [deg]", "cumulative fraction", curves, areas=[area])
    return Picture("", [panel], width_in=7.0, height_in=3.2)


def write_fit(found: Fit, name: str, folder: Path) -> list[Path]:
    """Write `fit.json`, `overrides.toml` and `fit.html` over existing files, and return their paths."""
    make_folder(folder, StudyError)
    texts = {
        "fit.json": json_text(found.to_json()) + "\n",
        "overrides.toml": overrides_text(found, name),
        "fit.html": render_page(fit_page(found, name)),
    }
    return [write_text(folder / file, text, StudyError) for file, text in texts.items()]


def overrides_text(found: Fit, name: str) -> str:
    """Return the content of the file for `--overrides`. Values that hold in only one recording are comments."""
    words = {one.key: one.words if one.value == found.overrides.get(one.key) else f"{one.words}, relative to the files"
             for one in found.parameters}  # fmt: skip
    lines = [f"# Found by `activesteer fit {name}.toml`; for --overrides, or the table [overrides] of a study."]
    lines += [f'"{key}" = {toml_value(value)}  # {words[key]}' for key, value in found.overrides.items()]
    for recording, own in found.own.items():
        lines += [f"# only in {recording}: {key} = {toml_value(value)}" for key, value in own.items()]
    return "\n".join(lines) + "\n"


def fit_page(found: Fit, name: str) -> Page:
    """Return the page of a fit."""
    lead: list[Text] = [
        f"{found.runs} runs in {found.rounds} rounds; the remaining difference is {found.misfit:.3g} times the noise "
        "as stated."
    ]
    lead += [Markup('<span class="failed">{}</span>').format(_sentence(note)) for note in found.notes]
    correlation = _correlation_table(found)._replace(title="Correlation of their errors")
    tables = [_parameter_table(found), *([correlation] if len(found.parameters) > 1 else [])]
    columns = [
        "recording", "channel", "stated noise", "rms at the start", "rms at the end", "samples", "independent samples",
    ]  # fmt: skip
    rows = []
    for each in found.compared:
        shown = quantity_of(each.channel)
        sizes = (each.noise, each.noise * rms(each.before), each.noise * rms(each.after))
        numbers = (f"{shown.factor * size:.3g} {shown.unit.name}" for size in sizes)
        samples = (f"{len(each.measured)}", f"{each.independent:.0f}")
        rows.append((each.recording, shown.label, *numbers, *samples))
    sections = [Section(tables=[*tables, Table("Remaining differences", columns, rows)])]
    for recording, compared in groupby(found.compared, lambda each: each.recording):
        sections.append(Section(f"Recording {recording}", pictures=[*map(_fit_picture, compared)]))
    sections.append(Section("Assumptions", points=rests_on(found)))
    return Page(f"activesteer fit: {name}", f"Parameters from recordings: {name}", lead, sections)


def _sentence(note: str) -> str:
    """Format a note with a capital letter and a full stop, unless it starts with a key."""
    return f"{note if '.' in note.partition(' ')[0] else note[0].upper() + note[1:]}."


def _parameter_table(found: Fit) -> Table:
    """Return the table of the parameters, with intervals."""
    rows = [
        (
            Markup('{}<br><code class="key">{}</code>').format(parameter_title(one.key), one.key),
            one.words.replace("+-", "\N{PLUS-MINUS SIGN}"), f"{one.start:.5g}", f"{one.low:.5g} to {one.high:.5g}",
        )
        for one in found.parameters
    ]  # fmt: skip
    outside = frozenset(number for number, one in enumerate(found.parameters) if one.at_end)
    return Table("", ["parameter", "value and 95 % interval", "at the start", "range"], rows, outside)


def _correlation_table(found: Fit) -> Table:
    """Return the table of the correlations of the parameters' errors."""
    rows = [
        (f"{number} {parameter_title(one.key)}", *("-" if math.isnan(value) else f"{value:+.3f}" for value in values))
        for number, (one, values) in enumerate(zip(found.parameters, found.correlations, strict=True), start=1)
    ]
    return Table("", ["", *(str(number) for number in range(1, len(rows) + 1))], rows)


def _fit_picture(found: FitCompared) -> Picture:
    """Return the plots of a fitted channel: overlay, and difference with twice its noise as the corridor."""
    start, end = (found.measured + found.noise * each for each in (found.before, found.after))
    twice = Tolerance(2.0 * found.noise, 0.0, "")
    low, high = end - twice.offset, end + twice.offset
    zero, all_of_them = np.zeros(len(end)), np.ones(len(end), np.bool_)
    compared = Compared(found.channel, twice, found.time_s, found.measured, zero, end, low, high, all_of_them)
    return picture(compared, start=start)

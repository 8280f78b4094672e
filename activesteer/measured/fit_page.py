"""A fit as files: JSON, overrides to drive with, and a page with measured beside simulated curves."""

from __future__ import annotations

import math
from itertools import groupby
from pathlib import Path

from markupsafe import Markup

from activesteer.config import toml_value
from activesteer.conventions import RUN_COLOURS
from activesteer.errors import StudyError
from activesteer.files import json_text, make_folder, write_text
from activesteer.measured.fit_result import Compared, Fit, rests_on
from activesteer.pages import Page, Section, Table, render_page
from activesteer.plotting import Area, Curve, Panel, Picture, as_svg, draw
from activesteer.units import parameter_title, quantity_of


def write_fit(found: Fit, name: str, folder: Path) -> list[Path]:
    """Write `fit.json`, `overrides.toml` and `fit.html`, and return their paths; existing files are replaced."""
    make_folder(folder, StudyError)
    texts = {
        "fit.json": json_text(found.to_json()) + "\n",
        "overrides.toml": overrides_text(found, name),
        "fit.html": render_page(_page(found, name)),
    }
    return [write_text(folder / file, text, StudyError) for file, text in texts.items()]


def overrides_text(found: Fit, name: str) -> str:
    """The file for `--overrides`: what holds in all recordings, and as comments what belongs to one of them."""
    words = {one.key: one.words if one.value == found.overrides.get(one.key) else f"{one.words}, relative to the files"
             for one in found.parameters}  # fmt: skip
    lines = [f"# Found by `activesteer fit {name}.toml`; for --overrides, or the table [overrides] of a study."]
    lines += [f'"{key}" = {toml_value(value)}  # {words[key]}' for key, value in found.overrides.items()]
    for recording, own in found.own.items():
        lines += [f"# in {recording} alone: {key} = {toml_value(value)}" for key, value in own.items()]
    return "\n".join(lines) + "\n"


def _page(found: Fit, name: str) -> Page:
    lead: list[str | Markup] = [
        f"{found.runs} runs in {found.rounds} rounds; the remaining difference is {found.misfit:.3g} times the noise "
        "as stated."
    ]
    lead += [Markup('<span class="failed">{}.</span>').format(note[0].upper() + note[1:]) for note in found.notes]
    sections = [Section(tables=[parameter_table(found)])]
    if len(found.parameters) > 1:
        sections.append(Section("Correlation of their errors", tables=[correlation_table(found)]))
    columns = [
        "recording", "channel", "stated noise", "rms at the start", "rms at the end", "samples", "independent samples",
    ]  # fmt: skip
    sections.append(
        Section("Remaining differences", tables=[Table("", columns, [each.words() for each in found.compared])])
    )
    for recording, compared in groupby(found.compared, lambda each: each.recording):
        sections.append(Section(recording, pictures=[as_svg(draw(picture(list(compared))))]))
    sections.append(Section("Assumptions", points=rests_on(found)))
    return Page(f"activesteer fit: {name}", f"Parameters from recordings: {name}", lead, sections)


def parameter_table(found: Fit) -> Table:
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


def correlation_table(found: Fit) -> Table:
    """Return the table of the correlations of the parameters' errors."""
    rows = [
        (f"{number} {parameter_title(one.key)}", *("-" if math.isnan(value) else f"{value:+.3f}" for value in values))
        for number, (one, values) in enumerate(zip(found.parameters, found.correlations, strict=True), start=1)
    ]
    return Table("", ["", *(str(number) for number in range(1, len(rows) + 1))], rows)


def picture(compared: list[Compared]) -> Picture:
    """Return the channels of one recording: measured and simulated values, and beside them their difference."""
    panels = []
    for each in compared:
        shown = quantity_of(each.channel)
        noise = shown.factor * each.noise
        measured = shown.factor * each.measured
        over = "time of the recording [s]"
        curves = [
            Curve(each.time_s, measured, "measured", RUN_COLOURS[1], "", marker=".", size=2.0),
            Curve(each.time_s, measured + noise * each.before, "at the start", "#888888", "--", 1.0),
            Curve(each.time_s, measured + noise * each.after, "fitted", RUN_COLOURS[2]),
        ]
        rest = [
            Curve(each.time_s, noise * each.before, "", "#888888", "--", 0.8),
            Curve(each.time_s, noise * each.after, "", RUN_COLOURS[2], width=0.8),
        ]
        band = Area(each.time_s[[0, -1]], -2.0 * noise, 2.0 * noise, "2 standard deviations of the noise")
        panels.append(Panel(over, "", curves, shown.title))
        panels.append(Panel(over, "", rest, f"Simulated less measured [{shown.unit.name}]", [band]))
    return Picture("", panels, columns=2, width_in=11.0, height_in=2.5 * len(compared))

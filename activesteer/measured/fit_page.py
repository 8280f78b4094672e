"""A fit as files: JSON, overrides to drive with, and a page with measured beside simulated curves."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from activesteer.config import toml_value
from activesteer.conventions import RUN_COLOURS
from activesteer.errors import StudyError
from activesteer.files import json_text, make_folder, write_text
from activesteer.measured.fit_result import Compared, Fit, rests_on
from activesteer.pages import render
from activesteer.plotting import as_svg, new_figure, page_axis
from activesteer.quantities import quantity_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_fit(found: Fit, name: str, folder: Path) -> list[Path]:
    """Writes `fit.json`, `overrides.toml` and `fit.html`; files that exist are replaced.

    Args:
        found: What came out.
        name: Of the study.
        folder: Where to; made where it does not exist.

    Returns:
        The files.

    Raises:
        StudyError: one cannot be written.
        ParameterError: matplotlib is not installed.
    """
    make_folder(folder, StudyError)
    pictures = {
        recording: as_svg(draw(list(compared)))
        for recording, compared in groupby(found.compared, lambda each: each.recording)
    }
    page = render("fit.html", found=found, name=name, pictures=pictures, assumptions=rests_on(found))
    texts = {
        "fit.json": json_text(found.to_json()) + "\n",
        "overrides.toml": overrides_text(found, name),
        "fit.html": page,
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


def draw(compared: list[Compared]) -> Figure:
    """Channels of one recording: measured and simulated, and beside them what is left.

    Raises:
        ParameterError: matplotlib is not installed.
    """
    figure = new_figure(11.0, 2.5 * len(compared))
    for (left, right), each in zip(figure.subplots(len(compared), 2, squeeze=False), compared, strict=True):
        shown = quantity_of(each.channel)
        noise = shown.factor * each.noise
        measured = shown.factor * each.measured
        left.plot(each.time_s, measured, ".", color=RUN_COLOURS[1], ms=2.0, label="measured")
        left.plot(each.time_s, measured + noise * each.before, "--", color="#888888", lw=1.0, label="at the start")
        left.plot(each.time_s, measured + noise * each.after, color=RUN_COLOURS[2], lw=1.2, label="fitted")
        right.axhspan(-2.0 * noise, 2.0 * noise, color="#cfe0ee", lw=0.0, label="2 standard deviations of the noise")
        right.plot(each.time_s, noise * each.before, "--", color="#888888", lw=0.8)
        right.plot(each.time_s, noise * each.after, color=RUN_COLOURS[2], lw=0.8)
        for axis, title in ((left, shown.title), (right, f"Simulated less measured [{shown.unit.name}]")):
            page_axis(axis, title, "time of the recording [s]")
    return figure

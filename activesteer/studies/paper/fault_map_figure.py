"""The fault map as pictures: a panel for each situation, with a row for each fault and a column for each speed."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.errors import StudyError
from activesteer.files import make_folder, write_text
from activesteer.pages import Page, Section, render_page
from activesteer.plotting import Heat, Picture, as_svg, draw, save
from activesteer.studies.paper.fault_map import FaultMap


class _Shown(NamedTuple):
    """A value of a row: its title with the unit, the function that finds it (None without a result), and its colour.

    The colour is a function of the value and the limits, from 0 (good) to 1 (bad). The legend says what `_COLOURS` and
    a blank field mean.
    """

    title: str
    value: Callable[[Mapping[str, Any]], float | None]
    fraction: Callable[[float, FaultMap], float]
    legend: tuple[str, ...]


_COLOURS: Final = ("#63bd6b", "#fff3b0", "#e2604f")
_LEAST: Final = 0.005
"""Least value that is written with its digits, in the unit of the picture."""
_EFFECT: Final = ("no effect", "at the limit", "twice the limit or more")


_PICTURES: Final = {
    "fault_tolerant_time": _Shown(
        "fault-tolerant time [s]",
        lambda row: math.inf if row["fault_tolerant_time_s"] is None else row["fault_tolerant_time_s"],
        lambda value, made: math.nan if math.isinf(value) else 1.0 - min(value / made.limits.window_s, 1.0) ** 0.5,
        ("the whole window", "a quarter of the window", "no time", "blank: the car stays within the limits"),
    ),
    "yaw_rate_change": _Shown(
        "greatest change of the yaw rate, hands fixed [deg/s]",
        lambda row: math.degrees(row["yaw_rate_change_radps"]),
        lambda value, made: min(0.5 * value / math.degrees(made.limits.yaw_rate_radps), 1.0),
        _EFFECT,
    ),
    "lateral_offset": _Shown(
        "lateral offset after 1 s, hands fixed [m]",
        lambda row: abs(row["lateral_offset_1s_m"]),
        lambda value, made: min(0.5 * value / (made.limits.lateral_offset_m or 0.85), 1.0),
        _EFFECT,
    ),
}
"""File name -> value; a value at its limit has the colour half-way to red."""


def draw_fault_map(made: FaultMap, folder: str | os.PathLike[str]) -> list[Path]:
    """Draw the heat maps into a folder, also on a page, and return the files."""
    directory = make_folder(folder, StudyError)
    figures = {name: draw(_picture(made, shown)) for name, shown in _PICTURES.items()}
    sections = [
        Section(shown.title[0].upper() + shown.title[1:], pictures=[as_svg(figure)])
        for shown, figure in zip(_PICTURES.values(), figures.values(), strict=True)
    ]
    page = Page("activesteer fault-map", "Effect of faults", [_lead(made)], sections)
    return [
        *(save(figure, directory / f"{name}.png", StudyError) for name, figure in figures.items()),
        write_text(directory / "fault_map.html", render_page(page), StudyError),
    ]


def _lead(made: FaultMap) -> str:
    limits = made.limits
    lane = "up to the edge of the lane"
    offset = lane if limits.lateral_offset_m is None else f"of {limits.lateral_offset_m:g} m"
    return (
        f"The limits are {math.degrees(limits.yaw_rate_radps):g} deg/s of yaw rate, {limits.ay_mps2:g} m/s² of "
        f"lateral acceleration and a lateral offset {offset}; faults last at most {limits.window_s:g} s. "
        'A blank field has no value, and the legend says what that means; "failed" is a run without a result.'
    )


def _picture(made: FaultMap, shown: _Shown) -> Picture:
    faults, situations, speeds = (
        list(dict.fromkeys(row[key] for row in made.rows)) for key in ("fault", "situation", "speed_kmh")
    )
    cells = {(row["fault"], row["situation"], row["speed_kmh"]): row for row in made.rows}
    panels = []
    for situation in situations:
        fractions = np.full((len(faults), len(speeds)), math.nan)
        texts = [["failed"] * len(speeds) for _ in faults]
        for row, column in np.ndindex(fractions.shape):
            value = shown.value(cells[faults[row], situation, speeds[column]])
            if value is not None and not math.isnan(value):
                fractions[row, column] = shown.fraction(value, made)
                texts[row][column] = "" if math.isinf(value) else f"{value:.2g}" if value >= _LEAST else "0"
        names = faults if situation == situations[0] else [""] * len(faults)
        columns = [f"{speed:g}" for speed in speeds]
        title = situation.replace("_", " ")
        panels.append(Heat(fractions, texts, columns, names, (0.0, 1.0), _COLOURS, title, "speed [km/h]"))
    width_in = 2.6 + len(situations) * (0.7 + 0.55 * len(speeds))
    title = f"Faults: {shown.title}"
    legend = list(zip(shown.legend, (*_COLOURS, "#ffffff"), strict=False))
    return Picture(
        title, panels, columns=len(panels), width_in=width_in, height_in=1.6 + 0.26 * len(faults),
        legend=legend, shared_legend=True,
    )  # fmt: skip

"""The fault map as pictures: a panel for each situation, with a row for each fault and a column for each speed."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.errors import StudyError
from activesteer.files import make_folder
from activesteer.plotting import Heat, Picture, draw, save
from activesteer.studies.paper.fault_map import FaultMap


class _Shown(NamedTuple):
    """A value of a row: its title with the unit, the function that finds it (None without a result), and its colour.

    The colour is a function of the value and the limits, from 0 (good) to 1 (bad).
    """

    title: str
    value: Callable[[Mapping[str, Any]], float | None]
    fraction: Callable[[float, FaultMap], float]


_PICTURES: Final = {
    "fault_tolerant_time": _Shown(
        "fault-tolerant time [s]; blank: the car stays within the limits",
        lambda row: math.inf if row["fault_tolerant_time_s"] is None else row["fault_tolerant_time_s"],
        lambda value, made: 1.0 - min(value / made.limits.window_s, 1.0) ** 0.5,
    ),
    "yaw_rate_change": _Shown(
        "greatest change of the yaw rate, hands fixed [deg/s]",
        lambda row: math.degrees(row["yaw_rate_change_radps"]),
        lambda value, made: min(0.5 * value / math.degrees(made.limits.yaw_rate_radps), 1.0),
    ),
    "lateral_offset": _Shown(
        "lateral offset after 1 s, hands fixed [m]",
        lambda row: abs(row["lateral_offset_1s_m"]),
        lambda value, made: min(0.5 * value / (made.limits.lateral_offset_m or 0.85), 1.0),
    ),
}
"""File name -> value; a value at its limit has the colour half-way to red."""


def draw_fault_map(made: FaultMap, folder: str | os.PathLike[str]) -> list[Path]:
    """Draw the heat maps into a folder and return their files."""
    directory = make_folder(folder, StudyError)
    return [
        save(draw(_picture(made, shown)), directory / f"{name}.png", StudyError) for name, shown in _PICTURES.items()
    ]


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
                texts[row][column] = "" if math.isinf(value) else f"{value:.2g}"
        names = faults if situation == situations[0] else [""] * len(faults)
        columns = [f"{speed:g}" for speed in speeds]
        title = situation.replace("_", " ")
        panels.append(Heat(fractions, texts, columns, names, (0.0, 1.0), "RdYlGn_r", title, "speed [km/h]"))
    width_in = 2.6 + len(situations) * (0.7 + 0.55 * len(speeds))
    title = f"Faults: {shown.title}"
    return Picture(title, panels, columns=len(panels), width_in=width_in, height_in=1.2 + 0.26 * len(faults))

"""The fault map as pictures: a panel for each situation, faults downwards, speeds across."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from activesteer.errors import StudyError
from activesteer.files import make_folder
from activesteer.plotting import new_figure, save
from activesteer.studies.paper.fault_map import FaultMap

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class _Shown(NamedTuple):
    """A figure of a row.

    Attributes:
        title: What it is.
        value: Row -> what is written into its field; None where nothing came out.
        fraction: Value, limits -> 0 good to 1 bad, which is the colour.
    """

    title: str
    value: Callable[[Mapping[str, Any]], float | None]
    fraction: Callable[[float, FaultMap], float]


def _tolerated(row: Mapping[str, Any]) -> float | None:
    return math.inf if row["fault_tolerant_time_s"] is None else row["fault_tolerant_time_s"]


_PICTURES: Final = {
    "fault_tolerant_time": _Shown(
        "fault-tolerant time [s]; blank: the limits hold",
        _tolerated,
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
"""File name -> what is shown; half of the way to red is the limit."""


def draw_fault_map(made: FaultMap, folder: str | os.PathLike[str]) -> list[Path]:
    """Draws the heat maps.

    Args:
        made: The map.
        folder: Where they go; created where it does not exist.

    Returns:
        The files.

    Raises:
        ActiveSteerError: a file cannot be written, or matplotlib is not installed.
    """
    directory = make_folder(folder, StudyError)
    return [save(_drawn(made, shown), directory / f"{name}.png", StudyError) for name, shown in _PICTURES.items()]


def _drawn(made: FaultMap, shown: _Shown) -> Figure:
    faults, situations, speeds = (
        list(dict.fromkeys(row[key] for row in made.rows)) for key in ("fault", "situation", "speed_kmh")
    )
    cells = {(row["fault"], row["situation"], row["speed_kmh"]): row for row in made.rows}
    figure = new_figure(
        2.6 + len(situations) * (0.7 + 0.55 * len(speeds)), 1.2 + 0.26 * len(faults), f"Faults: {shown.title}"
    )
    panels = figure.subplots(1, len(situations), sharey=True, squeeze=False)[0]
    for axes, situation in zip(panels, situations, strict=True):
        fractions = np.full((len(faults), len(speeds)), math.nan)
        for place in np.ndindex(fractions.shape):
            row = cells[faults[place[0]], situation, speeds[place[1]]]
            value = shown.value(row)
            if value is None or math.isnan(value):
                text = "failed"
            else:
                fractions[place] = shown.fraction(value, made)
                text = "" if math.isinf(value) else f"{value:.2g}"
            axes.text(place[1], place[0], text, ha="center", va="center", fontsize=7)
        axes.imshow(fractions, cmap="RdYlGn_r", vmin=0.0, vmax=1.0, aspect="auto")
        axes.set_title(situation.replace("_", " "), fontsize="small")
        axes.set_xticks(range(len(speeds)), [f"{speed:g}" for speed in speeds], fontsize=7)
        axes.set_xlabel("speed [km/h]", fontsize=8)
    panels[0].set_yticks(range(len(faults)), faults, fontsize=7)
    return figure

"""The paper's figures from recordings: the same numbers, the same curves 1, 2, 3, and units at every axis.

`draw_all` makes the figures of whole reproductions, `figure_for` makes one figure of a manoeuvre. matplotlib is an
extra of the package and imported when a picture is made. Figures 1, 2 and 3 need more than recordings and are made
elsewhere.

In: recordings.
Out: figures in the style of the paper.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from activesteer.analysis.figures import theory, tracks
from activesteer.analysis.figures.over_time import figure_2, figure_11, time_figure
from activesteer.analysis.source import RecordingLike
from activesteer.drawing.panels import PANELS
from activesteer.errors import ParameterError, RecordingError
from activesteer.files import make_folder
from activesteer.plotting import save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Draw = Callable[[Mapping[str, RecordingLike]], "Figure"]
"""Function from recordings by system to a figure."""


def _over_time(*panels: str, instants: bool = False) -> Draw:
    """Return the function that draws panels over one time axis."""
    return partial(time_figure, panels=[PANELS[name] for name in panels], instants=instants)


FORMATS: Final = (".png", ".svg", ".pdf")

BY_SCENARIO: Final[dict[str, dict[str, Draw]]] = {
    "step_steer": {"figure_11_step_steer": figure_11},
    "sine_with_dwell": {
        "figure_12_sine_with_dwell_input": _over_time("steering_wheel", instants=True),
        "figure_13_sine_with_dwell": _over_time("yaw_rate", "added", "lateral", "sideslip", instants=True),
    },
    "double_lane_change": {
        "figure_14_double_lane_change_course": tracks.course_figure,
        "figure_15_double_lane_change_tracks": tracks.track_figure,
        "figure_16_double_lane_change_steering": _over_time("steering_wheel", "yaw_rate"),
        "figure_17_double_lane_change_response": _over_time("lateral", "added", "sideslip"),
    },
    "slalom": {
        "figure_18_slalom_course": tracks.course_figure,
        "figure_19_slalom_tracks": tracks.track_figure,
        "figure_20_slalom_steering": _over_time("steering_wheel", "yaw_rate"),
        "figure_21_slalom_response": _over_time("lateral", "added", "sideslip"),
    },
    "double_lane_change_low_mu": {
        "figure_22_slippery_tracks": tracks.track_figure,
        "figure_23_slippery_response": _over_time("steering_wheel", "yaw_rate", "lateral", "added"),
        "figure_24_slippery_sideslip": _over_time("sideslip"),
    },
}
"""Scenario -> file name without its ending -> function that draws the figure."""

OF_ANY_RUN: Final = {
    "figure_07_predicted_rear_angle": theory.figure_7,
    "figure_09_tolerance_function": theory.figure_9,
}
"""Figures of parameters, which are the same for every run of a vehicle."""

BY_KIND: Final[dict[str, Draw]] = {
    "step_steer": figure_11,
    "sine_with_dwell": _over_time("steering_wheel", "yaw_rate", "added", "lateral", "sideslip", instants=True),
    "lane_change": tracks.overview,
    "slalom": tracks.overview,
    "follow_path": tracks.overview,
}
"""Kind of manoeuvre -> function that draws it at a glance. Other kinds are drawn by `over_time.time_figure`."""


def draw_all(recordings: Mapping[str, Mapping[str, RecordingLike]], folder: str | os.PathLike[str]) -> list[Path]:
    """Draw the paper's figures of all driven scenarios, as PNG, SVG and PDF.

    Args:
        recordings: Scenario -> system -> run. Scenarios that are not in the paper are ignored.
        folder: Folder for the files; it is created if it does not exist.

    Returns:
        The files written, in the order of their numbers.

    Raises:
        ParameterError: matplotlib is not installed, there is nothing to draw, or the folder cannot be made.
        RecordingError: a channel or the course is missing, or a file cannot be written.
    """
    scenarios = {name: recordings[name] for name in BY_SCENARIO if recordings.get(name)}
    if not scenarios:
        raise ParameterError(
            f"there is no recording to draw; figures are made of {', '.join(BY_SCENARIO)}", allowed=tuple(BY_SCENARIO)
        )
    directory = make_folder(folder, ParameterError)
    any_run = next(iter(next(iter(scenarios.values())).values()))
    paths = []
    for name, show in OF_ANY_RUN.items():
        paths += _write(show(any_run), directory, name)
    for scenario, runs in scenarios.items():
        for name, draw in BY_SCENARIO[scenario].items():
            paths += _write(draw(runs), directory, name)
    return paths


def figure_for(kind: str) -> Callable[[Mapping[str, RecordingLike], str | os.PathLike[str]], Path]:
    """Return the function that draws a kind of manoeuvre at a glance.

    Args:
        kind: Kind of the manoeuvre.

    Returns:
        Function that draws its runs, by system, and saves the figure; the ending of the path gives the format. It
        raises `ParameterError` without matplotlib or a run, and `RecordingError` for a missing channel or a file that
        cannot be written.
    """
    draw = BY_KIND.get(kind, time_figure)

    def draw_and_save(recordings: Mapping[str, RecordingLike], path: str | os.PathLike[str]) -> Path:
        return save(draw(recordings), Path(path), RecordingError)

    return draw_and_save


def _write(figure: Figure, folder: Path, name: str) -> list[Path]:
    return [save(figure, folder / f"{name}{ending}", RecordingError) for ending in FORMATS]


__all__ = ["draw_all", "figure_2", "figure_for"]

"""The paper's figures from recordings, with the paper's curve numbers 1, 2 and 3.

`draw_all` draws the figures of complete reproductions, and `figure_for` returns the function for one figure of a
manoeuvre. matplotlib is an extra of the package, imported only when a figure is drawn. Figures 1, 2 and 3 need more
than recordings and are drawn elsewhere.

In: recordings.
Out: figures in the style of the paper.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from activesteer.analysis.figures import over_time, tracks
from activesteer.analysis.figures.over_time import figure_2, figure_11, time_figure
from activesteer.analysis.source import RecordingLike
from activesteer.config import Source, build
from activesteer.core.conventions import RUN_COLOURS, SYSTEM_LABELS
from activesteer.core.files import make_folder
from activesteer.core.limits import fail, table_of
from activesteer.drawing.panels import PANELS
from activesteer.errors import ParameterError, RecordingError, shown
from activesteer.plotting import new_figure, save
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters
from activesteer.theory.tolerance import tolerance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Draw = Callable[[Mapping[str, RecordingLike]], "Figure"]
"""Function that draws a figure from recordings by system."""


def _over_time(*panels: str) -> Draw:
    """Return the function that draws panels over one time axis."""
    return partial(time_figure, panels=[PANELS[name] for name in panels])


FORMATS: Final = (".png", ".svg", ".pdf")

BY_SCENARIO: Final[dict[str, dict[str, Draw]]] = {
    "step_steer": {"figure_11_step_steer": figure_11},
    "sine_with_dwell": {
        "figure_12_sine_with_dwell_input": _over_time("steering_wheel"),
        "figure_13_sine_with_dwell": _over_time("yaw_rate", "added", "lateral", "sideslip"),
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
"""Functions that draw the figures, by scenario and by file name without its ending."""

TOP_SPEED_MPS: Final = 200.0 / 3.6
"""Greatest speed of the predicted angle [m/s]."""


def figure_7(recording: RecordingLike) -> Figure:
    """Draw the predicted rear angle versus speed, and the fraction of this angle that the rear system uses."""
    single_track = _single_track(recording)
    gain = _number(_parameters(recording, "controllers", "ars"), "prediction_gain", 1.0)
    speed_mps = np.linspace(0.0, TOP_SPEED_MPS, 400)
    ratio, _, _ = single_track.rear_prediction(speed_mps)
    figure = new_figure(width_in=over_time.COLUMN_IN, height_in=2.6)
    axis: Axes = figure.subplots()
    axis.axhline(0.0, color="#999999", linewidth=0.8)
    axis.plot(3.6 * speed_mps, ratio, color=RUN_COLOURS[1], linewidth=1.6, label="keeps sideslip at zero (eq. 5)")
    if gain != 1.0:
        label = f"used part: {100.0 * gain:.3g} %"
        axis.plot(3.6 * speed_mps, gain * ratio, "--", color=RUN_COLOURS[1], linewidth=1.4, label=label)
    zero = np.flatnonzero((ratio[:-1] < 0.0) & (ratio[1:] >= 0.0))
    if zero.size:
        at = 3.6 * float(np.interp(0.0, ratio[zero[0] : zero[0] + 2], speed_mps[zero[0] : zero[0] + 2]))
        arrow = {"arrowstyle": "-", "color": "#999999", "linewidth": 0.8}
        over_time.note(axis, f"{at:.0f} km/h", (at, 0.0), (10, -16), arrowprops=arrow)
    for text, offset in (("in phase", 6), ("opposed", -12)):
        over_time.note(axis, text, (0.0, 0.0), (4, offset), ha="left")
    over_time.plain(axis, "rear angle over front angle,\nsteady [deg/deg]")
    axis.set_xlabel("speed [km/h]")
    axis.set_xlim(0.0, 3.6 * TOP_SPEED_MPS)
    over_time.name_curves(figure, axis)
    return figure


def figure_9(recording: RecordingLike) -> Figure:
    """Draw the tolerance function of the correctors, with c_off and c_in."""
    bands: dict[tuple[float, float], list[str]] = {}
    for system in ("ars", "afs"):
        corrector = _parameters(recording, "controllers", system, "corrector")
        band = _number(corrector, "deadband_start_radps"), _number(corrector, "deadband_end_radps")
        bands.setdefault(band, []).append(system)
    end = 1.6 * max(full for _, full in bands)
    error_radps = np.linspace(-end, end, 1001)
    figure = new_figure(width_in=over_time.COLUMN_IN, height_in=2.6)
    axis: Axes = figure.subplots()
    for (off, full), systems in bands.items():
        colour = RUN_COLOURS[list(SYSTEM_LABELS).index(systems[0])] if len(systems) == 1 else RUN_COLOURS[0]
        label = ",\n".join(SYSTEM_LABELS[system] for system in systems)
        activity = [tolerance(error, off, full) for error in error_radps.tolist()]
        axis.plot(np.degrees(error_radps), activity, color=colour, linewidth=1.6, label=label)
        for name, value in (("off", off), ("in", full)):
            axis.axvline(math.degrees(value), color=colour, linewidth=0.8, linestyle=":")
            text = f"$c_{{{name}}}$ = {math.degrees(value):.3g} deg/s"
            over_time.note(axis, text, (math.degrees(value), 0.5), (3, 0), rotation=90, va="center")
    over_time.plain(axis, "activity of the corrector [-]")
    axis.set_xlabel("yaw rate error, desired less actual [deg/s]")
    axis.set_xlim(-math.degrees(end), math.degrees(end))
    axis.set_ylim(-0.05, 1.12)
    over_time.name_curves(figure, axis)
    return figure


def _parameters(recording: RecordingLike, *keys: str) -> Mapping[str, Any]:
    value, path = recording.metadata.get("vehicle"), "vehicle"
    for key in keys:
        value, path = table_of(value, path).get(key), f"{path}.{key}"
    return table_of(value, path)


def _single_track(recording: RecordingLike) -> SingleTrack:
    source = Source("the metadata of the recording", error=RecordingError)
    table = _parameters(recording, "single_track")
    parameters = build(SingleTrackParameters, table, source, ("vehicle", "single_track"))
    try:
        return SingleTrack(parameters)
    except ParameterError as error:
        raise RecordingError(f"the metadata of the recording: {error}") from error


def _number(table: Mapping[str, Any], key: str, default: float | None = None) -> float:
    value = table.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise fail(key, f"is {shown(value)}, expected a number of the vehicle's controllers")
    return float(value)


OF_ANY_RUN: Final = {
    "figure_07_predicted_rear_angle": figure_7,
    "figure_09_tolerance_function": figure_9,
}
"""Figures of parameters, which are the same for every run of a vehicle."""

BY_KIND: Final[dict[str, Draw]] = {
    "step_steer": figure_11,
    "sine_with_dwell": _over_time("steering_wheel", "yaw_rate", "added", "lateral", "sideslip"),
    "lane_change": tracks.overview,
    "slalom": tracks.overview,
    "follow_path": tracks.overview,
}
"""Functions that draw an overview, by kind of manoeuvre. Other kinds are drawn by `over_time.time_figure`."""


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
    """Return the function that draws an overview of a kind of manoeuvre.

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

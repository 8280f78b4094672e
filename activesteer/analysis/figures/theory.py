"""Figures 7 and 9: the control law, from the parameters in a recording."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from activesteer.analysis.figures import style
from activesteer.analysis.source import RecordingLike
from activesteer.config import Source, build
from activesteer.conventions import RUN_COLOURS, SYSTEM_LABELS
from activesteer.errors import ParameterError, RecordingError, shown
from activesteer.plotting import new_figure
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters
from activesteer.theory.tolerance import tolerance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TOP_SPEED_MPS: Final = 200.0 / 3.6
"""Greatest speed of the predicted angle [m/s]."""


def figure_7(recording: RecordingLike) -> Figure:
    """Draw the predicted rear angle over speed, and the part of it that the rear system uses."""
    single_track = _single_track(recording)
    gain = _number(_parameters(recording, "controllers", "ars"), "prediction_gain", 1.0)
    speed_mps = np.linspace(0.0, TOP_SPEED_MPS, 400)
    ratio, _, _ = single_track.rear_prediction(speed_mps)
    figure = new_figure(width_in=style.COLUMN_IN, height_in=2.6)
    axis: Axes = figure.subplots()
    axis.axhline(0.0, color="#999999", linewidth=0.8)
    axis.plot(3.6 * speed_mps, ratio, color=RUN_COLOURS[1], linewidth=1.6, label="keeps sideslip at zero (eq. 5)")
    if gain != 1.0:
        label = f"used part: {100.0 * gain:.3g} %"
        axis.plot(3.6 * speed_mps, gain * ratio, "--", color=RUN_COLOURS[1], linewidth=1.4, label=label)
    zero = np.flatnonzero((ratio[:-1] < 0.0) & (ratio[1:] >= 0.0))
    if zero.size:
        at = 3.6 * float(np.interp(0.0, ratio[zero[0] : zero[0] + 2], speed_mps[zero[0] : zero[0] + 2]))
        axis.annotate(
            f"{at:.0f} km/h", (at, 0.0), (10, -16), textcoords="offset points", color="#555555",
            fontsize=style.TEXT_PT,
            arrowprops={"arrowstyle": "-", "color": "#999999", "linewidth": 0.8},
        )  # fmt: skip
    for text, offset in (("in phase", 6), ("opposed", -12)):
        axis.annotate(
            text, (0.0, 0.0), (4, offset), textcoords="offset points", ha="left", color="#555555",
            fontsize=style.TEXT_PT,
        )  # fmt: skip
    style.plain(axis, "rear angle over front angle,\nsteady [deg/deg]")
    axis.set_xlabel("speed [km/h]")
    axis.set_xlim(0.0, 3.6 * TOP_SPEED_MPS)
    style.name_curves(figure, axis)
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
    figure = new_figure(width_in=style.COLUMN_IN, height_in=2.6)
    axis: Axes = figure.subplots()
    for (off, full), systems in bands.items():
        colour = RUN_COLOURS[list(SYSTEM_LABELS).index(systems[0])] if len(systems) == 1 else RUN_COLOURS[0]
        label = ",\n".join(SYSTEM_LABELS[system] for system in systems)
        activity = [tolerance(error, off, full) for error in error_radps.tolist()]
        axis.plot(np.degrees(error_radps), activity, color=colour, linewidth=1.6, label=label)
        for name, value in (("off", off), ("in", full)):
            axis.axvline(math.degrees(value), color=colour, linewidth=0.8, linestyle=":")
            axis.annotate(
                f"$c_{{{name}}}$ = {math.degrees(value):.3g} deg/s", (math.degrees(value), 0.5), (3, 0), rotation=90,
                textcoords="offset points", va="center", fontsize=style.TEXT_PT, color="#555555",
            )  # fmt: skip
    style.plain(axis, "activity of the corrector [-]")
    axis.set_xlabel("yaw rate error, desired less actual [deg/s]")
    axis.set_xlim(-math.degrees(end), math.degrees(end))
    axis.set_ylim(-0.05, 1.12)
    style.name_curves(figure, axis)
    return figure


def _parameters(recording: RecordingLike, *keys: str) -> Mapping[str, Any]:
    table: Any = recording.metadata.get("vehicle")
    for key in keys:
        table = table.get(key) if isinstance(table, Mapping) else None
    if not isinstance(table, Mapping):
        path = f"vehicle.{'.'.join(keys)}"
        raise RecordingError(f"the metadata of the recording have no table {path!r}", value=path)
    return table


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
        raise RecordingError(f"the controllers in the metadata of the recording: {key} is {shown(value)}, not a number")
    return float(value)

"""Figures of the control law itself, from the parameters that a recording holds: 7 and 9."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.figures import style
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import RUN_COLOURS, SYSTEM_LABELS
from activesteer.errors import RecordingError
from activesteer.plotting import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TOP_SPEED_MPS: Final = 200.0 / 3.6
"""Up to where the predicted angle is drawn [m/s]."""


def predicted_rear_angle(single_track: Mapping[str, float], speed_mps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Steady rear angle over front angle that keeps the sideslip at zero, K_H.

    Args:
        single_track: Parameters of the single-track model, as in the metadata of a recording.
        speed_mps: Speeds [m/s], shape (n,).

    Returns:
        K_H [-], shape (n,); below 0 against the front wheels.

    Source: V. Dorsch, Mecatronics-REM 2012, eq. 5, re-derived from eqs. 1 and 2 with beta = beta_dot = 0.
    """
    p = single_track
    m, cv, ch, lv, lh = (
        p[key] for key in ("mass_kg", "front_stiffness_Nprad", "rear_stiffness_Nprad", "cg_to_front_m", "cg_to_rear_m")
    )
    v2, wheelbase = speed_mps**2, lv + lh
    return cv / ch * (m * v2 * lv - ch * lh * wheelbase) / (m * v2 * lh + cv * lv * wheelbase)


def tolerance(error_radps: NDArray[np.float64], off_radps: float, full_radps: float) -> NDArray[np.float64]:
    """Activity of the corrector, 0 to 1, as the controllers have it: a cubic between c_off and c_in.

    Args:
        error_radps: Yaw rate error [rad/s], shape (n,).
        off_radps: c_off [rad/s].
        full_radps: c_in [rad/s].
    """
    width = full_radps - off_radps
    above = np.abs(error_radps) - off_radps
    x = np.clip(above / width, 0.0, 1.0) if width > 0.0 else (above > 0.0).astype(np.float64)
    return x * x * (3.0 - 2.0 * x)


def figure_7(recording: RecordingLike) -> Figure:
    """Predicted rear angle over speed, and the share of it that the rear system uses.

    Raises:
        ParameterError: matplotlib is not installed.
        RecordingError: the metadata do not hold the parameters.
    """
    single_track = _parameters(recording, "single_track")
    gain = float(_parameters(recording, "controllers", "ars").get("prediction_gain", 1.0))
    speed_mps = np.linspace(0.0, TOP_SPEED_MPS, 400)
    try:
        share = predicted_rear_angle(single_track, speed_mps)
    except KeyError as error:
        raise RecordingError(f"the metadata's 'vehicle.single_track' has no {error}") from error
    figure = new_figure(width_in=7.5, height_in=4.2)
    axis: Axes = figure.subplots()
    axis.axhline(0.0, color="#999999", linewidth=0.8)
    axis.plot(
        3.6 * speed_mps, share, color=RUN_COLOURS[1], linewidth=1.6, label="keeps the sideslip angle at zero (eq. 5)"
    )
    if gain != 1.0:
        label = f"used by the rear system: {100.0 * gain:.3g} %"
        axis.plot(3.6 * speed_mps, gain * share, "--", color=RUN_COLOURS[1], linewidth=1.4, label=label)
    zero = np.flatnonzero((share[:-1] < 0.0) & (share[1:] >= 0.0))
    if zero.size:
        at = 3.6 * float(np.interp(0.0, share[zero[0] : zero[0] + 2], speed_mps[zero[0] : zero[0] + 2]))
        axis.annotate(
            f"{at:.0f} km/h", (at, 0.0), (10, -16), textcoords="offset points", color="#555555",
            arrowprops={"arrowstyle": "-", "color": "#999999", "linewidth": 0.8},
        )  # fmt: skip
    for text, offset in (("with the front wheels", 12), ("against them", -16)):
        axis.annotate(
            text, (3.6 * TOP_SPEED_MPS, 0.0), (-4, offset), textcoords="offset points", ha="right", color="#777777",
            fontsize="small",
        )  # fmt: skip
    style.plain(axis, "rear angle over front angle,\nsteady [deg/deg]")
    axis.set_xlabel("speed [km/h]")
    axis.set_xlim(0.0, 3.6 * TOP_SPEED_MPS)
    axis.legend(loc="upper left", frameon=False, fontsize="small")
    return figure


def figure_9(recording: RecordingLike) -> Figure:
    """Tolerance function of the correctors, with c_off and c_in.

    Raises:
        ParameterError: matplotlib is not installed.
        RecordingError: the metadata do not hold the parameters.
    """
    bands: dict[tuple[float, float], list[str]] = {}
    for system in ("ars", "afs"):
        corrector = _parameters(recording, "controllers", system, "corrector")
        try:
            band = float(corrector["off_radps"]), float(corrector["full_radps"])
        except (KeyError, TypeError, ValueError) as error:
            raise RecordingError(
                f"the metadata's 'vehicle.controllers.{system}.corrector' gives no tolerance band: {error}"
            ) from error
        bands.setdefault(band, []).append(system)
    end = 1.6 * max(full for _, full in bands)
    error_radps = np.linspace(-end, end, 1001)
    figure = new_figure(width_in=7.5, height_in=4.0)
    axis: Axes = figure.subplots()
    for (off, full), systems in bands.items():
        colour = RUN_COLOURS[list(SYSTEM_LABELS).index(systems[0])] if len(systems) == 1 else RUN_COLOURS[0]
        label = " and ".join(SYSTEM_LABELS[system] for system in systems)
        axis.plot(np.degrees(error_radps), tolerance(error_radps, off, full), color=colour, linewidth=1.6, label=label)
        for name, value in (("off", off), ("in", full)):
            axis.axvline(math.degrees(value), color=colour, linewidth=0.8, linestyle=":")
            axis.annotate(
                f"$c_{{{name}}}$ = {math.degrees(value):.3g} deg/s", (math.degrees(value), 0.5), (3, 0), rotation=90,
                textcoords="offset points", va="center", fontsize="small", color="#555555",
            )  # fmt: skip
    style.plain(axis, "activity of the corrector [-]")
    axis.set_xlabel("yaw rate error, desired less actual [deg/s]")
    axis.set_xlim(-math.degrees(end), math.degrees(end))
    axis.set_ylim(-0.05, 1.12)
    axis.legend(loc="upper left", frameon=False, fontsize="small")
    return figure


def _parameters(recording: RecordingLike, *keys: str) -> Mapping[str, Any]:
    table: Any = recording.metadata.get("vehicle")
    for key in keys:
        table = table.get(key) if isinstance(table, Mapping) else None
    if not isinstance(table, Mapping):
        raise RecordingError(f"the metadata of the recording have no table 'vehicle.{'.'.join(keys)}'")
    return table

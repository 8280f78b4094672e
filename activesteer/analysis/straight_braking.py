"""Metrics of braking straight ahead (ISO 21994, ISO 14512): distance, deceleration, use of the friction."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.analysis.source import RecordingLike
from activesteer.conventions import CORNERS, GRAVITY_MPS2, Array
from activesteer.errors import RecordingError

STANDSTILL_MPS: Final = 0.1
"""Speed below which the car stands [m/s]."""
FROM_FRACTION, TO_FRACTION = 0.8, 0.1
"""Fractions of the initial speed for the mean fully developed deceleration (UN R13-H): 80 and 10 of 100 km/h."""
SLIPS_FROM_MPS: Final = 15.0 / 3.6
"""Speed above which no wheel shall lock [m/s]. UN R13-H, annex 6 has the same speed."""

KEY_METRICS: Final = (
    "stopping_distance_m", "mean_deceleration_mps2", "braking_efficiency", "wheel_slip_max",
    "brake_pressure_peak_Pa", "yaw_rate_peak_abs_radps", "lateral_deviation_max_m", "steering_wheel_peak_abs_rad",
    "speed_begin_mps", "braking_begin_time_s",
)  # fmt: skip
"""Key metrics, the most telling first."""


def straight_braking_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of braking straight ahead.

    Returns:
        - `braking_begin_time_s`, `speed_begin_mps`: at the first pressure on the brake pedal.
        - `stopping_distance_m`: from there to standstill.
        - `mean_deceleration_mps2`: mean fully developed deceleration, over the distance between 80 and 10 % of the
          initial speed (UN R13-H).
        - `braking_efficiency`: this deceleration over the one that the tyres' peak friction allows at their loads on
          the same distance, g sum(mu F_z) / sum(F_z); drag counts as braking.
        - `wheel_slip_max`: largest slip of a wheel as a fraction of the car's speed, above 15 km/h; 1 is locked.
        - `brake_pressure_peak_Pa`, and until standstill `yaw_rate_peak_abs_radps`, `lateral_deviation_max_m` from the
          straight line, `steering_wheel_peak_abs_rad`; `heading_end_rad` there, against the straight line.

        A value is nan if the car does not get so far.

    Raises:
        RecordingError: a channel is missing, or the brake is not pressed.
    """
    time_s = np.asarray(recording.time_s, dtype=np.float64)
    pressed = recording["brake_pedal"] > 0.0
    if not pressed.any():
        raise RecordingError("the recording holds no braking: the brake is not pressed")
    begin = int(pressed.argmax())
    speed = np.asarray(recording["speed_mps"], dtype=np.float64)
    x, y = (np.asarray(recording[name], dtype=np.float64) for name in ("x_m", "y_m"))
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    stop = _below(speed, begin, STANDSTILL_MPS)
    start_mps = float(speed[begin])
    deceleration, efficiency = math.nan, math.nan
    fast, slow = (_below(speed, begin, fraction * start_mps) for fraction in (FROM_FRACTION, TO_FRACTION))
    if fast is not None and slow is not None:
        deceleration = float((speed[fast] ** 2 - speed[slow] ** 2) / (2.0 * (way[slow] - way[fast])))
        efficiency = deceleration / _allowed(recording, way, fast, slow)
    end = len(speed) if stop is None else stop + 1
    braked = slice(begin, end)
    heading = float(recording["yaw_rad"][begin])
    aside = math.cos(heading) * (y[braked] - y[begin]) - math.sin(heading) * (x[braked] - x[begin])
    return {
        "braking_begin_time_s": float(time_s[begin]),
        "speed_begin_mps": start_mps,
        "stopping_distance_m": math.nan if stop is None else float(way[stop] - way[begin]),
        "mean_deceleration_mps2": deceleration,
        "braking_efficiency": efficiency,
        "wheel_slip_max": _largest_slip(recording, speed, braked),
        "brake_pressure_peak_Pa": max(float(recording[f"{corner}_brake_pressure_Pa"].max()) for corner in CORNERS),
        "yaw_rate_peak_abs_radps": float(np.abs(recording["yaw_rate_radps"][braked]).max()),
        "lateral_deviation_max_m": float(np.abs(aside).max()),
        "heading_end_rad": math.remainder(float(recording["yaw_rad"][end - 1]) - heading, 2.0 * math.pi),
        "steering_wheel_peak_abs_rad": float(np.abs(recording["steering_wheel_rad"][braked]).max()),
    }


def _below(speed: Array, begin: int, level_mps: float) -> int | None:
    slow = np.flatnonzero(speed[begin:] <= level_mps)
    return begin + int(slow[0]) if slow.size else None


def _allowed(recording: RecordingLike, way: Array, first: int, last: int) -> float:
    """Return the mean over the distance of the deceleration that the tyres' peak friction allows [m/s2].

    The peak force of a tyre is its force over the fraction of its friction that it uses.
    """
    part = slice(first, last + 1)
    peaks, loads = np.zeros(last + 1 - first), np.zeros(last + 1 - first)
    for corner in CORNERS:
        fx, fy, fz, use = (
            np.asarray(recording[f"{corner}_{name}"][part], dtype=np.float64)
            for name in ("tyre_fx_N", "tyre_fy_N", "tyre_fz_N", "friction_utilisation")
        )
        used = use > 0.0
        peaks[used] += np.hypot(fx, fy)[used] / use[used]
        loads += fz
    return GRAVITY_MPS2 * float(np.trapezoid(peaks, way[part]) / np.trapezoid(loads, way[part]))


def _largest_slip(recording: RecordingLike, speed: Array, braked: slice) -> float:
    """Return the largest relative slip of a wheel above `SLIPS_FROM_MPS`.

    The rolling radius of each wheel is its radius before the brake.
    """
    fast = speed[braked] > SLIPS_FROM_MPS
    if not fast.any():
        return math.nan
    rolls, largest = max(braked.start - 1, 0), 0.0
    for corner in CORNERS:
        spin = np.asarray(recording[f"{corner}_wheel_speed_radps"], dtype=np.float64)
        radius_m = speed[rolls] / spin[rolls]
        largest = max(largest, float((1.0 - radius_m * spin[braked][fast] / speed[braked][fast]).max()))
    return largest

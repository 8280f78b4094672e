"""Metrics of braking straight ahead (ISO 21994, ISO 14512) and in a turn (ISO 7975).

In a turn the reference is the circle of the steady state before the brake. Its radius is speed over yaw rate. Its
centre is across the track of the centre of gravity at the start of braking.

Source: ISO 7975, Passenger cars - Braking in a turn - Open-loop test method.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.analysis.series import peak, value_at
from activesteer.analysis.source import RecordingLike
from activesteer.core.conventions import CORNERS, GRAVITY_MPS2, Array
from activesteer.errors import RecordingError

STOPPED_MPS: Final = 0.1
"""Speed below which the car stands [m/s]."""
FROM_FRACTION, TO_FRACTION = 0.8, 0.1
"""Fractions of the initial speed for the mean fully developed deceleration (UN R13-H): 80 and 10 of 100 km/h."""
SLIPS_FROM_MPS: Final = 15.0 / 3.6
"""Speed above which no wheel may lock [m/s]: the same speed as in UN R13-H, annex 6."""


def straight_braking_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of braking straight ahead.

    Returns:
        - `braking_begin_time_s`, `speed_begin_mps`: at the first pressure on the brake pedal.
        - `stopping_distance_m`: from there to standstill.
        - `mean_deceleration_mps2`: mean fully developed deceleration, over the distance between 80 and 10 % of the
          initial speed (UN R13-H).
        - `braking_efficiency`: this deceleration over the value that the tyres' peak friction allows at their loads on
          the same distance, g sum(mu F_z) / sum(F_z); drag counts as braking.
        - `wheel_slip_max`: largest slip of a wheel as a fraction of the car's speed, above 15 km/h; 1 is locked.
        - `brake_pressure_peak_Pa`, and until standstill `yaw_rate_peak_abs_radps`, `lateral_deviation_max_m` from the
          straight line, `steering_wheel_peak_abs_rad`; `heading_end_rad` there, against the straight line.

        A value is nan if the car does not get so far.

    Raises:
        RecordingError: a channel is missing, or the brake is not pressed.
    """
    time_s = recording.time_s
    pressed = recording["brake_pedal"] > 0.0
    if not pressed.any():
        raise RecordingError("the recording holds no braking: the brake is not pressed")
    begin = int(pressed.argmax())
    speed = recording["speed_mps"]
    x, y = recording["x_m"], recording["y_m"]
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    stop = _below(speed, begin, STOPPED_MPS)
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
        **peak(recording, "yaw_rate_radps", braked),
        "lateral_deviation_max_m": float(np.abs(aside).max()),
        "heading_end_rad": math.remainder(float(recording["yaw_rad"][end - 1]) - heading, 2.0 * math.pi),
        **peak(recording, "steering_wheel_rad", braked),
    }


def _below(speed: Array, begin: int, level_mps: float) -> int | None:
    slow = np.flatnonzero(speed[begin:] <= level_mps)
    return begin + int(slow[0]) if slow.size else None


def _allowed(recording: RecordingLike, way: Array, first: int, last: int) -> float:
    """Return the distance-averaged deceleration that the peak friction of the tyres allows [m/s2]."""
    # The peak force of a tyre is its force over the fraction of its friction that it uses.
    part = slice(first, last + 1)
    peaks, loads = np.zeros(last + 1 - first), np.zeros(last + 1 - first)
    for corner in CORNERS:
        fx, fy, fz, use = (
            recording[f"{corner}_{name}"][part]
            for name in ("tyre_fx_N", "tyre_fy_N", "tyre_fz_N", "friction_utilisation")
        )
        used = use > 0.0
        peaks[used] += np.hypot(fx, fy)[used] / use[used]
        loads += fz
    return GRAVITY_MPS2 * float(np.trapezoid(peaks, way[part]) / np.trapezoid(loads, way[part]))


def _largest_slip(recording: RecordingLike, speed: Array, braked: slice) -> float:
    """Return the largest relative slip of a wheel above `SLIPS_FROM_MPS`."""
    # The rolling radius of each wheel is its radius before the brake.
    fast = speed[braked] > SLIPS_FROM_MPS
    if not fast.any():
        return math.nan
    rolls, largest = max(braked.start - 1, 0), 0.0
    for corner in CORNERS:
        spin = recording[f"{corner}_wheel_speed_radps"]
        radius_m = speed[rolls] / spin[rolls]
        largest = max(largest, float((1.0 - radius_m * spin[braked][fast] / speed[braked][fast]).max()))
    return largest


BEFORE_S: Final = 0.5
"""Length of the window before the brake whose mean is the steady state [s]."""
AFTER_S: Final = 1.0
"""Time after the start of braking at which the car is compared with its circle [s]."""
END_SPEED_MPS: Final = 1.0
"""Speed at which braking ends [m/s]."""
MIN_YAW_RATE_RADPS: Final = math.radians(0.5)
"""Smallest yaw rate before the brake of a car that turns [rad/s]."""


def brake_in_turn_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of braking in a turn.

    Returns:
        - `braking_begin_time_s`; the steady state before it: `speed_begin_mps`, `ay_begin_mps2`,
          `yaw_rate_begin_radps`, `radius_begin_m`.
        - `mean_deceleration_mps2`: until standstill, release of the pedal, or the end of the run.
        - `yaw_rate_after_1000ms_radps`: 1 s after the start of braking.
        - `yaw_rate_deviation_after_1000ms_radps`: the same minus the yaw rate that keeps the car on the circle at its
          current speed, in the direction of the turn; above 0 the car turns in.
        - `path_deviation_after_1000ms_m`: distance of the centre of gravity from the circle, outwards positive.
        - `yaw_rate_peak_abs_radps`, `sideslip_peak_abs_rad`: from the start of braking on; sideslip above
          10 km/h.

        A value is nan if the run ends before it.

    Raises:
        RecordingError: a channel is missing, the brake is not pressed, or the car does not turn before.
    """
    time_s = recording.time_s
    pressed = recording["brake_pedal"] > 0.0
    if not pressed.any() or time_s[int(pressed.argmax())] - time_s[0] < BEFORE_S:
        raise RecordingError(
            "the recording holds no braking in a turn: the brake must be pressed, "
            f"and not before {BEFORE_S:g} s after the start",
            allowed=BEFORE_S,
        )
    begin = int(pressed.argmax())
    before = (time_s >= time_s[begin] - BEFORE_S) & (time_s < time_s[begin])
    speed_mps, ay_mps2, yaw_rate_radps = (
        float(np.mean(recording[name][before])) for name in ("speed_mps", "ay_mps2", "yaw_rate_radps")
    )
    if not abs(yaw_rate_radps) >= MIN_YAW_RATE_RADPS:
        raise RecordingError(
            f"the recording holds no braking in a turn: the yaw rate before the brake is "
            f"{math.degrees(yaw_rate_radps):.3g} deg/s; at least {math.degrees(MIN_YAW_RATE_RADPS):.3g} are needed",
            value=yaw_rate_radps,
            allowed=MIN_YAW_RATE_RADPS,
        )
    side, radius_m = math.copysign(1.0, yaw_rate_radps), abs(speed_mps / yaw_rate_radps)
    after_s = float(time_s[begin]) + AFTER_S
    speed_then, yaw_rate_then, x_then, y_then = (
        value_at(time_s, recording[name], after_s) for name in ("speed_mps", "yaw_rate_radps", "x_m", "y_m")
    )
    course_rad = float(recording["yaw_rad"][begin] + recording["sideslip_rad"][begin])
    middle_x = float(recording["x_m"][begin]) - side * radius_m * math.sin(course_rad)
    middle_y = float(recording["y_m"][begin]) + side * radius_m * math.cos(course_rad)
    return {
        "braking_begin_time_s": float(time_s[begin]),
        "speed_begin_mps": speed_mps,
        "ay_begin_mps2": ay_mps2,
        "yaw_rate_begin_radps": yaw_rate_radps,
        "radius_begin_m": radius_m,
        "mean_deceleration_mps2": _deceleration(recording, begin),
        "yaw_rate_after_1000ms_radps": yaw_rate_then,
        "yaw_rate_deviation_after_1000ms_radps": side * yaw_rate_then - speed_then / radius_m,
        "path_deviation_after_1000ms_m": math.hypot(x_then - middle_x, y_then - middle_y) - radius_m,
        **peak(recording, "yaw_rate_radps", slice(begin, None)),
        **peak(recording, "sideslip_rad", slice(begin, None)),
        "speed_end_mps": float(recording["speed_mps"][-1]),
    }


def _deceleration(recording: RecordingLike, begin: int) -> float:
    speed, pedal = recording["speed_mps"], recording["brake_pedal"]
    ended = np.flatnonzero((speed[begin:] < END_SPEED_MPS) | (pedal[begin:] <= 0.0))
    end = begin + int(ended[0]) if ended.size else len(speed) - 1
    if end <= begin:
        return math.nan
    return float((speed[begin] - speed[end]) / (recording.time_s[end] - recording.time_s[begin]))

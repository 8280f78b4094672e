"""Metrics of braking in a turn by ISO 7975: the car in the first second, compared with its circle before the brake.

The reference is the circle of the steady state before the brake. Its radius is speed over yaw rate. Its centre lies
across the track of the centre of gravity at the beginning of braking.

Source: ISO 7975, Passenger cars - Braking in a turn - Open-loop test method.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.analysis.series import counted_sideslip
from activesteer.analysis.source import RecordingLike
from activesteer.errors import RecordingError

BEFORE_S: Final = 0.5
"""Length of the window before the brake whose mean is the steady state [s]."""
AFTER_S: Final = 1.0
"""Time after the beginning of braking at which the car is compared with its circle [s]."""
STANDSTILL_MPS: Final = 1.0
"""Speed at which braking ends [m/s]."""
MIN_YAW_RATE_RADPS: Final = math.radians(0.5)
"""Smallest yaw rate before the brake of a car that turns [rad/s]."""

KEY_METRICS: Final = (
    "yaw_rate_deviation_after_1000ms_radps", "path_deviation_after_1000ms_m", "yaw_rate_after_1000ms_radps",
    "yaw_rate_peak_abs_radps", "sideslip_peak_abs_rad", "mean_deceleration_mps2", "ay_begin_mps2", "radius_begin_m",
    "speed_begin_mps", "speed_end_mps",
)  # fmt: skip
"""Key metrics, the most telling first."""


def brake_in_turn_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of braking in a turn.

    Returns:
        - `braking_begin_time_s`; the steady state before it: `speed_begin_mps`, `ay_begin_mps2`,
          `yaw_rate_begin_radps`, `radius_begin_m`.
        - `mean_deceleration_mps2`: until standstill, release of the pedal, or the end of the run.
        - `yaw_rate_after_1000ms_radps`: 1 s after the beginning of braking.
        - `yaw_rate_deviation_after_1000ms_radps`: the same less the yaw rate that keeps the car on the circle at its
          present speed, in the direction of the turn; above 0 the car turns in.
        - `path_deviation_after_1000ms_m`: distance of the centre of gravity from the circle, outwards positive.
        - `yaw_rate_peak_abs_radps`, `sideslip_peak_abs_rad`: from the beginning of braking on; sideslip above
          10 km/h.

        A value is nan if the run ends before it.

    Raises:
        RecordingError: a channel is missing, the brake is not pressed, or the car does not turn before.
    """
    time_s = np.asarray(recording.time_s, dtype=np.float64)
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
            f"{math.degrees(yaw_rate_radps):.3g} deg/s, at least {math.degrees(MIN_YAW_RATE_RADPS):.3g} are needed",
            value=yaw_rate_radps,
            allowed=MIN_YAW_RATE_RADPS,
        )
    side, radius_m = math.copysign(1.0, yaw_rate_radps), abs(speed_mps / yaw_rate_radps)
    after_s = float(time_s[begin]) + AFTER_S
    speed_then, yaw_rate_then, x_then, y_then = (
        float(np.interp(after_s, time_s, recording[name])) if after_s <= time_s[-1] else math.nan
        for name in ("speed_mps", "yaw_rate_radps", "x_m", "y_m")
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
        "yaw_rate_peak_abs_radps": float(np.abs(recording["yaw_rate_radps"][begin:]).max()),
        "sideslip_peak_abs_rad": float(np.abs(counted_sideslip(recording, slice(begin, None))).max()),
        "speed_end_mps": float(recording["speed_mps"][-1]),
    }


def _deceleration(recording: RecordingLike, begin: int) -> float:
    speed, pedal = recording["speed_mps"], recording["brake_pedal"]
    ended = np.flatnonzero((speed[begin:] < STANDSTILL_MPS) | (pedal[begin:] <= 0.0))
    end = begin + int(ended[0]) if ended.size else len(speed) - 1
    if end <= begin:
        return math.nan
    return float((speed[begin] - speed[end]) / (recording.time_s[end] - recording.time_s[begin]))

"""Metrics of a slow ramp of the steering wheel: steady-state handling, and the angle A of FMVSS 126.

Source: 49 CFR 571.126 (FMVSS 126), S7.6 and S7.11; NHTSA TP-126, which gives the range of the line.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.analysis import handling
from activesteer.analysis.series import Array, low_pass, timestep
from activesteer.analysis.sine_with_dwell import MOTION_CUT_OFF_Hz, STEERING_CUT_OFF_Hz
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import GRAVITY_MPS2

REFERENCE_MPS2: Final = 0.3 * GRAVITY_MPS2
"""Lateral acceleration at which the angle is A [m/s2]."""
FIT: Final = (1.0 / 3.0, 1.25)
"""Range of the line, in fractions of the wanted acceleration: 0.1 to 0.375 g for 0.3 g."""

KEY_METRICS: Final = (
    "steering_wheel_at_0_3g_rad", "understeer_gradient_radpmps2", "characteristic_speed_mps", "yaw_rate_gain_1ps",
    "steering_wheel_gain_mps2prad", "steer_gradient_radpmps2", "roll_gradient_radpmps2",
    "sideslip_gradient_radpmps2", "linear_range_mps2", "limit_acceleration_mps2",
)  # fmt: skip
"""Key metrics, the most telling first."""


def slow_ramp_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of a slow ramp."""
    values = handling.handling_metrics(recording)
    step_s = timestep(np.asarray(recording.time_s, dtype=np.float64))
    ay = low_pass(recording["ay_mps2"], step_s, MOTION_CUT_OFF_Hz)
    steering = low_pass(recording["steering_wheel_rad"], step_s, STEERING_CUT_OFF_Hz)
    side = math.copysign(1.0, float(ay[int(np.abs(ay).argmax())]))
    reached = float((side * ay).max()) >= FIT[1] * REFERENCE_MPS2
    angle = side * angle_at(side * steering, side * ay, REFERENCE_MPS2) if reached else math.nan
    return values | {"steering_wheel_at_0_3g_rad": angle}


def angle_at(steering_rad: Array, ay_mps2: Array, wanted_mps2: float) -> float:
    """Return the steering wheel angle [rad] at a lateral acceleration, by the line through the range of `FIT`."""
    low, high = (fraction * wanted_mps2 for fraction in FIT)
    line = slice(int(np.argmax(ay_mps2 > low)), int(np.argmax(ay_mps2 > high)))
    slope, offset = np.polynomial.Polynomial.fit(steering_rad[line], ay_mps2[line], 1).convert().coef[::-1]
    return float((wanted_mps2 - offset) / slope)

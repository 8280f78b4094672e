"""Metrics of manoeuvres in phases: how near the car comes to lifting its wheels, and the general metrics.

NHTSA's rollover test counts a run in which both inner wheels leave the ground by two inches at the same time. Here the
wheels count as lifted while the road does not carry them.

Source: 68 FR 59250 (2003), Consumer Information; New Car Assessment Program; Rollover Resistance.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.analysis import general
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import CORNERS

LIFTED_N: Final = 1.0
"""Vertical load below which a wheel is lifted [N]."""
KEY_METRICS: Final = (
    "two_wheel_lift_time_s", "wheel_load_min_N", "roll_peak_abs_rad", "ay_peak_abs_mps2", "sideslip_peak_abs_rad",
    "yaw_rate_peak_abs_radps", "yaw_rate_rms_radps", "friction_utilisation_max", "steering_wheel_peak_abs_rad",
    "speed_end_mps",
)  # fmt: skip
"""Key metrics, the most telling first."""


def rollover_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the general metrics, and those of the wheel loads."""
    loads_N = np.array([recording[f"{corner}_tyre_fz_N"] for corner in CORNERS], dtype=np.float64)
    lifted = loads_N < LIFTED_N
    both = (lifted[0] & lifted[2]) | (lifted[1] & lifted[3])
    step_s = float(recording.time_s[1] - recording.time_s[0])
    values = {"two_wheel_lift_time_s": float(both.sum()) * step_s, "wheel_load_min_N": float(loads_N.min())}
    return values | general.general_metrics(recording)

"""Offsets of signals, from the time in which the car still goes straight, by FMVSS 126.

Source: 49 CFR 571.126 (FMVSS 126), S7.11.4 and S7.11.5; UN Regulation 140, 9.11.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.analysis.series import Array, timestep

FAST_RADPS: Final = math.radians(75.0)
"""Rate of the steering wheel at the end of the range [rad/s]."""
FAST_FOR_S: Final = 0.2
"""Least duration of this rate [s]."""
THRESHOLD_RAD: Final = math.radians(5.0)
"""Steering wheel angle whose first passing is the beginning of steer [rad]; the range ends before it."""
RANGE_S: Final = 1.0
"""Length of the range [s]."""
_AVERAGED_S: Final = 0.1
"""Window of the moving average of the rate [s]."""


def zeroing_range(time_s: Array, steering_rad: Array) -> slice:
    """Return the second before the steering wheel turns fast.

    Args:
        time_s: Time of the samples [s], equidistant, shape (n,).
        steering_rad: Filtered steering wheel angle [rad], shape (n,).

    Returns:
        Samples of the range, as far as the run has them; none if the wheel never turns faster than 75 deg/s for 200 ms.
    """
    step_s = timestep(time_s)
    width = max(1, round(_AVERAGED_S / step_s))
    rate = np.convolve(np.gradient(steering_rad, step_s), np.full(width, 1.0 / width), mode="same")
    fast = np.concatenate(([False], np.abs(rate) > FAST_RADPS, [False])).astype(np.int8)
    begins, ends = np.flatnonzero(np.diff(fast) > 0), np.flatnonzero(np.diff(fast) < 0)
    before = np.abs(steering_rad[begins] - steering_rad[0]) < THRESHOLD_RAD
    long = begins[before & (ends - begins >= FAST_FOR_S / step_s)]
    if long.size == 0:
        return slice(0, 0)
    end = int(long[0])
    return slice(max(0, end - round(RANGE_S / step_s)), end)


def offset(values: Array, samples: slice) -> float:
    """Return the mean of a signal over some samples; 0 for no samples.

    The signal must be unfiltered: a filter without phase rings before the steering wheel turns.
    """
    return float(np.mean(values[samples], dtype=np.float64)) if samples.stop > samples.start else 0.0

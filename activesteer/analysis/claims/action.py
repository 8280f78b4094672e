"""Actions of a system, apart from its responses to noise and offsets of its sensors.

A controller responds to noise too. Noise of an instant moves no car, and the offset of a sensor acts the same straight
ahead and in the manoeuvre. The recording itself therefore separates both from the response to the manoeuvre.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.analysis.series import Array, timestep
from activesteer.analysis.source import RecordingLike

MEAN_S: Final = 0.2
"""Time over which an angle is averaged [s]. A car begins to respond in this time: the compact's lateral acceleration is
at 90 % of its steady state 0.24 s after a step of the steering wheel. The noise of a production yaw rate sensor, 0.1
deg/s in samples of 10 ms, times the largest gain of the paper's controllers, 0.42 s, is 0.04 deg rms in an instant and
0.01 deg in this mean."""
AHEAD_RAD: Final = math.radians(1.0)
"""Steering wheel angle whose first passing ends the part straight ahead [rad]."""


def straight_ahead(recording: RecordingLike) -> slice:
    """Return the rows before the steering wheel is first turned; none if it is turned from the beginning."""
    turned = np.abs(recording["steering_wheel_rad"]) > AHEAD_RAD
    return slice(0, int(np.argmax(turned)) if turned.any() else len(turned))


def means(values: Array, timestep_s: float) -> Array:
    """Return the mean of a signal over `MEAN_S` around every sample, or over a shorter signal, shape (n,)."""
    width = min(len(values), max(1, round(MEAN_S / timestep_s)))
    if not width:
        return values
    return np.convolve(values, np.full(width, 1.0 / width), mode="same")


def largest_action(recording: RecordingLike, demand: str) -> float:
    """Return by how much more a system turns wheels in a manoeuvre than straight ahead before it [rad].

    Both are the largest magnitudes of the demanded angle's mean over `MEAN_S`.
    """
    step_s, values = timestep(recording.time_s), recording[demand]
    ahead = np.abs(means(values[straight_ahead(recording)], step_s))
    return float(np.abs(means(values, step_s)).max() - ahead.max(initial=0.0))


def mean_straight_ahead(recording: RecordingLike, channel: str) -> float:
    """Return the mean of a channel straight ahead, in its unit; 0 if no part of the run is straight ahead."""
    ahead = recording[channel][straight_ahead(recording)]
    return float(np.mean(ahead)) if len(ahead) else 0.0

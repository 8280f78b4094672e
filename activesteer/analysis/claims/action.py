"""What a system does for the car, apart from what the noise and the offsets of its sensors make it do.

A controller answers to noise too. Noise of an instant moves no car, and the offset of a sensor acts straight ahead as
it does in the manoeuvre: both can be told from what the system does about the manoeuvre, in the recording itself.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.analysis.series import Array, timestep
from activesteer.analysis.source import RecordingLike

MEAN_S: Final = 0.2
"""An angle counts as its mean over this time [s], in which a car begins to answer: the compact's lateral acceleration
is at 90 % of its steady state 0.24 s after a step of the steering wheel. What the controllers of the paper make of
the noise of a production yaw rate sensor, 0.1 deg/s in samples of 10 ms times 0.42 s at most, is 0.04 deg rms in an
instant, and 0.01 deg in this mean."""
AHEAD_RAD: Final = math.radians(1.0)
"""A car goes straight ahead until its steering wheel first passes this angle [rad]."""


def straight_ahead(recording: RecordingLike) -> slice:
    """The rows before the steering wheel is first turned; none where it is turned from the beginning."""
    turned = np.abs(recording["steering_wheel_rad"]) > AHEAD_RAD
    return slice(0, int(np.argmax(turned)) if turned.any() else len(turned))


def means(values: Array, timestep_s: float) -> Array:
    """A signal as its mean over `MEAN_S` around every sample, or over all of it where it is shorter; shape (n,)."""
    width = min(len(values), max(1, round(MEAN_S / timestep_s)))
    if not width:
        return values
    return np.convolve(values, np.full(width, 1.0 / width), mode="same")


def largest_action(recording: RecordingLike, demand: str) -> float:
    """By how much more a system turns wheels in a manoeuvre than straight ahead before it.

    Args:
        recording: The run.
        demand: Channel of the angle that it demands [rad].

    Returns:
        Largest magnitude of the angle's mean over `MEAN_S`, less the largest straight ahead [rad].
    """
    step_s, values = timestep(recording.time_s), recording[demand]
    ahead = np.abs(means(values[straight_ahead(recording)], step_s))
    return float(np.abs(means(values, step_s)).max() - ahead.max(initial=0.0))


def mean_straight_ahead(recording: RecordingLike, channel: str) -> float:
    """What a channel reads straight ahead, in its unit; 0 where no part of the run is."""
    ahead = recording[channel][straight_ahead(recording)]
    return float(np.mean(ahead)) if len(ahead) else 0.0

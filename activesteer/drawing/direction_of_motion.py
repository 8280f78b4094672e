"""Direction in which a car moves, for cameras: a car that slides then turns in the picture, and the road does not."""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.conventions import Array

SLOWEST_MPS: Final = 1.0
"""Speed below which the direction is kept [m/s]; that of a car at rest is not defined."""
_STEADY_S: Final = 0.35
"""Standard deviation of the window over which the direction is averaged [s]. The camera follows a bend, but no quick
motion, which therefore stays visible."""


def direction_of_motion(time_s: Array, places_m: Array, heading_rad: Array) -> Array:
    """Return the averaged direction of motion over the ground.

    Args:
        time_s: Instants [s], shape (k,).
        places_m: World x and y of the midpoint of the axles [m], shape (k, 2).
        heading_rad: Heading of the car [rad], shape (k,), for the time before it first moves.

    Returns:
        Continuous direction [rad], left positive, shape (k,).
    """
    if len(time_s) < 2:
        return np.unwrap(heading_rad)
    velocity = np.asarray(np.gradient(places_m, time_s, axis=0))
    moves = np.hypot(*velocity.T) > SLOWEST_MPS
    last = np.maximum.accumulate(np.where(moves, np.arange(len(time_s)), -1))
    direction = np.arctan2(velocity[:, 1], velocity[:, 0])[last]
    first = int(np.argmax(moves)) if moves.any() else len(time_s)
    direction[:first] = heading_rad[:first]
    return _smooth(time_s, np.unwrap(direction))


def _smooth(time_s: Array, values: Array) -> Array:
    """Return a moving average with Gaussian weights and no phase shift; the end values are continued at both ends."""
    step = float(np.median(np.diff(time_s)))
    reach = round(4.0 * _STEADY_S / step)
    offsets = np.arange(-reach, reach + 1) * step
    weights = np.exp(-0.5 * (offsets / _STEADY_S) ** 2)
    # Poses are evenly spaced except for gaps in a damaged file.
    even = np.arange(time_s[0] - reach * step, time_s[-1] + (reach + 1) * step, step)
    averaged = np.convolve(np.interp(even, time_s, values), weights / weights.sum(), mode="same")
    return np.asarray(np.interp(time_s, even, averaged), np.float64)

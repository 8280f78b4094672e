"""Cars in pictures: colours, transparent cars, and the direction in which a car moves."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array

_ASPHALT: Final = np.array((88.0, 90.0, 94.0))
_ABOVE: Final = np.array((228.0, 190.0, 120.0))
_BELOW: Final = np.array((40.0, 62.0, 120.0))


def bytes_of(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue of `#rrggbb`, 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def shares_of(colour: str) -> tuple[float, float, float]:
    """Return red, green and blue of `#rrggbb`, 0 to 1."""
    red, green, blue = bytes_of(colour)
    return red / 255.0, green / 255.0, blue / 255.0


def height_colours(heights_m: Array) -> NDArray[np.uint8]:
    """Return colours of heights, shape (n, 3): asphalt at 0, lighter and warmer above, darker and bluer below.

    The scale ends at the largest height, at least 20 mm.
    """
    share = heights_m / max(0.02, float(np.abs(heights_m).max(initial=0.0)))
    above, below = np.clip(share, 0.0, 1.0)[:, None], np.clip(-share, 0.0, 1.0)[:, None]
    colours = _ASPHALT + above * (_ABOVE - _ASPHALT) + below * (_BELOW - _ASPHALT)
    return np.round(colours).astype(np.uint8)


_HIDDEN_M: Final = 0.2
_SEEN_M: Final = 1.0


def share_seen(apart_m: Array | float) -> Array:
    """Return the fraction of a ghost's opacity: it fades between 1 m and 0.2 m from the car and vanishes below.

    Two surfaces in one place would show through each other in patches.
    """
    return np.clip((apart_m - _HIDDEN_M) / (_SEEN_M - _HIDDEN_M), 0.0, 1.0)


SLOWEST_MPS: Final = 1.0
"""Speed below which the direction is kept [m/s]. That of a car at rest is not defined."""
_STEADY_S: Final = 0.35
"""Standard deviation of the window over which the direction is averaged [s]. The camera follows a bend, but no quick
motion, which therefore stays visible."""


def direction_of_motion(time_s: Array, places_m: Array, heading_rad: Array) -> Array:
    """Return the averaged, continuous direction of motion over the ground [rad], left positive, shape (k,)."""
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
    """Return a moving average with Gaussian weights and no phase shift. The end values are continued at both ends."""
    step = float(np.median(np.diff(time_s)))
    reach = round(4.0 * _STEADY_S / step)
    offsets = np.arange(-reach, reach + 1) * step
    weights = np.exp(-0.5 * (offsets / _STEADY_S) ** 2)
    # Poses are evenly spaced except for gaps in a damaged file.
    even = np.arange(time_s[0] - reach * step, time_s[-1] + (reach + 1) * step, step)
    averaged = np.convolve(np.interp(even, time_s, values), weights / weights.sum(), mode="same")
    return np.asarray(np.interp(time_s, even, averaged), np.float64)

"""A loop of one signal over another, as in an on-centre weave test: gradient and dead bands.

Source: ISO 13674-1, Road vehicles - Test method for the quantification of on-centre handling - Weave test.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from activesteer.analysis.series import Array
from activesteer.errors import RecordingError

AROUND: Final = 0.2
"""Range of the gradient around zero, as a fraction of the largest abscissa."""


class Loop(NamedTuple):
    """Properties of a loop at its passages through zero, means of all periods.

    Attributes:
        gradient: Slope of the ordinate over the abscissa around abscissa zero, mean of both branches.
        ordinate_dead_band: Height of the loop at abscissa zero; positive if the ordinate lags behind the abscissa.
        abscissa_dead_band: Width of the loop at ordinate zero, with the same sign.
    """

    gradient: float
    ordinate_dead_band: float
    abscissa_dead_band: float


def loop(x: Array, y: Array) -> Loop:
    """Evaluate a loop.

    Args:
        x: Abscissa, which oscillates about zero, shape (n,).
        y: Ordinate, shape (n,).

    Raises:
        RecordingError: a signal does not pass through zero both upwards and downwards.
    """
    up, down = (crossings(x, y, rising=rising) for rising in (True, False))
    right, left = (crossings(y, x, rising=rising) for rising in (True, False))
    rate = np.gradient(x)
    near = np.abs(x) < AROUND * float(np.abs(x).max())
    slopes = [
        float(np.polynomial.Polynomial.fit(x[part], y[part], 1).convert().coef[1])
        for part in (near & (rate > 0.0), near & (rate < 0.0))
    ]
    return Loop(
        gradient=0.5 * sum(slopes),
        ordinate_dead_band=float(np.mean(down) - np.mean(up)),
        abscissa_dead_band=float(np.mean(right) - np.mean(left)),
    )


def crossings(x: Array, y: Array, *, rising: bool) -> Array:
    """Return the interpolated values of y where x passes through zero, upwards or downwards."""
    sign = 1.0 if rising else -1.0
    places = np.flatnonzero((sign * x[:-1] < 0.0) & (sign * x[1:] >= 0.0))
    if places.size == 0:
        raise RecordingError("the signals make no loop: one of them does not pass through zero")
    fraction = x[places] / (x[places] - x[places + 1])
    return y[places] + fraction * (y[places + 1] - y[places])


def slope_at_zero(x: Array, y: Array, within: float) -> float:
    """Return the slope of the line through the points near abscissa zero; nan for fewer than three points."""
    near = np.abs(x) <= within
    return float(np.polynomial.Polynomial.fit(x[near], y[near], 1).convert().coef[1]) if near.sum() > 2 else math.nan

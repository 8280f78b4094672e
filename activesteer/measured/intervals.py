"""What a fit knows of its parameters: intervals, correlations, and which of them cannot be told from the recordings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array

LEVEL: Final = 0.95
"""Probability with which an interval holds the value."""
_WINDOW: Final = 5.0
"""Autocorrelation is summed up to so many times the time that comes out (Sokal, 1997): further out is noise alone."""
_SAME: Final = 2e-3
"""Parameters of which a combination changes all differences by no more than this fraction of what they do by themselves
are the same to the recordings: their correlation is 0.999996, which differences of runs do not tell from 1."""
_IN_IT: Final = 0.2
"""Share from which on a parameter belongs to such a combination."""
_TOO_LITTLE: Final = 0.5
"""Effect of a parameter's whole range on all differences together, of the noise, below which nothing is known of it:
its standard deviation would be twice the range."""


class Intervals(NamedTuple):
    """What is known of the parameters, relative to their ranges.

    Attributes:
        half_widths: Half of each interval, shape (p,); nan for one that is not free.
        correlations: Of their errors, shape (p, p); nan likewise.
        independent: How many samples of each series count.
        freedom: Degrees of freedom of the t distribution; infinite where the noise is what is stated.
    """

    half_widths: Array
    correlations: Array
    independent: tuple[float, ...]
    freedom: float


def autocorrelation_time(values: Array) -> float:
    """How many neighbouring samples say as much as one that is independent of all others; 1 for white noise.

    One and twice the sum of the autocorrelations, as far as they are more than their own noise. The mean is not taken
    off: what stays on one side of zero is no noise.

    Args:
        values: Differences at equal distances, shape (n,).

    Returns:
        1 to n.

    Source: A. Sokal, Monte Carlo methods in statistical mechanics, 1997, eq. 3.19: a window of five times the result.
    """
    count = len(values)
    power = np.abs(np.fft.rfft(values, 2 * count)) ** 2
    covariance = np.fft.irfft(power)[:count]
    if covariance[0] <= 0.0:
        return 1.0
    times = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
    enough = np.arange(count) >= _WINDOW * times
    time = float(times[np.argmax(enough)]) if enough.any() else float(times.max())
    return min(max(time, 1.0), float(count))


def intervals(series: Sequence[Array], slopes: Sequence[Array], free: NDArray[np.bool_], *, stated: bool) -> Intervals:
    """Intervals of the parameters, in the linear neighbourhood of where they were found.

    Least squares weigh each series by its stated noise. Where this noise is not relied upon, each series has the
    variance of what is left in it, and its n samples count as n/tau, tau its autocorrelation time: exact where the
    derivatives change slowly against the noise, and too wide where they change as fast.

    Args:
        series: Differences that are left, relative to the noise, shape (n,) each.
        slopes: Their derivatives, shape (n, p) each.
        free: Which parameters are free, shape (p,); one at an end of its range is not.
        stated: Whether the noise is white and as large as stated.
    """
    from scipy.stats import t  # noqa: PLC0415 - slow to import

    count, parameters = sum(map(len, series)), int(np.count_nonzero(free))
    squares = [slope[:, free].T @ slope[:, free] for slope in slopes]
    inverse = np.linalg.pinv(sum(squares, np.zeros((parameters, parameters))), hermitian=True)
    if stated:
        covariance, independent, freedom = inverse, tuple(float(len(each)) for each in series), math.inf
    else:
        times = [autocorrelation_time(each) for each in series]
        lost = count / max(count - parameters, 1)
        spread = sum(
            (lost * float(np.mean(each**2)) * time * square
             for each, time, square in zip(series, times, squares, strict=True)),
            np.zeros((parameters, parameters)),
        )  # fmt: skip
        covariance = inverse @ spread @ inverse
        independent = tuple(len(each) / time for each, time in zip(series, times, strict=True))
        freedom = max(sum(independent) - parameters, 1.0)
    deviations = np.sqrt(np.diag(covariance))
    half_widths, correlations = np.full(len(free), np.nan), np.full((len(free), len(free)), np.nan)
    half_widths[free] = t.ppf(0.5 + 0.5 * LEVEL, freedom) * deviations
    correlations[np.ix_(free, free)] = covariance / np.outer(deviations, deviations)
    return Intervals(half_widths, correlations, independent, freedom)


def without_effect(slopes: Sequence[Array]) -> list[int]:
    """Parameters that change nothing, or less than the noise lets see."""
    return [int(place) for place in np.flatnonzero(_effects(slopes) < _TOO_LITTLE)]


def told_apart(slopes: Sequence[Array]) -> list[int]:
    """Parameters of which a combination changes nothing; empty where all of them can be told from each other."""
    _, sizes, combinations = np.linalg.svd(np.concatenate(slopes) / _effects(slopes), full_matrices=False)
    if sizes[-1] > _SAME:
        return []
    return [int(place) for place in np.flatnonzero(np.abs(combinations[-1]) > _IN_IT)]


def _effects(slopes: Sequence[Array]) -> Array:
    return np.linalg.norm(np.concatenate(slopes), axis=0)

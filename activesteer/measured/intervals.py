"""Uncertainty of a fit: intervals, correlations, and parameters that the recordings cannot separate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array

LEVEL: Final = 0.95
"""Probability that an interval contains the true value."""
_WINDOW: Final = 5.0
"""The autocorrelation is summed over this multiple of the resulting time (Sokal, 1997); beyond, it is noise."""
_SAME: Final = 2e-3
"""Parameters are the same to the recordings if a combination of them changes all differences by at most this fraction
of their single effects. Their correlation is then 0.999996, which differences of runs cannot distinguish from 1."""
_IN_IT: Final = 0.2
"""Proportion from which a parameter belongs to such a combination."""
_TOO_LITTLE: Final = 0.5
"""Smallest effect of a parameter's whole range on all differences together, relative to the noise. With less, the
standard deviation would be twice the range."""


class Intervals(NamedTuple):
    """Uncertainty of the parameters, relative to their ranges.

    Attributes:
        half_widths: Half of each interval, shape (p,); nan for a parameter at an end of its range.
        correlations: Correlations of the errors, shape (p, p); nan likewise.
        independent: Number of independent samples of each series.
        freedom: Degrees of freedom of the t distribution; infinite for stated noise.
    """

    half_widths: Array
    correlations: Array
    independent: tuple[float, ...]
    freedom: float


def autocorrelation_time(values: Array) -> float:
    """Return the number of neighbouring samples that are worth one independent sample; 1 for white noise.

    The time is one plus twice the sum of the autocorrelations, as far as these exceed their own noise. The mean is not
    subtracted: an offset is no noise.

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
    """Return intervals of the parameters, in the linear neighbourhood of the solution.

    Least squares weights each series by its stated noise. If this noise is not trusted, each series gets the variance
    of its residual, and its n samples count as n/tau, with tau its autocorrelation time. The result is exact if the
    derivatives change slowly compared with the noise, and too wide if they change as fast.

    Args:
        series: Residuals relative to the noise, shape (n,) each.
        slopes: Their derivatives, shape (n, p) each.
        free: Which parameters are free, shape (p,); a parameter at an end of its range is not.
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
    """Return the parameters whose effect is zero or below the noise."""
    return [int(place) for place in np.flatnonzero(_effects(slopes) < _TOO_LITTLE)]


def told_apart(slopes: Sequence[Array]) -> list[int]:
    """Return parameters of which a combination has no effect; empty if all can be separated."""
    _, sizes, combinations = np.linalg.svd(np.concatenate(slopes) / _effects(slopes), full_matrices=False)
    if sizes[-1] > _SAME:
        return []
    return [int(place) for place in np.flatnonzero(np.abs(combinations[-1]) > _IN_IT)]


def _effects(slopes: Sequence[Array]) -> Array:
    return np.linalg.norm(np.concatenate(slopes), axis=0)

"""Result of a fit: intervals of its parameters, and warnings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.series import rms
from activesteer.core.conventions import Array
from activesteer.core.units import quantity_of
from activesteer.maneuver.open_loop import SensorOffsetTable

LEVEL: Final = 0.95
"""Probability that an interval contains the true value."""
_WINDOW: Final = 5.0
"""The autocorrelation is summed over this multiple of the resulting time (Sokal, 1997). Beyond, it is noise."""
_SAME: Final = 2e-3
"""Limit for parameters that the recordings cannot tell apart: a combination of them changes all differences by at most
this fraction of their single effects. Their correlation is then 0.999996, which differences of runs cannot distinguish
from 1."""
_IN_IT: Final = 0.2
"""Proportion from which a parameter counts as a part of such a combination."""
_TOO_LITTLE: Final = 0.5
"""Smallest effect of a parameter's whole range on all differences together, relative to the noise. With less, the
standard deviation would be twice the range."""


def autocorrelation_time(values: Array) -> float:
    """Return the autocorrelation time in samples, 1 for white noise.

    The time is one plus twice the sum of the autocorrelations, as far as these exceed their own noise. The mean is not
    subtracted, because an offset is not noise.

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


def intervals(
    series: Sequence[Array], slopes: Sequence[Array], free: NDArray[np.bool_], *, stated: bool
) -> tuple[Array, Array, tuple[float, ...], float]:
    """Return the uncertainty of the parameters relative to their ranges, linearised at the solution.

    Returns:
        Half of each interval, shape (p,), and correlations of the errors, shape (p, p), both nan for a parameter at an
        end of its range; independent samples of each series; degrees of freedom of the t distribution, infinite for
        stated noise.
    """
    # Least squares weights each series by its stated noise. If this noise is not trusted, each series gets the variance
    # of its residual, and its n samples count as n/tau, with tau its autocorrelation time. The result is exact if the
    # derivatives change slowly compared with the noise, and too wide if they change as fast.
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
    return half_widths, correlations, independent, freedom


def without_effect(slopes: Sequence[Array]) -> list[int]:
    """Return the parameters whose effect is zero or below the noise."""
    return [int(place) for place in np.flatnonzero(_effects(slopes) < _TOO_LITTLE)]


def indistinguishable(slopes: Sequence[Array]) -> list[int]:
    """Return the parameters whose effects cannot be distinguished, empty if there are none."""
    _, sizes, combinations = np.linalg.svd(np.concatenate(slopes) / _effects(slopes), full_matrices=False)
    if sizes[-1] > _SAME:
        return []
    return [int(place) for place in np.flatnonzero(np.abs(combinations[-1]) > _IN_IT)]


def _effects(slopes: Sequence[Array]) -> Array:
    return np.linalg.norm(np.concatenate(slopes), axis=0)


_ALIKE: Final = 0.95
"""Correlation of two parameters above which a note is given."""
_MUCH: Final = 1.5
"""Residual of a channel relative to its noise above which the car does not explain the channel."""
_CONSTANT: Final = 0.8
"""Fraction of the mean square of a residual from which its mean counts as a constant offset."""
_HANGS: Final = 5.0
"""Number of samples per independent sample above which a note is given. Filtered noise of a test vehicle, about 20 Hz,
has 2 at 100 Hz."""


class Parameter(NamedTuple):
    """Factor with its fitted value."""

    key: str  # key of the factor
    value: float  # value in the unit of the key; relative if the factor is relative
    half_width: float  # half of the 95 % interval; nan at an end of the range
    start: float  # start of the search
    low: float  # lower end of the range
    high: float  # upper end of the range

    @property
    def at_end(self) -> bool:
        """True if the value is at an end of its range. It then has no interval."""
        return math.isnan(self.half_width)

    @property
    def words(self) -> str:
        """Value and half width, rounded to the significant digits of the half width."""
        if self.at_end or self.half_width <= 0.0:
            return f"{self.value:.5g}"
        digits = max(0, 1 - math.floor(math.log10(self.half_width)))
        return f"{self.value:.{digits}f} +- {self.half_width:.{digits}f}"

    def to_json(self) -> dict[str, Any]:
        """Return the parameter as JSON values."""
        low, high = self.value - self.half_width, self.value + self.half_width
        return {"value": self.value, "low": low, "high": high, "start": self.start, "range": [self.low, self.high],
                "at_end": self.at_end}  # fmt: skip


class Compared(NamedTuple):
    """Channel of a recording compared with the runs."""

    recording: str  # name of the recording
    channel: str  # name of the channel
    noise: float  # stated standard deviation of its noise, SI
    time_s: Array  # times of the recording [s], shape (n,)
    measured: Array  # measured values, SI, shape (n,)
    before: Array  # simulated minus measured values at the start of the search, relative to the noise, shape (n,)
    after: Array  # the same at its end
    independent: float  # number of independent samples

    def to_json(self) -> dict[str, Any]:
        """Return the compared channel as JSON values, SI."""
        return {
            "recording": self.recording,
            "channel": self.channel,
            "noise": self.noise,
            "rms_before": self.noise * rms(self.before),
            "rms": self.noise * rms(self.after),
            "samples": len(self.measured),
            "independent_samples": self.independent,
        }


class Fit(NamedTuple):
    """Result of a fit: parameters, their uncertainty, and the compared channels."""

    parameters: tuple[Parameter, ...]  # fitted factors
    correlations: Array  # correlations of the parameters' errors, shape (p, p); nan at an end of a range
    compared: tuple[Compared, ...]  # all channels of all recordings
    basis: str  # basis of the intervals: `residuals` or `noise`
    freedom: float  # degrees of freedom of the t distribution; infinite with `noise`
    misfit: float  # rms of the residuals relative to the noise; 1 if the car explains everything but the noise
    rounds: int  # number of parameter sets tried, each with its derivatives
    runs: int  # number of runs
    settled: bool  # whether the search converged
    overrides: dict[str, Any]  # key -> value that drives the fitted car in every recording
    own: dict[str, dict[str, Any]]  # recording -> additional values for that recording

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings about the fit, one sentence each."""
        found = []
        if not self.settled:
            found.append(f"the search did not converge in {self.rounds} rounds; restart it from its end (fit.start)")
        for one in self.parameters:
            if one.at_end:
                found.append(
                    f"{one.key} is at an end of its range, {one.value:.5g}: it has no interval, and the other "
                    "intervals hold for this value"
                )
            elif 2.0 * one.half_width > one.high - one.low:
                found.append(f"{one.key} is almost unknown: its interval is wider than its range")
        lower = np.tril(np.nan_to_num(self.correlations), -1)
        for place in sorted(np.argwhere(np.abs(lower) >= _ALIKE).tolist(), key=lambda place: -abs(lower[*place])):
            one, other = (self.parameters[each].key for each in place)
            correlation = f"the correlation of their errors is {lower[*place]:.3f}"
            found.append(f"{one} and {other} can hardly be separated: {correlation}")
        for each in self.compared:
            left = rms(each.after)
            shown = quantity_of(each.channel)
            where, mean = f"{shown.label} in {each.recording}", float(np.mean(each.after))
            if left > _MUCH and mean**2 > _CONSTANT * left**2:
                offset = f"{-each.noise * mean * shown.unit.factor:.3g} {shown.unit.name}"
                advice = f"set zero_until_s of {each.channel} in the map"
                if each.channel in SensorOffsetTable.__dataclass_fields__:
                    advice += f", or make sensor_offset.{each.channel.replace('_rad', '_deg')} a factor"
                found.append(
                    f"the residual of the {where} is a constant offset: measured minus simulated is {offset}; {advice}"
                )
            elif left > _MUCH:
                found.append(
                    f"the residual of the {where} is {left:.1f} times its noise: car or inputs differ, and errors may "
                    "exceed the intervals"
                )
            elif left < 1.0 / _MUCH:
                found.append(f"the residual of the {where} is {left:.2g} of the stated noise, which is too large")
            elif len(each.after) > _HANGS * each.independent:
                found.append(
                    f"the residual of the {where} is not white: {len(each.after)} samples count as "
                    f"{each.independent:.0f}; car or inputs differ, or the noise is filtered"
                )
        return tuple(found)

    def to_json(self) -> dict[str, Any]:
        """Return the fit as JSON values."""
        return {
            "parameters": {one.key: one.to_json() for one in self.parameters},
            "correlations": self.correlations.tolist(),
            "channels": [each.to_json() for each in self.compared],
            "intervals": {"level": LEVEL, "basis": self.basis, "degrees_of_freedom": self.freedom},
            "misfit": self.misfit,
            "rounds": self.rounds,
            "runs": self.runs,
            "settled": self.settled,
            "overrides": self.overrides,
            "own_overrides": self.own,
            "notes": list(self.notes),
        }


def rests_on(found: Fit) -> list[str]:
    """Return the meaning and the limits of the intervals, one sentence each."""
    if found.basis == "noise":
        lines = ["The intervals rest on the stated noise: white, normal, and independent in every channel."]
    else:
        lines = [
            "The intervals rest on the residuals of every channel: their variance, and their number of independent "
            f"samples by autocorrelation (t distribution, {found.freedom:.0f} degrees of freedom)."
        ]
    return [
        *lines,
        "They are 95 % intervals of individual parameters, from the derivatives at the end of the search.",
        "The inputs are used as recorded: the intervals contain neither noise and offsets of steering and speed, nor "
        "errors of the model of the car.",
    ]

"""Result of a fit: parameters with intervals, residuals, and warnings."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

from activesteer.analysis.series import rms
from activesteer.conventions import Array
from activesteer.measured.intervals import LEVEL
from activesteer.units import quantity_of

_ALIKE: Final = 0.95
"""Correlation of two parameters above which a note is given."""
_MUCH: Final = 1.5
"""Residual of a channel relative to its noise above which the car does not explain the channel."""
_HANGS: Final = 5.0
"""Number of samples per independent sample above which a note is given. Filtered noise of a test vehicle, about 20 Hz,
has 2 at 100 Hz."""


class Parameter(NamedTuple):
    """Factor with its fitted value.

    Attributes:
        key: Key of the factor.
        value: Value in the unit of the key; relative if the factor is relative.
        half_width: Half of the 95 % interval; nan at an end of the range.
        start: Start of the search.
        low: Lower end of the range.
        high: Upper end of the range.
    """

    key: str
    value: float
    half_width: float
    start: float
    low: float
    high: float

    @property
    def at_end(self) -> bool:
        """True if the value is at an end of its range, and so has no interval."""
        return math.isnan(self.half_width)

    @property
    def words(self) -> str:
        """Value and half width, with the significant digits of the latter."""
        if self.at_end or self.half_width <= 0.0:
            return f"{self.value:.5g}"
        digits = max(0, 1 - math.floor(math.log10(self.half_width)))
        return f"{self.value:.{digits}f} +- {self.half_width:.{digits}f}"

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        low, high = self.value - self.half_width, self.value + self.half_width
        return {"value": self.value, "low": low, "high": high, "start": self.start, "range": [self.low, self.high],
                "at_end": self.at_end}  # fmt: skip


class Compared(NamedTuple):
    """Channel of a recording compared with the runs.

    Attributes:
        recording: Name of the recording.
        channel: Name of the channel.
        noise: Stated standard deviation of its noise, SI.
        time_s: Times of the recording [s], shape (n,).
        measured: Measured values, SI, shape (n,).
        before: Simulated minus measured values at the start of the search, relative to the noise, shape (n,).
        after: The same at its end.
        independent: Number of independent samples.
    """

    recording: str
    channel: str
    noise: float
    time_s: Array
    measured: Array
    before: Array
    after: Array
    independent: float

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, SI."""
        return {
            "recording": self.recording,
            "channel": self.channel,
            "noise": self.noise,
            "rms_before": self.noise * rms(self.before),
            "rms": self.noise * rms(self.after),
            "samples": len(self.measured),
            "independent_samples": self.independent,
        }

    def words(self) -> tuple[str, ...]:
        """Return recording, channel, noise, rms before and after, numbers of all and of independent samples."""
        shown = quantity_of(self.channel)
        sizes = (self.noise, self.noise * rms(self.before), self.noise * rms(self.after))
        return (
            self.recording, shown.label, *(f"{shown.factor * size:.3g} {shown.unit.name}" for size in sizes),
            f"{len(self.measured)}", f"{self.independent:.0f}",
        )  # fmt: skip


class Fit(NamedTuple):
    """Result of a fit.

    Attributes:
        parameters: Fitted factors.
        correlations: Correlations of the parameters' errors, shape (p, p); nan at an end of a range.
        compared: All channels of all recordings.
        basis: Basis of the intervals: `residuals` or `noise`.
        freedom: Degrees of freedom of the t distribution; infinite with `noise`.
        misfit: Rms of the residuals relative to the noise; 1 if the car explains everything but the noise.
        rounds: Number of parameter sets tried, each with its derivatives.
        runs: Number of runs.
        settled: Whether the search converged.
        overrides: Key -> value that drives the fitted car in every recording.
        own: Recording -> additional values for that recording.
        notes: Warnings, one sentence each.
    """

    parameters: tuple[Parameter, ...]
    correlations: Array
    compared: tuple[Compared, ...]
    basis: str
    freedom: float
    misfit: float
    rounds: int
    runs: int
    settled: bool
    overrides: dict[str, Any]
    own: dict[str, dict[str, Any]]
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
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

    def pairs(self, least: float) -> list[tuple[str, str, float]]:
        """Return pairs of parameters with at least this correlation of their errors; the largest first."""
        keys = [one.key for one in self.parameters]
        found = [
            (one, other, float(self.correlations[row, column]))
            for row, one in enumerate(keys)
            for column, other in enumerate(keys[:row])
            if abs(self.correlations[row, column]) >= least
        ]
        return sorted(found, key=lambda pair: -abs(pair[2]))


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
        "They are 95 % intervals of single parameters, from the derivatives at the end of the search.",
        "The inputs are used as recorded: the intervals contain neither noise and offsets of steering and speed, nor "
        "errors of the model of the car.",
    ]


def notes_of(found: Fit) -> tuple[str, ...]:
    """Return warnings, one sentence each."""
    notes = []
    if not found.settled:
        notes.append(f"the search did not converge in {found.rounds} rounds; restart it from its end (fit.start)")
    for one in found.parameters:
        if one.at_end:
            notes.append(
                f"{one.key} is at an end of its range, {one.value:.5g}: it has no interval, and the other intervals "
                "hold for this value"
            )
        elif 2.0 * one.half_width > one.high - one.low:
            notes.append(f"{one.key} is almost unknown: its interval is wider than its range")
    notes += [
        f"{one} and {other} can hardly be separated: the correlation of their errors is {value:.3f}"
        for one, other, value in found.pairs(_ALIKE)
    ]
    for each in found.compared:
        left = rms(each.after)
        where = f"{quantity_of(each.channel).label} in {each.recording}"
        if left > _MUCH:
            notes.append(
                f"the residual of the {where} is {left:.1f} times its noise: car or inputs differ, and errors may "
                "exceed the intervals"
            )
        elif left < 1.0 / _MUCH:
            notes.append(f"the residual of the {where} is {left:.2g} of the stated noise, which is too large")
        elif len(each.after) > _HANGS * each.independent:
            notes.append(
                f"the residual of the {where} is not white: {len(each.after)} samples count as {each.independent:.0f}; "
                "car or inputs differ, or the noise is filtered"
            )
    return tuple(notes)

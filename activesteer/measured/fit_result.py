"""What came of a fit: parameters with their intervals, what is left of the differences, and what to think of it."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

from activesteer.analysis.series import rms
from activesteer.conventions import Array
from activesteer.measured.intervals import LEVEL
from activesteer.quantities import quantity_of

_ALIKE: Final = 0.95
"""Correlation of two parameters from which on it is said."""
_MUCH: Final = 1.5
"""What is left of a channel, relative to its noise, from which on the car does not explain it."""
_HANGS: Final = 5.0
"""How many samples may count as one before it is said; noise behind a filter of a test vehicle, some 20 Hz, has 2 at
100 Hz."""


class Parameter(NamedTuple):
    """A factor as it was found.

    Attributes:
        key: Its key.
        value: Its value, in the unit of the key; relative where the factor is.
        half_width: Half of its 95 % interval; nan where it is at an end of its range.
        start: Where the search began.
        low: Lower end of its range.
        high: Upper end.
    """

    key: str
    value: float
    half_width: float
    start: float
    low: float
    high: float

    @property
    def at_end(self) -> bool:
        """Whether it is at an end of its range, so that it has no interval."""
        return math.isnan(self.half_width)

    @property
    def words(self) -> str:
        """Value and half width with as many digits as the latter has a meaning for."""
        if self.at_end or self.half_width <= 0.0:
            return f"{self.value:.5g}"
        digits = max(0, 1 - math.floor(math.log10(self.half_width)))
        return f"{self.value:.{digits}f} +- {self.half_width:.{digits}f}"

    def to_json(self) -> dict[str, Any]:
        """As in the JSON output."""
        low, high = self.value - self.half_width, self.value + self.half_width
        return {"value": self.value, "low": low, "high": high, "start": self.start, "range": [self.low, self.high],
                "at_end": self.at_end}  # fmt: skip


class Compared(NamedTuple):
    """A channel of a recording beside the runs.

    Attributes:
        recording: Name of the recording.
        channel: Name of the channel.
        noise: Standard deviation of its noise as stated, SI.
        time_s: Instants of the recording [s], shape (n,).
        measured: What was measured, SI, shape (n,).
        before: Simulated less measured where the search began, relative to the noise, shape (n,).
        after: Likewise where it ended.
        independent: How many of the n samples count for the intervals.
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
        """As in the JSON output, SI."""
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
        """Recording, quantity, stated noise, rms before and after, samples and how many count, as they are printed."""
        shown = quantity_of(self.channel)
        sizes = (self.noise, self.noise * rms(self.before), self.noise * rms(self.after))
        return (
            self.recording, shown.label, *(f"{shown.factor * size:.3g} {shown.unit.name}" for size in sizes),
            f"{len(self.measured)}", f"{self.independent:.0f}",
        )  # fmt: skip


class Fit(NamedTuple):
    """What came out.

    Attributes:
        parameters: What was looked for.
        correlations: Of the parameters' errors, shape (p, p); nan for one at an end of its range.
        compared: Every channel of every recording.
        basis: What the intervals rest on: `residuals` or `noise`.
        freedom: Degrees of freedom of the t distribution; infinite with `noise`.
        misfit: Rms of what is left, relative to the noise; 1 where the car explains all but the noise.
        rounds: How many sets of parameters were tried, each with its derivatives.
        runs: How many runs were driven.
        settled: Whether the search ended because nothing moved any more.
        overrides: Key -> value with which the car is driven as found, in every recording.
        own: Recording -> what is besides for that recording alone.
        notes: What is to be said of it, one sentence each.
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
        """As in the JSON output."""
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
        """Two parameters and the correlation of their errors, where it is at least that large; the largest first."""
        keys = [one.key for one in self.parameters]
        found = [
            (one, other, float(self.correlations[row, column]))
            for row, one in enumerate(keys)
            for column, other in enumerate(keys[:row])
            if abs(self.correlations[row, column]) >= least
        ]
        return sorted(found, key=lambda pair: -abs(pair[2]))


def rests_on(found: Fit) -> list[str]:
    """What the intervals mean, and what they do not, one sentence each."""
    if found.basis == "noise":
        lines = ["The intervals rest on the noise as stated: white, independent in every channel, normal."]
    else:
        lines = [
            "The intervals rest on what is left of every channel: on its variance, and on as many independent samples "
            f"as its autocorrelation leaves (t distribution, {found.freedom:.0f} degrees of freedom)."
        ]
    return [
        *lines,
        "They are 95 % intervals of each parameter by itself, from the derivatives where the search ended.",
        "The inputs are taken as they were recorded: noise and offsets of steering and speed are in no interval, and "
        "neither is what the model of the car cannot do.",
    ]


def notes_of(found: Fit) -> tuple[str, ...]:
    """What looks wrong, one sentence each."""
    notes = []
    if not found.settled:
        notes.append(f"the search did not settle in {found.rounds} rounds; begin it where it ended (fit.start)")
    for one in found.parameters:
        if one.at_end:
            notes.append(
                f"{one.key} is at an end of its range, {one.value:.5g}: it has no interval, and those of the others "
                "hold for this value"
            )
        elif 2.0 * one.half_width > one.high - one.low:
            notes.append(f"{one.key} is hardly known: its interval is wider than its range")
    notes += [
        f"{one} and {other} are hardly told apart: the correlation of their errors is {value:.3f}"
        for one, other, value in found.pairs(_ALIKE)
    ]
    for each in found.compared:
        left = rms(each.after)
        where = f"{quantity_of(each.channel).label} in {each.recording}"
        if left > _MUCH:
            notes.append(
                f"what is left of the {where} is {left:.1f} times its noise: car or inputs are otherwise, and values "
                "may be wrong by more than their intervals"
            )
        elif left < 1.0 / _MUCH:
            notes.append(f"what is left of the {where} is {left:.2g} of the stated noise, which is too large")
        elif len(each.after) > _HANGS * each.independent:
            notes.append(
                f"what is left of the {where} is no noise, {len(each.after)} samples count as {each.independent:.0f}: "
                "car or inputs are otherwise, or the noise is filtered"
            )
    return tuple(notes)

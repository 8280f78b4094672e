"""Comparison of runs with the reference: steady state, peaks and their times, difference over the whole run.

The tolerances were agreed for this comparison. The method, corridors around the reference in time and amplitude, is
that of ISO 19364 (steady-state circular driving) and ISO 19365 (sine with dwell).
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from activesteer.analysis.lanes import TIME_TOLERANCE_S, corridor
from activesteer.core.conventions import Array
from tests.reference.chrono.comparison import Comparison, absolute, relative
from tests.reference.chrono.reference import Table

STEADY_TOLERANCE: Final = 0.02
PEAK_TOLERANCE: Final = 0.05
RMS_TOLERANCE: Final = 0.02
LOAD_TOLERANCE: Final = 0.01
SPEED_TOLERANCE: Final = 0.005
_STEADY_S: Final = 0.5
"""Final interval of a run that counts as its steady state [s]."""
_STEADY_CHANGE: Final = 0.01
"""A quantity is steady if it changes by less than this fraction of its range in that interval."""


class Quantity(NamedTuple):
    """A compared column.

    Attributes:
        column: Its name in the reference.
        word: Its name in the comparisons.
        unit: Its unit.
        min_range: Least range, in the unit; a run with a smaller range is not compared in this column.
    """

    column: str
    word: str
    unit: str
    min_range: float


QUANTITIES: Final = (
    Quantity("r", "yaw_rate", "rad/s", 0.01),
    Quantity("ay", "lateral_acceleration", "m/s2", 0.2),
    Quantity("roll", "roll", "rad", 1e-3),
    Quantity("beta", "sideslip", "rad", 1e-3),
)
"""The quantities with agreed tolerances."""
_WHEELS: Final = ("FL", "FR", "RL", "RR")
_PITCH: Final = Quantity("pitch", "pitch", "rad", 2e-3)
_DECELERATION: Final = Quantity("ax", "longitudinal_acceleration", "m/s2", 0.5)


class Trace(NamedTuple):
    """A quantity of one run, ours and the reference at the same instants.

    Attributes:
        quantity: The quantity.
        time_s: Instants.
        ours: Our values.
        reference: Values of the reference.
    """

    quantity: Quantity
    time_s: Array
    ours: Array
    reference: Array

    @property
    def span(self) -> float:
        """Peak to peak of the reference."""
        return float(np.ptp(self.reference))

    def corridor(self) -> tuple[Array, Array]:
        """Return lower and upper edge of the corridor: 20 ms in time and 2 % of peak to peak around the reference."""
        return corridor(self.time_s, self.reference, RMS_TOLERANCE * self.span)


def traces(ours: Table, reference: Table, quantities: tuple[Quantity, ...] = QUANTITIES) -> list[Trace]:
    """Return our values at the instants of the reference."""
    t = reference["t"]
    t = t[t <= ours["t"][-1]]
    return [
        Trace(quantity, t, np.interp(t, ours["t"], ours[quantity.column]), reference[quantity.column][: len(t)])
        for quantity in quantities
    ]


def compare_run(run: str, ours: Table, reference: Table) -> list[Comparison]:
    """Compare a run with the reference.

    Args:
        run: Name of the run.
        ours: Our columns; see `reference_columns`.
        reference: Columns of the reference; its part after the end of our run is not used.

    Returns:
        The comparisons.
    """
    together = reference["t"] <= ours["t"][-1]
    reference = {column: values[together] for column, values in reference.items()}
    rows: list[Comparison] = []
    for trace in traces(ours, reference, (*QUANTITIES, _PITCH, _DECELERATION)):
        if trace.span >= trace.quantity.min_range:
            rows += _compare(run, trace)
    end = reference["t"] >= reference["t"][-1] - _STEADY_S
    t = reference["t"][end]

    def mean(column: str) -> tuple[float, float]:
        return float(np.interp(t, ours["t"], ours[column]).mean()), float(reference[column][end].mean())

    rows.append(relative(run, "speed_at_the_end", "m/s", *mean("vx"), SPEED_TOLERANCE))
    rows += [
        relative(run, f"{wheel.lower()}_load_at_the_end", "N", *mean(f"Fz_{wheel}"), LOAD_TOLERANCE)
        for wheel in _WHEELS
    ]
    return rows


def _compare(run: str, trace: Trace) -> list[Comparison]:
    quantity, t = trace.quantity, trace.time_s
    rows = []
    end = t >= t[-1] - _STEADY_S
    steady = [float(values[end].mean()) for values in (trace.ours, trace.reference)]
    drift = np.ptp(trace.reference[end])
    is_steady = drift < _STEADY_CHANGE * trace.span and abs(steady[1]) > 0.1 * trace.span
    if is_steady:
        rows.append(relative(run, f"{quantity.word}_steady", quantity.unit, steady[0], steady[1], STEADY_TOLERANCE))
    base = steady[1] if is_steady else 0.0
    for word, sign in (("highest", 1.0), ("lowest", -1.0)):
        theirs = _peak(t, sign * trace.reference)
        # A value at the end of the run or before the input is not a peak.
        if theirs is None or sign * base + 0.02 * trace.span > theirs[1] or theirs[1] < 0.1 * trace.span:
            continue
        ours = _peak(t, sign * trace.ours)
        if ours is None:
            ours = (math.nan, math.nan)
        rows.append(
            relative(run, f"{quantity.word}_{word}", quantity.unit, sign * ours[1], sign * theirs[1], PEAK_TOLERANCE)
        )
        rows.append(absolute(run, f"{quantity.word}_{word}_time", "s", ours[0], theirs[0], TIME_TOLERANCE_S))
    return [*rows, compare_rms(run, quantity.word, quantity.unit, t, trace.ours, trace.reference)]


def compare_rms(
    run: str, word: str, unit: str, time_s: Array, ours: Array, reference: Array, limit: float | None = None
) -> Comparison:
    """Compare the rms of the difference with `RMS_TOLERANCE` of peak to peak, or with an absolute limit."""
    error = ours - reference
    rms = math.sqrt(float(np.trapezoid(error**2, time_s)) / float(time_s[-1] - time_s[0]))
    worst = int(np.abs(error).argmax())
    at = float(ours[worst]), float(reference[worst])
    if limit is not None:
        return Comparison(run, f"{word}_rms", unit, *at, rms, limit)
    span = float(np.ptp(reference))
    return Comparison(run, f"{word}_rms_of_peak_to_peak", unit, *at, rms / span, RMS_TOLERANCE, "relative")


def _peak(t: Array, values: Array) -> tuple[float, float] | None:
    """Return time and height of the peak by a parabola through its neighbours; None if it is at an end."""
    index = int(values.argmax())
    if index in (0, len(values) - 1):
        return None
    around = slice(index - 1, index + 2)
    a, b, c = np.polyfit(t[around] - t[index], values[around], 2)
    if a >= 0.0:
        return float(t[index]), float(values[index])
    shift = float(np.clip(-b / (2.0 * a), t[index - 1] - t[index], t[index + 1] - t[index]))
    return float(t[index]) + shift, float(c + shift * (b + shift * a))

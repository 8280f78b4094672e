"""Time shift between a measured and a simulated run, whose clocks start at different instants."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from activesteer.conventions import Array
from activesteer.recording import Recording

INPUTS: Final = ("steering_wheel_rad", "rack_m")
"""Channels that align the clocks if both runs have them: the response of another car may lag, its input may not."""
RESPONSES: Final = ("yaw_rate_radps", "ay_mps2", "roll_rad", "sideslip_rad")
_STEP_S: Final = 0.01
"""Step of the search [s]; the result is found between its instants."""
_NEARLY: Final = 0.01
"""Among shifts this close to the best correlation, such as all periods of a sine, the shortest one is taken."""


def time_shift(measured: Recording, simulated: Recording) -> float:
    """Return the delay of the measured run [s]: measured(t) is simulated(t - shift).

    The search maximises the normalised cross-correlation over all shifts at which the runs overlap by half of the
    shorter run. Between the steps of the search, the mean square of the difference is minimised.

    Returns:
        The shift [s]; nan if no signal moves in both runs.
    """
    pairs = _pairs(measured, simulated, INPUTS) or _pairs(measured, simulated, RESPONSES)
    if not pairs:
        return math.nan
    own_s, other_s = (np.arange(time_s[0], time_s[-1], _STEP_S) for time_s in (measured.time_s, simulated.time_s))
    shortest = min(len(own_s), len(other_s))
    if shortest < 4:
        return math.nan
    alike = _alike(
        [(np.interp(own_s, measured.time_s, one), np.interp(other_s, simulated.time_s, other)) for one, other in pairs],
        shortest // 2,
    )
    tops = np.flatnonzero((alike[1:-1] >= alike[:-2]) & (alike[1:-1] > alike[2:])) + 1
    if not len(tops):
        return math.nan
    shifts = (np.arange(len(alike)) - (len(other_s) - 1)) * _STEP_S + own_s[0] - other_s[0]
    best = tops[alike[tops] > alike[tops].max() - _NEARLY]
    coarse = float(shifts[best[np.argmin(np.abs(shifts[best]))]])
    return _refined(coarse, measured.time_s, simulated.time_s, pairs)


def _pairs(measured: Recording, simulated: Recording, names: tuple[str, ...]) -> list[tuple[Array, Array]]:
    """Return signals of both runs, each without the mean of the simulation and relative to its range."""
    pairs = []
    for name in names:
        if name not in measured or name not in simulated:
            continue
        one, other = (np.asarray(run[name], np.float64) for run in (measured, simulated))
        size, mean = float(other.std()), float(other.mean())
        if size > 1e-9 and float(one.std()) > 1e-9:
            pairs.append(((one - mean) / size, (other - mean) / size))
    return pairs


def _alike(pairs: list[tuple[Array, Array]], least: int) -> Array:
    """Return the normalised cross-correlation over all shifts; -1 where fewer than `least` samples overlap."""
    from scipy.signal import correlate  # noqa: PLC0415 - slow to import

    product, first, second = 0.0, 0.0, 0.0
    for one, other in pairs:
        product = product + correlate(one, other, method="fft")
        first = first + correlate(one**2, np.ones_like(other), method="fft")
        second = second + correlate(np.ones_like(one), other**2, method="fft")
    overlap = correlate(np.ones_like(pairs[0][0]), np.ones_like(pairs[0][1]), method="fft")
    size = np.sqrt(np.maximum(first, 1e-9) * np.maximum(second, 1e-9))
    return np.where(overlap > least - 0.5, product / size, -1.0)


def _refined(coarse_s: float, own_s: Array, other_s: Array, pairs: list[tuple[Array, Array]]) -> float:
    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - slow to import

    # The same samples at every shift, so that their number does not matter.
    kept = (own_s - coarse_s >= other_s[0] + _STEP_S) & (own_s - coarse_s <= other_s[-1] - _STEP_S)

    def difference(shift_s: float) -> float:
        return sum(
            float(np.mean((one[kept] - np.interp(own_s[kept] - shift_s, other_s, other)) ** 2)) for one, other in pairs
        )

    bounds = (coarse_s - _STEP_S, coarse_s + _STEP_S)
    optimum: Any = minimize_scalar(difference, bounds=bounds, method="bounded", options={"xatol": 1e-7})
    return float(optimum.x)

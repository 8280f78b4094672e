"""Resampling of signals to a uniform grid, and gaps in them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import RecordingError


class Samples(NamedTuple):
    """Signal as measured.

    Attributes:
        time_s: Times [s], increasing, shape (n,).
        values: Values, finite, shape (n,).
    """

    time_s: Array
    values: Array


def samples(name: str, time_s: Array, values: Array, file: str) -> Samples:
    """Return the finite samples in the order of their times; the last of several at one instant is kept.

    Raises:
        RecordingError: time and values differ in length, fewer than two samples are left, or the time goes backwards.
    """
    if time_s.shape != values.shape or time_s.ndim != 1:
        raise RecordingError(
            f"{name} has {values.shape} values at {time_s.shape} times; one value a time is needed", file=file
        )
    known = np.isfinite(time_s) & np.isfinite(values)
    time_s, values = time_s[known], values[known]
    steps = np.diff(time_s)
    if len(time_s) and (steps < 0.0).any():
        row = int(np.argmax(steps < 0.0))
        raise RecordingError(
            f"the time of {name} goes backwards, from {time_s[row]:g} to {time_s[row + 1]:g} s; split several runs "
            "in one file, or cut them with start_s and end_s of a map",
            file=file,
        )
    last = np.append(steps > 0.0, True) if len(time_s) else known[:0]
    if np.count_nonzero(last) < 2:
        raise RecordingError(f"{name} has fewer than two samples that are numbers", file=file)
    return Samples(time_s[last], values[last])


def gaps(signal: Samples, longest_s: float, start_s: float, end_s: float) -> list[tuple[float, float]]:
    """Return gaps between samples that are longer than `longest_s`, from start to end."""
    inside = (signal.time_s[1:] > start_s) & (signal.time_s[:-1] < end_s)
    wide = inside & (np.diff(signal.time_s) > longest_s)
    return [(float(signal.time_s[row]), float(signal.time_s[row + 1])) for row in np.flatnonzero(wide)]


def resampled(signal: Samples, grid_s: Array) -> Array:
    """Resample a signal to a uniform grid, with straight lines between samples.

    If the samples are closer than the grid, their mean over a grid step is taken, which prevents aliasing.

    Args:
        signal: The samples.
        grid_s: Times within the signal [s], shape (m,).

    Returns:
        Values, shape (m,).
    """
    step_s = float(grid_s[1] - grid_s[0])
    if float(np.median(np.diff(signal.time_s))) > 0.75 * step_s:
        return np.interp(grid_s, signal.time_s, signal.values)
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - slow to import

    integral = make_interp_spline(signal.time_s, signal.values, k=1).antiderivative()
    # Towards the ends, the window shrinks on both sides, so that its centre does not move.
    half = np.minimum(0.5 * step_s, np.minimum(grid_s - signal.time_s[0], signal.time_s[-1] - grid_s))
    wide = half > 1e-3 * step_s
    values = np.interp(grid_s, signal.time_s, signal.values)
    values[wide] = (integral((grid_s + half)[wide]) - integral((grid_s - half)[wide])) / (2.0 * half[wide])
    return values

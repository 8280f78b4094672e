"""Samples at any times on a uniform grid, with the pieces that have none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import RecordingError


class Samples(NamedTuple):
    """A signal as it was measured.

    Attributes:
        time_s: Times [s], increasing, shape (n,).
        values: Values, finite, shape (n,).
    """

    time_s: Array
    values: Array


def samples(name: str, time_s: Array, values: Array, file: str) -> Samples:
    """The samples that are numbers, in the order of their times; of several at one instant the last one counts.

    Raises:
        RecordingError: time and values differ in length, fewer than two are left, or the time goes backwards.
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
            f"the time of {name} goes backwards, from {time_s[row]:g} to {time_s[row + 1]:g} s; several runs in one "
            "file are cut with start_s and end_s of a map after they are taken apart",
            file=file,
        )
    last = np.append(steps > 0.0, True) if len(time_s) else known[:0]
    if np.count_nonzero(last) < 2:
        raise RecordingError(f"{name} has fewer than two samples that are numbers", file=file)
    return Samples(time_s[last], values[last])


def gaps(signal: Samples, longest_s: float, start_s: float, end_s: float) -> list[tuple[float, float]]:
    """Pieces between samples that are longer than that, from start to end."""
    inside = (signal.time_s[1:] > start_s) & (signal.time_s[:-1] < end_s)
    wide = inside & (np.diff(signal.time_s) > longest_s)
    return [(float(signal.time_s[row]), float(signal.time_s[row + 1])) for row in np.flatnonzero(wide)]


def resampled(signal: Samples, grid_s: Array) -> Array:
    """Values on a uniform grid, straight between samples.

    Where these are closer than the grid, their mean over a step of it, so that what is faster than the grid does not
    come back as something slow.

    Args:
        signal: The samples.
        grid_s: Instants within their times [s], shape (m,).

    Returns:
        Values, shape (m,).
    """
    step_s = float(grid_s[1] - grid_s[0])
    if float(np.median(np.diff(signal.time_s))) > 0.75 * step_s:
        return np.interp(grid_s, signal.time_s, signal.values)
    areas = np.diff(signal.time_s) * 0.5 * (signal.values[1:] + signal.values[:-1])
    integral = np.append(0.0, np.cumsum(areas))

    def until(time_s: Array) -> Array:
        # The integral of straight pieces is exact at any instant inside of them.
        place = np.clip(np.searchsorted(signal.time_s, time_s) - 1, 0, len(areas) - 1)
        into = time_s - signal.time_s[place]
        here = np.interp(time_s, signal.time_s, signal.values)
        return integral[place] + 0.5 * into * (signal.values[place] + here)

    # Towards the ends the window becomes shorter at both sides: it must not move in time.
    half = np.minimum(0.5 * step_s, np.minimum(grid_s - signal.time_s[0], signal.time_s[-1] - grid_s))
    wide = half > 1e-3 * step_s
    values = np.interp(grid_s, signal.time_s, signal.values)
    values[wide] = (until((grid_s + half)[wide]) - until((grid_s - half)[wide])) / (2.0 * half[wide])
    return values

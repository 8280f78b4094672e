"""A corridor around a signal over time, with a tolerance in time and a tolerance in the value."""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.conventions import Array

TIME_TOLERANCE_S: Final = 0.02
"""Tolerance in time, to either side [s]; agreed for comparisons with another code."""


def corridor(time_s: Array, values: Array, width: float | Array) -> tuple[Array, Array]:
    """Return the lower and the upper edge around a signal: `TIME_TOLERANCE_S` in time, and a tolerance in the value."""
    fine = np.linspace(-TIME_TOLERANCE_S, TIME_TOLERANCE_S, 9)
    moved = np.stack([np.interp(time_s + shift, time_s, values) for shift in fine])
    return moved.min(axis=0) - width, moved.max(axis=0) + width

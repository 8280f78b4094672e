"""A corridor around a signal over time: so far to either side in time, and so far up and down."""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.conventions import Array

TIME_TOLERANCE_S: Final = 0.02
"""How far a signal may lie to either side in time [s]; agreed for `activesteer validate`."""


def corridor(time_s: Array, values: Array, width: float | Array) -> tuple[Array, Array]:
    """Lower and upper edge around a signal: `TIME_TOLERANCE_S` to either side, and a width up and down.

    Args:
        time_s: Time, ascending [s], shape (n,).
        values: The signal, shape (n,).
        width: In its unit, shape (n,) or a number.
    """
    fine = np.linspace(-TIME_TOLERANCE_S, TIME_TOLERANCE_S, 9)
    moved = np.stack([np.interp(time_s + shift, time_s, values) for shift in fine])
    return moved.min(axis=0) - width, moved.max(axis=0) + width

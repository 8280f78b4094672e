"""Heights of an uneven road on an even grid."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array


class Grid(NamedTuple):
    """Heights over distance along the road and distance to the left.

    Attributes:
        s_m: First distance along the road [m].
        step_s_m: Distance of the rows [m].
        d_m: First distance to the left [m].
        step_d_m: Distance of the columns [m].
        z_m: Heights [m], shape (rows, columns), at least two of each.
    """

    s_m: float
    step_s_m: float
    d_m: float
    step_d_m: float
    z_m: Array

    @property
    def s(self) -> Array:
        """Distances of the rows [m]."""
        return self.s_m + self.step_s_m * np.arange(self.z_m.shape[0])

    @property
    def d(self) -> Array:
        """Distances of the columns [m]."""
        return self.d_m + self.step_d_m * np.arange(self.z_m.shape[1])

    def knows(self, s_m: Array, d_m: Array) -> NDArray[np.bool_]:
        """Return for each place whether it lies within the grid."""
        along, across = (s_m - self.s_m) / self.step_s_m, (d_m - self.d_m) / self.step_d_m
        rows, columns = self.z_m.shape
        return (along >= 0.0) & (along <= rows - 1) & (across >= 0.0) & (across <= columns - 1)


def summed(fine: Grid, other: Grid) -> Grid:
    """Return the sum of two grids on the columns and steps of the first one, over the rows of both.

    Beyond its edges each grid is constant.
    """
    first = min(0, round((other.s_m - fine.s_m) / fine.step_s_m))
    last = max(fine.z_m.shape[0], round((other.s[-1] - fine.s_m) / fine.step_s_m) + 1)
    s = fine.s_m + fine.step_s_m * np.arange(first, last)
    rows = np.clip(np.arange(first, last), 0, fine.z_m.shape[0] - 1)
    across = np.array([np.interp(fine.d, other.d, row) for row in other.z_m])
    more = np.column_stack([np.interp(s, other.s, column) for column in across.T])
    return fine._replace(s_m=float(s[0]), z_m=fine.z_m[rows] + more)

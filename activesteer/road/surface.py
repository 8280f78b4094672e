"""Surface of an uneven road: everything that its keys say about height, as arrays for the kernels."""

from __future__ import annotations

import functools
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array
from activesteer.road.obstacles import OBSTACLE, Grid
from activesteer.road.road import Road
from activesteer.road.surface_kernels import COARSE_M, ENVELOPING, FOUR_POINT, SINGLE_POINT, SURFACE, heights_at

_CONTACTS: Final = {"single_point": SINGLE_POINT, "four_point": FOUR_POINT, "enveloping": ENVELOPING}
_BLEND_M: Final = 2.0
"""Distance from which the surface is blended in [m]: ahead of the front wheels of a car at the start."""
_REACH_M: Final = 0.4
"""Distance within which a tyre feels the road [m]."""


class Surface(NamedTuple):
    """An uneven road for the kernels.

    Attributes:
        head: `SURFACE`, shape (1,).
        numbers: The numbers that belong to it.
        obstacles: `OBSTACLE`, in the order of their starts.
    """

    head: NDArray[Any]
    numbers: Array
    obstacles: NDArray[Any]

    def at(self, s_m: Array, d_m: Array) -> Array:
        """Return height [m] and slopes along and across of places."""
        s, d = np.ascontiguousarray(s_m, np.float64), np.ascontiguousarray(d_m, np.float64)
        return heights_at(self.head[0], self.numbers, self.obstacles, s, d)


def surface_of(road: Road) -> Surface | None:
    """Return the surface of a road; None if it is plane."""
    return _surface_of(road) if road.is_uneven else None


@functools.lru_cache(maxsize=4)
def _surface_of(road: Road) -> Surface:
    head = np.zeros(1, SURFACE)
    head["coarse_m"] = COARSE_M
    grid, slopes = road.grid(), road.cross_slopes()
    numbers = []
    if grid is not None:
        rows, columns = grid.z_m.shape
        head["grid_s_m"], head["grid_per_s"], head["rows"] = grid.s_m, 1.0 / grid.step_s_m, rows
        head["grid_d_m"], head["grid_per_d"], head["columns"] = grid.d_m, 1.0 / grid.step_d_m, columns
        per = max(1, int(_REACH_M // grid.step_s_m))
        head["rise_per_s"], head["rises"] = head["grid_per_s"] / per, -(-rows // per)
        head["coarse_m"] = min(max(0.7 * grid.step_s_m, COARSE_M), 2.0 * COARSE_M)
        numbers.append(grid.z_m.ravel())
    if slopes is not None:
        start, step, values = slopes
        head["slope_s_m"], head["slope_per_s"], head["slopes"] = start, 1.0 / step, len(values)
        numbers.append(values)
    if grid is not None:
        numbers.append(_rises(grid))
    head["contact"], head["blend_m"], head["start_m"] = _CONTACTS[road.contact_used], _BLEND_M, road.start_m
    head["ends"] = road.outside == "error"
    records = [obstacle.record() for obstacle in sorted(road.obstacle, key=lambda it: it.start_m)]
    obstacles = np.concatenate(records) if records else np.empty(0, OBSTACLE)
    return Surface(head, np.concatenate(numbers) if numbers else np.zeros(1), obstacles)


def _rises(grid: Grid) -> Array:
    """Return the largest difference of height [m] in the reach of a tyre, for each stretch of `_REACH_M`."""
    per = max(1, int(_REACH_M // grid.step_s_m))
    count = -(-len(grid.z_m) // per)
    padded = np.pad(grid.z_m, ((0, count * per - len(grid.z_m)), (0, 0)), "edge").reshape(count, per, -1)
    highest, lowest = (np.pad(of(padded, axis=1), ((1, 1), (0, 0)), "edge") for of in (np.max, np.min))
    # A tyre near the end of a stretch reaches into the next one.
    high, low = (of([part[:-2], part[1:-1], part[2:]], axis=0) for of, part in ((np.max, highest), (np.min, lowest)))
    return (high - low).max(axis=1)

"""Height and slope of a road's surface, in Python and in compiled code.

A place has a distance `s` along the road and a distance `d` to the left of its middle. The height is the sum of

* a grid over s and d, bilinear, constant beyond its edges,
* a cross slope over s, linear between its points, times d,
* the obstacles.

Grid and cross slope are blended in from the plane on which the car starts. All functions are pure.
"""

from __future__ import annotations

import functools
import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import Array
from activesteer.native.compilation import compiled
from activesteer.native.records import numbers_type
from activesteer.road.obstacles import COSINE_BUMP, CROSS_SLOPE, OBSTACLE, PLATEAU, SINE, Grid
from activesteer.road.road import Road

SURFACE: Final = numbers_type(
    "contact", "blend_m", "start_m", "grid_s_m", "grid_per_s", "rows", "grid_d_m", "grid_per_d", "columns", "slope_s_m",
    "slope_per_s", "slopes", "rise_per_s", "rises", "coarse_m", "ends",
)  # fmt: skip
"""Head of an uneven road. Its numbers are the grid, row by row along s, the cross slopes, and the rises.

contact: `SINGLE_POINT`, `FOUR_POINT` or `ENVELOPING`.
blend_m, start_m: Distances between which grid and cross slope are blended in.
grid_s_m, grid_per_s, rows; grid_d_m, grid_per_d, columns: First place, points per metre and number of points.
rise_per_s, rises: Largest rise of the grid in a tyre's reach, in stretches along s: stretches per metre, their number.
coarse_m: Distance at which a tyre looks for the road.
ends: 1 if leaving the grid is an error."""
SINGLE_POINT, FOUR_POINT, ENVELOPING = 1.0, 2.0, 3.0

COARSE_M: Final = 0.018
"""Distance at which a tyre looks for an obstacle [m]. A cleat of 20 mm cannot hide between two places."""
NEAR_M: Final = 1.0
"""Distance within which an obstacle affects a wheel [m]; a tyre reaches about 0.5 m."""


@compiled
def _plateau_at(it, x, d):
    """Return height and slopes of a step at a position."""
    along = min(x, it.length_m - x)
    across = min(d - it.right_m, it.left_m - d)
    height, slope_x, slope_d = it.height_m, 0.0, 0.0
    if along <= 0.0:
        height = 0.0
    elif along < it.edge_m or across < it.edge_m:
        steep = it.height_m / it.edge_m
        height = steep * min(along, across)
        if along <= across:
            slope_x = steep if x <= it.length_m - x else -steep
        else:
            slope_d = steep if d - it.right_m <= it.left_m - d else -steep
    return height, slope_x, slope_d


@compiled
def _sine_at(it, x):
    """Return height and slope of a wave that grows in its first period and fades in its last period."""
    part = x / it.length_m
    growth, rate = 1.0, 0.0
    if it.waves > 0.0 and part > it.waves - 1.0:
        growth, rate = max(it.waves - part, 0.0), -1.0 / it.length_m if part < it.waves else 0.0
    if part < growth:
        growth, rate = part, 1.0 / it.length_m
    wave = it.height_m * math.sin(2.0 * math.pi * part)
    slope = it.height_m * math.cos(2.0 * math.pi * part) * 2.0 * math.pi / it.length_m
    return growth * wave, rate * wave + growth * slope


@compiled
def _obstacle_at(it, s, d):
    """Return height and slopes of one obstacle at a position."""
    x, length = s - it.start_m + it.skew * d, it.length_m
    z, slope_x, slope_d = 0.0, 0.0, 0.0
    if x <= 0.0 or not it.right_m < d <= it.left_m:
        return z, slope_x, slope_d
    if it.shape == PLATEAU:
        z, slope_x, slope_d = _plateau_at(it, x, d)
    elif it.shape == CROSS_SLOPE:
        part = min(x / length, 1.0)
        slope_d = it.height_m * part * part * (3.0 - 2.0 * part)
        slope_x = it.height_m * d * 6.0 * part * (1.0 - part) / length
        z = slope_d * d
    elif it.shape == COSINE_BUMP and x < length:
        phase = 2.0 * math.pi * x / length
        z = 0.5 * it.height_m * (1.0 - math.cos(phase))
        slope_x = math.pi * it.height_m / length * math.sin(phase)
    elif it.shape == SINE:
        z, slope_x = _sine_at(it, x)
    return z, slope_x, slope_d + slope_x * it.skew


@compiled
def near_obstacles(obstacles, s, d):
    """Return the range of obstacles near a position, and the rise that they cause within a tyre's reach [m]."""
    first, last, highest = obstacles.size, 0, 0.0
    for index in range(obstacles.size):
        it = obstacles[index]
        x = s - it.start_m + it.skew * d
        margin = NEAR_M * (1.0 + abs(it.skew))
        length = it.length_m
        if it.shape == CROSS_SLOPE:
            length = math.inf
        elif it.shape == SINE:
            length = length * it.waves if it.waves > 0.0 else math.inf
        if -margin < x < length + margin and it.right_m - NEAR_M < d < it.left_m + NEAR_M:
            first, last = min(first, index), index + 1
            if it.shape == PLATEAU:
                highest += abs(it.height_m)
            elif it.shape != CROSS_SLOPE:
                highest += abs(it.height_m) * min(1.0, 2.0 * math.pi / it.length_m * NEAR_M)
    return first, last, highest


@compiled
def _on_grid(first, per, count, at):
    """Return index, fraction and points per metre at a position of a table, constant beyond its ends."""
    place = (at - first) * per
    if place <= 0.0 or place >= count - 1:
        place, per = min(max(place, 0.0), count - 1.0), 0.0
    index = min(int(place), count - 2)
    return index, place - index, per


@compiled
def level_at(surface, numbers, obstacles, first, last, s, d):
    """Return the height of the road at a position [m] (see `height_at`)."""
    z = 0.0
    rows, columns, count = int(surface.rows), int(surface.columns), int(surface.slopes)
    if s > surface.blend_m:
        if rows > 0:
            row, along, _ = _on_grid(surface.grid_s_m, surface.grid_per_s, rows, s)
            column, across, _ = _on_grid(surface.grid_d_m, surface.grid_per_d, columns, d)
            place = row * columns + column
            right = numbers[place] + along * (numbers[place + columns] - numbers[place])
            left = numbers[place + 1] + along * (numbers[place + columns + 1] - numbers[place + 1])
            z = right + across * (left - right)
        if count > 0:
            place, along, _ = _on_grid(surface.slope_s_m, surface.slope_per_s, count, s)
            place += rows * columns
            z += (numbers[place] + along * (numbers[place + 1] - numbers[place])) * d
        if s < surface.start_m:
            part = (s - surface.blend_m) / (surface.start_m - surface.blend_m)
            z *= part * part * (3.0 - 2.0 * part)
    for index in range(first, last):
        z += _obstacle_at(obstacles[index], s, d)[0]
    return z


@compiled
def height_at(surface, numbers, obstacles, first, last, s, d):
    """Return height [m] and slopes of the road at a position."""
    z, z_s, z_d = 0.0, 0.0, 0.0
    rows, columns, count = int(surface.rows), int(surface.columns), int(surface.slopes)
    if s > surface.blend_m:
        if rows > 0:
            row, along, per_s = _on_grid(surface.grid_s_m, surface.grid_per_s, rows, s)
            column, across, per_d = _on_grid(surface.grid_d_m, surface.grid_per_d, columns, d)
            place = row * columns + column
            near_right, near_left = numbers[place], numbers[place + 1]
            far_right, far_left = numbers[place + columns], numbers[place + columns + 1]
            right = near_right + along * (far_right - near_right)
            left = near_left + along * (far_left - near_left)
            z = right + across * (left - right)
            z_d = per_d * (left - right)
            z_s = per_s * (far_right - near_right + across * (far_left - near_left - far_right + near_right))
        if count > 0:
            place, along, per_s = _on_grid(surface.slope_s_m, surface.slope_per_s, count, s)
            place += rows * columns
            change = numbers[place + 1] - numbers[place]
            slope = numbers[place] + along * change
            z += slope * d
            z_d += slope
            z_s += per_s * change * d
        if s < surface.start_m:
            span = surface.start_m - surface.blend_m
            part = (s - surface.blend_m) / span
            share = part * part * (3.0 - 2.0 * part)
            z_s = share * z_s + 6.0 * part * (1.0 - part) / span * z
            z_d *= share
            z *= share
    for index in range(first, last):
        more, more_s, more_d = _obstacle_at(obstacles[index], s, d)
        z += more
        z_s += more_s
        z_d += more_d
    return z, z_s, z_d


@compiled
def rise_at(surface, numbers, s):
    """Return the rise of the grid within a tyre's reach around a position [m]."""
    count = int(surface.rises)
    if count == 0:
        return 0.0
    place = int((s - surface.grid_s_m) * surface.rise_per_s)
    return numbers[int(surface.rows * surface.columns + surface.slopes) + min(max(place, 0), count - 1)]


@compiled
def left_grid(surface, s, d):
    """Return whether a position beyond the start is outside the grid."""
    if surface.rows == 0.0 or s < surface.start_m:
        return False
    along = (s - surface.grid_s_m) * surface.grid_per_s
    across = (d - surface.grid_d_m) * surface.grid_per_d
    return not (0.0 <= along <= surface.rows - 1.0 and 0.0 <= across <= surface.columns - 1.0)


@compiled
def heights_at(surface, numbers, obstacles, s, d):
    """Return heights and slopes at many positions, shape (n, 3)."""
    found = np.empty((len(s), 3))
    for index in range(len(s)):
        first, last, _ = near_obstacles(obstacles, s[index], d[index])
        z, z_s, z_d = height_at(surface, numbers, obstacles, first, last, s[index], d[index])
        found[index, 0], found[index, 1], found[index, 2] = z, z_s, z_d
    return found


_CONTACTS: Final = {"single_point": SINGLE_POINT, "four_point": FOUR_POINT, "enveloping": ENVELOPING}
_BLEND_M: Final = 2.0
"""Distance from which the surface is blended in [m]: ahead of the front wheels of a car at the start."""
_REACH_M: Final = 0.4
"""Distance within which a tyre feels the road [m]."""


class Surface(NamedTuple):
    """Arrays of an uneven road for the kernels."""

    head: NDArray[Any]
    numbers: Array
    obstacles: NDArray[Any]

    def at(self, s_m: Array, d_m: Array) -> Array:
        """Return height [m] and slopes at positions."""
        s, d = np.ascontiguousarray(s_m, np.float64), np.ascontiguousarray(d_m, np.float64)
        return heights_at(self.head[0], self.numbers, self.obstacles, s, d)


@functools.lru_cache(maxsize=4)
def surface_of(road: Road) -> Surface:
    """Return the surface of an uneven road."""
    head = np.zeros(1, SURFACE)
    head["coarse_m"] = COARSE_M
    grid = road.grid()
    numbers = []
    if grid is not None:
        rows, columns = grid.z_m.shape
        head["grid_s_m"], head["grid_per_s"], head["rows"] = grid.s_m, 1.0 / grid.step_s_m, rows
        head["grid_d_m"], head["grid_per_d"], head["columns"] = grid.d_m, 1.0 / grid.step_d_m, columns
        per = max(1, int(_REACH_M // grid.step_s_m))
        head["rise_per_s"], head["rises"] = head["grid_per_s"] / per, -(-rows // per)
        head["coarse_m"] = min(max(0.7 * grid.step_s_m, COARSE_M), 2.0 * COARSE_M)
        numbers.append(grid.z_m.ravel())
    if road.banking is not None:
        start, step, values = road.banking.sampled()
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
    """Return the largest height difference within the reach of a tyre [m], for each stretch of the road."""
    per = max(1, int(_REACH_M // grid.step_s_m))
    count = -(-len(grid.z_m) // per)
    padded = np.pad(grid.z_m, ((0, count * per - len(grid.z_m)), (0, 0)), "edge").reshape(count, per, -1)
    highest, lowest = (np.pad(of(padded, axis=1), ((1, 1), (0, 0)), "edge") for of in (np.max, np.min))
    # A tyre near the end of a stretch reaches into the next one.
    high, low = (of([part[:-2], part[1:-1], part[2:]], axis=0) for of, part in ((np.max, highest), (np.min, lowest)))
    return (high - low).max(axis=1)

"""Height and slope of an uneven road at a place: native code for the tyres.

A place has a distance `s` along the road and a distance `d` to the left of its middle. The height is the sum of

* a grid over s and d, bilinear, constant beyond its edges,
* a cross slope over s, linear between its points, times d,
* the obstacles.

Grid and cross slope are blended in from the plane on which the car starts. All functions are pure.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.compilation import compiled
from activesteer.road.obstacle import COSINE_BUMP, CROSS_SLOPE, PLATEAU, SINE

SURFACE: Final = np.dtype(
    (
        np.record,
        [
            (name, np.float64)
            for name in (
                "contact", "blend_m", "start_m", "grid_s_m", "grid_per_s", "rows", "grid_d_m", "grid_per_d", "columns",
                "slope_s_m", "slope_per_s", "slopes", "rise_m", "ends",
            )
        ],
    )
)  # fmt: skip
"""Head of an uneven road. Its numbers are the grid, row by row along s, then the cross slopes.

contact: `SINGLE_POINT`, `FOUR_POINT` or `ENVELOPING`.
blend_m, start_m: Distances between which grid and cross slope are blended in.
grid_s_m, grid_per_s, rows; grid_d_m, grid_per_d, columns: First place, points per metre and number of points.
rise_m: Largest rise of the grid within the reach of a tyre.
ends: 1 if leaving the grid is an error."""
SINGLE_POINT, FOUR_POINT, ENVELOPING = 1.0, 2.0, 3.0

NEAR_M: Final = 1.0
"""Distance within which an obstacle counts for a wheel [m]; a tyre reaches some 0.5 m."""


@compiled
def _plateau_at(it, x, d):
    """Return height and slopes along x and d of a step with its edges, x behind its beginning."""
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
    """Return height and slope of a wave that grows over its first period and fades over its last one."""
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
    """Return height and slopes along s and d of one obstacle."""
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
    """Return first and last (excluded) of the obstacles near a place, and their rise in a tyre's reach [m]."""
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
def height_at(surface, numbers, obstacles, first, last, s, d):
    """Return height [m] and slopes along s and d of the road at a place.

    Args:
        surface: A `SURFACE`.
        numbers: Its numbers.
        obstacles: The obstacles of the road.
        first: First obstacle near the place.
        last: Last one, excluded.
        s: Distance along the road [m].
        d: Distance to the left of its middle [m].
    """
    z, z_s, z_d = 0.0, 0.0, 0.0
    rows, columns = int(surface.rows), int(surface.columns)
    if rows > 0 and s > surface.blend_m:
        along = (s - surface.grid_s_m) * surface.grid_per_s
        across = (d - surface.grid_d_m) * surface.grid_per_d
        per_s, per_d = surface.grid_per_s, surface.grid_per_d
        if along <= 0.0 or along >= rows - 1:
            along, per_s = min(max(along, 0.0), rows - 1.0), 0.0
        if across <= 0.0 or across >= columns - 1:
            across, per_d = min(max(across, 0.0), columns - 1.0), 0.0
        row, column = min(int(along), rows - 2), min(int(across), columns - 2)
        along -= row
        across -= column
        place = row * columns + column
        near_right, near_left = numbers[place], numbers[place + 1]
        far_right, far_left = numbers[place + columns], numbers[place + columns + 1]
        right = near_right + along * (far_right - near_right)
        left = near_left + along * (far_left - near_left)
        z = right + across * (left - right)
        z_d = per_d * (left - right)
        z_s = per_s * (far_right - near_right + across * (far_left - near_left - far_right + near_right))
    count = int(surface.slopes)
    if count > 0 and s > surface.blend_m:
        along = (s - surface.slope_s_m) * surface.slope_per_s
        per_s = surface.slope_per_s
        if along <= 0.0 or along >= count - 1:
            along, per_s = min(max(along, 0.0), count - 1.0), 0.0
        place = min(int(along), count - 2)
        base = rows * columns + place
        change = numbers[base + 1] - numbers[base]
        slope = numbers[base] + (along - place) * change
        z += slope * d
        z_d += slope
        z_s += per_s * change * d
    if s < surface.start_m and (rows > 0 or count > 0) and s > surface.blend_m:
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
def left_grid(surface, s, d):
    """Return whether a place ahead of the start lies outside the grid."""
    if surface.rows == 0.0 or s < surface.start_m:
        return False
    along = (s - surface.grid_s_m) * surface.grid_per_s
    across = (d - surface.grid_d_m) * surface.grid_per_d
    return not (0.0 <= along <= surface.rows - 1.0 and 0.0 <= across <= surface.columns - 1.0)


@compiled
def heights_at(surface, numbers, obstacles, s, d):
    """Return heights and slopes of many places, shape (n, 3)."""
    found = np.empty((len(s), 3))
    for index in range(len(s)):
        first, last, _ = near_obstacles(obstacles, s[index], d[index])
        z, z_s, z_d = height_at(surface, numbers, obstacles, first, last, s[index], d[index])
        found[index, 0], found[index, 1], found[index, 2] = z, z_s, z_d
    return found

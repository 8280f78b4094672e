"""Position of a car relative to a path, in native code because a driver needs it in every step.

A place belongs to the nearest point of the path, so a place has one distance, even where the path crosses itself. Where
a later pass overlaps an earlier one, the earlier pass applies. A grid over the road holds the nearest point of each
cell's centre; from there the kernel walks along the path to the nearest point of the place itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import Array
from activesteer.core.path import SPACING_M, Path
from activesteer.native.compilation import compiled


class PathSearch:
    """Search along a path and beyond its ends. `line` holds the arguments of the kernels."""

    def __init__(self, path: Path) -> None:
        """Prepare the arguments of the kernels."""
        spacing = path.length_m / (len(path.s_m) - 1)
        self.line = spacing, path.x_m, path.y_m, float(path.heading_rad[0]), float(path.heading_rad[-1])

    def at(self, s_m: Array) -> tuple[Array, Array]:
        """Return points at arc lengths, including points before the start and beyond the end."""
        return _points_at(s_m, *self.line)

    def nearest(self, x_m: float, y_m: float, around_m: float, window_m: float) -> float:
        """Return the arc length of the nearest point of the path, searched near the last position."""
        return nearest(x_m, y_m, around_m, window_m, *self.line)


class PathSearches:
    """Searches of many cars, each along its own path (see `PathSearch`)."""

    def __init__(self, paths: Sequence[Path]) -> None:
        """Prepare the arguments of the kernel."""
        different = {id(path): path for path in paths}
        places = {key: place for place, key in enumerate(different)}
        self._path = np.array([places[id(path)] for path in paths])
        lines = [PathSearch(path).line for path in different.values()]
        spacings, xs, ys, firsts, lasts = zip(*lines, strict=True)
        self._starts = np.cumsum([0, *map(len, xs)])
        self._points = np.concatenate(xs), np.concatenate(ys)
        self._ends = np.array([spacings, firsts, lasts]).T.copy()

    def ahead(
        self, cars: NDArray[np.intp], x_m: Array, y_m: Array, around_m: Array, window_m: float, ahead_m: Array
    ) -> tuple[Array, Array, Array]:
        """Find the nearest points of the paths, and points ahead of them."""
        return _ahead(self._path[cars], x_m, y_m, around_m, window_m, ahead_m, self._starts, *self._points, self._ends)


@compiled
def point_at(s, spacing, xs, ys, heading_first, heading_last):
    """Return one point of a path, linear between its points and straight beyond its ends."""
    last = len(xs) - 1
    place = s / spacing
    if place <= 0.0:
        return xs[0] + s * math.cos(heading_first), ys[0] + s * math.sin(heading_first)
    if place >= last:
        beyond = s - last * spacing
        return xs[last] + beyond * math.cos(heading_last), ys[last] + beyond * math.sin(heading_last)
    index = min(int(place), last - 1)
    fraction = place - index
    return xs[index] + fraction * (xs[index + 1] - xs[index]), ys[index] + fraction * (ys[index + 1] - ys[index])


@compiled
def _points_at(s, spacing, xs, ys, heading_first, heading_last):
    """Computation of `PathSearch.at`."""
    x, y = np.empty(len(s)), np.empty(len(s))
    for index in range(len(s)):
        x[index], y[index] = point_at(s[index], spacing, xs, ys, heading_first, heading_last)
    return x, y


@compiled
def nearest(x, y, around, window, spacing, xs, ys, heading_first, heading_last):
    """Computation of `PathSearch.nearest`."""
    count = math.ceil(2.0 * window / SPACING_M) + 1
    best, minimum, before, after = 0, math.inf, math.inf, math.inf
    previous = math.inf
    for index in range(count):
        px, py = point_at(around - window + index * SPACING_M, spacing, xs, ys, heading_first, heading_last)
        distance = (px - x) ** 2 + (py - y) ** 2
        if index == best + 1:
            after = distance
        if distance < minimum:
            best, minimum, before, after = index, distance, previous, math.inf
        previous = distance
    # A parabola through the three nearest points, so that the result moves smoothly between points.
    bend = before - 2.0 * minimum + after
    shift = 0.5 * (before - after) / bend if 0.0 < bend < math.inf else 0.0
    return around - window + (best + min(max(shift, -1.0), 1.0)) * SPACING_M


@compiled
def _ahead(path, x, y, around, window, ahead, starts, xs, ys, ends):
    """Computation of `PathSearches.ahead`."""
    along, px, py = np.empty(len(path)), np.empty(ahead.shape), np.empty(ahead.shape)
    for car, own in enumerate(path):
        own_xs, own_ys = xs[starts[own] : starts[own + 1]], ys[starts[own] : starts[own + 1]]
        spacing, first, last = ends[own]
        along[car] = nearest(x[car], y[car], around[car], window, spacing, own_xs, own_ys, first, last)
        for place in range(ahead.shape[1]):
            s = along[car] + ahead[car, place]
            px[car, place], py[car, place] = point_at(s, spacing, own_xs, own_ys, first, last)
    return along, px, py


_BESIDE_M: Final = 20.0
"""Width of the road next to the path that the grid covers [m]. Places outside use the nearest cell."""
_CELL_M: Final = 2.0
_MAX_CELLS: Final = 65536
"""Largest number of cells. On a larger area the cells are larger [-]."""
_SAME_PASS: Final = 20
"""Points of the path further apart than this belong to different passes [-]."""
_ON_EARLIER_M: Final = 1.0
"""Distance below which a later pass counts as on an earlier pass [m]."""


class PathGrid(NamedTuple):
    """Arguments of `along_path`: grid of indices of the points nearest to cell centres, and points (x, y in turn)."""

    x0_m: float
    y0_m: float
    cell_m: float
    columns: int
    rows: int
    spacing_m: float
    points: Array  # x and y in turn, shape (2 n,)
    cells: Array  # index of the point nearest to each cell's centre, row by row

    @classmethod
    def of(cls, path: Path) -> PathGrid:
        """Create the grid over a path."""
        from scipy.spatial import KDTree  # noqa: PLC0415 - slow to import, and needed for few roads

        points = np.column_stack([path.x_m, path.y_m])
        low, high = points.min(axis=0) - _BESIDE_M, points.max(axis=0) + _BESIDE_M
        size = high - low
        cell = max(_CELL_M, math.sqrt(size[0] * size[1] / _MAX_CELLS))
        columns, rows = (max(1, math.floor(length / cell)) for length in size)
        earliest = np.array([min(near) for near in KDTree(points).query_ball_point(points, _ON_EARLIER_M)])
        kept = np.flatnonzero(np.arange(len(points)) - earliest <= _SAME_PASS)
        x, y = np.meshgrid(low[0] + cell * (np.arange(columns) + 0.5), low[1] + cell * (np.arange(rows) + 0.5))
        _, nearest = KDTree(points[kept]).query(np.column_stack([x.ravel(), y.ravel()]))
        spacing = path.length_m / (len(points) - 1)
        return cls(low[0], low[1], cell, columns, rows, spacing, points.ravel(), kept[nearest].astype(np.float64))


@compiled
def _direction_at(points, at):
    """Return the direction of the path at one of its points as a unit vector."""
    before, after = max(at - 1, 0), min(at + 1, points.size // 2 - 1)
    x, y = points[2 * after] - points[2 * before], points[2 * after + 1] - points[2 * before + 1]
    length = math.sqrt(x * x + y * y)
    return x / length, y / length


@compiled
def along_path(x, y, x0, y0, cell, columns, rows, spacing, points, cells):
    """Return the position along and to the left of a path [m], its unit tangent and its curvature [1/m]."""
    # Between two points of the path the direction turns evenly, so that a place moves evenly too. The path continues
    # straight beyond its ends.
    column = min(max(int((x - x0) / cell), 0), int(columns) - 1)
    row = min(max(int((y - y0) / cell), 0), int(rows) - 1)
    at, last = int(cells[row * int(columns) + column]), points.size // 2 - 1
    best = (points[2 * at] - x) ** 2 + (points[2 * at + 1] - y) ** 2
    for step in (1, -1):
        while 0 <= at + step <= last:
            distance = (points[2 * at + 2 * step] - x) ** 2 + (points[2 * at + 2 * step + 1] - y) ** 2
            if distance >= best:
                break
            at, best = at + step, distance
    tx, ty = _direction_at(points, at)
    dx, dy = x - points[2 * at], y - points[2 * at + 1]
    ahead = dx * tx + dy * ty
    if (at == 0 and ahead <= 0.0) or (at == last and ahead >= 0.0):
        return at * spacing + ahead, tx * dy - ty * dx, tx, ty, 0.0
    if ahead < 0.0:
        at -= 1
        tx, ty = _direction_at(points, at)
        dx, dy = x - points[2 * at], y - points[2 * at + 1]
        ahead = dx * tx + dy * ty
    ux, uy = _direction_at(points, at + 1)
    behind = (x - points[2 * at + 2]) * ux + (y - points[2 * at + 3]) * uy
    part = min(max(ahead / (ahead - behind), 0.0), 1.0) if ahead != behind else 0.0
    curvature = (tx * uy - ty * ux) / spacing
    dx -= part * (points[2 * at + 2] - points[2 * at])
    dy -= part * (points[2 * at + 3] - points[2 * at + 1])
    tx, ty = tx + part * (ux - tx), ty + part * (uy - ty)
    length = math.sqrt(tx * tx + ty * ty)
    tx, ty = tx / length, ty / length
    return (at + part) * spacing, tx * dy - ty * dx, tx, ty, curvature

"""Distance along a path, and distance to its left, of any place on the road: native code for the tyres.

A place belongs to the nearest point of the path, so a place has one distance, also where the path crosses itself. Where
a later pass lies on an earlier one, the earlier pass counts. A grid over the road holds the nearest point of each
cell's centre; from there the kernel walks along the path to the nearest point of the place itself.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from activesteer.compilation import compiled
from activesteer.conventions import Array
from activesteer.road.path import Path

_BESIDE_M: Final = 20.0
"""Width of the road beside the path that the grid covers [m]; places outside use the nearest cell."""
_CELL_M: Final = 2.0
_MAX_CELLS: Final = 65536
"""Largest number of cells; on a larger area the cells are larger [-]."""
_SAME_PASS: Final = 20
"""Points of the path further apart than this belong to different passes [-]."""
_ON_EARLIER_M: Final = 1.0
"""A later pass nearer to an earlier one than this lies on it [m]."""


class PathGrid(NamedTuple):
    """Arguments of `along_path`.

    Attributes:
        x0_m: World x of the grid's corner [m].
        y0_m: World y of the grid's corner [m].
        cell_m: Side of a cell [m].
        columns: Number of cells along x.
        rows: Number of cells along y.
        spacing_m: Distance between two points of the path [m].
        points: World x and y of the points in turn [m], shape (2 n,).
        cells: Index of the point nearest to each cell's centre, row by row, shape (rows x columns,).
    """

    x0_m: float
    y0_m: float
    cell_m: float
    columns: int
    rows: int
    spacing_m: float
    points: Array
    cells: Array

    @classmethod
    def of(cls, path: Path) -> PathGrid:
        """Lay the grid over a path."""
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
    """Return the direction of the path at one of its points, a unit vector: that of its neighbours."""
    before, after = max(at - 1, 0), min(at + 1, points.size // 2 - 1)
    x, y = points[2 * after] - points[2 * before], points[2 * after + 1] - points[2 * before + 1]
    length = math.sqrt(x * x + y * y)
    return x / length, y / length


@compiled
def along_path(x, y, x0, y0, cell, columns, rows, spacing, points, cells):
    """Return the place x, y [m] on a path: distance along it and to its left [m], its direction, its curvature [1/m].

    The direction is that of the tangent, a unit vector. Between two points of the path the direction turns evenly, so
    that a place moves evenly too. The path continues straight beyond its ends. The other arguments are the fields of
    `PathGrid`.
    """
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

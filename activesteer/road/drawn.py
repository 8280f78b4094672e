"""Surface of an uneven road, as a recording stores it for drawing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import Array
from activesteer.core.limits import fail, numbers, sequence, table_of
from activesteer.road.road import Road

_MAX_PLACES: Final = 200_000
_STEP_M: Final = 0.25
_MAX_ALONG: Final = 2000
_WIDTH_M: Final = 8.0
_ACROSS_M: Final = 0.5
_EDGE_M: Final = 1e-3
"""Distance between two places on either side of an edge [m]."""


class DrawnSurface(NamedTuple):
    """Grid of heights at increasing distances along the road and to the left of its middle line [m]."""

    s_m: Array
    d_m: Array
    z_m: Array

    @property
    def plane_below_m(self) -> float:
        """Height of the plane around the surface, below its lowest point [m]."""
        return min(0.0, float(self.z_m.min())) - 0.02

    def to_table(self) -> dict[str, Any]:
        """Return the surface as plain tables, with heights rounded to 0.1 mm."""
        return {name: np.round(values, 4).tolist() for name, values in self._asdict().items()}

    def mesh(self, road: Road) -> tuple[Array, NDArray[np.int64]]:
        """Return a mesh of the surface: corners in world axes [m], and triangles, anticlockwise from above."""
        # Each quadrilateral is divided along the diagonal that is nearer to level, so that a skew edge is not jagged.
        s, d = np.meshgrid(self.s_m, self.d_m, indexing="ij")
        x, y = road.placed(s.ravel(), d.ravel())
        corner = np.arange(s.size).reshape(s.shape)
        near_right, near_left, far_right, far_left = corner[:-1, :-1], corner[:-1, 1:], corner[1:, :-1], corner[1:, 1:]
        rise = np.abs(self.z_m[1:, 1:] - self.z_m[:-1, :-1]) - np.abs(self.z_m[1:, :-1] - self.z_m[:-1, 1:])
        falls = rise > 0.0
        faces = [
            (near_right, far_right, np.where(falls, near_left, far_left)),
            (np.where(falls, far_right, near_right), far_left, near_left),
        ]
        triangles = np.concatenate([np.stack(face, axis=-1).reshape(-1, 3) for face in faces])
        return np.column_stack([x, y, self.z_m.ravel()]), triangles


def places_to_draw(road: Road, length_m: float) -> tuple[Array, Array]:
    """Return the positions along and across a road at which its surface is drawn [m]."""
    count = min(_MAX_ALONG, max(2, round(length_m / _STEP_M)))
    # A skew edge passes a corner of each quadrilateral where the steps have the ratio of its slope.
    skew = [abs(math.tan(obstacle.angle_rad)) for obstacle in road.obstacle if obstacle.angle_rad != 0.0]
    finest = 0.5 * _MAX_PLACES / count
    step = max(min([_ACROSS_M, *(_STEP_M / slope for slope in skew)]), 2.0 * _WIDTH_M / finest)
    places = round(2.0 * _WIDTH_M / step)
    along, across = [np.linspace(0.0, length_m, count)], [np.linspace(-_WIDTH_M, _WIDTH_M, places + 1)]
    for obstacle in road.obstacle:
        ends = [0.0, *np.linspace(0.0, 1.0, 9) * (obstacle.length_m or 0.0)]
        edge = obstacle.edge_m
        inner = [edge, (obstacle.length_m or 0.0) - edge]
        along.append(obstacle.start_m + np.array([*ends, *inner, -_EDGE_M, (obstacle.length_m or 0.0) + _EDGE_M]))
        borders = [border for border in obstacle.borders if np.isfinite(border)]
        across += [border + np.array([-_EDGE_M, _EDGE_M, -edge, edge]) for border in borders]
    s, d = (np.unique(np.round(np.concatenate(parts), 4)) for parts in (along, across))
    return s[(s >= 0.0) & (s <= length_m)], d[np.abs(d) <= _WIDTH_M]


def surface_in(metadata: Mapping[str, Any]) -> DrawnSurface | None:
    """Return the surface of a recorded run, or None for a plane road."""
    if "surface" not in metadata:
        return None
    table = table_of(metadata["surface"], "surface")
    s_m, d_m = (numbers(table.get(key), f"surface.{key}") for key in ("s_m", "d_m"))
    rows = sequence(table.get("z_m"), "surface.z_m")
    if len(s_m) < 2 or len(d_m) < 2 or len(rows) != len(s_m) or len(s_m) * len(d_m) > _MAX_PLACES:
        raise fail("surface", f"has {len(s_m)} s_m, {len(d_m)} d_m and {len(rows)} rows")
    if (np.diff(s_m) <= 0.0).any() or (np.diff(d_m) <= 0.0).any():
        raise fail("surface", "has positions that do not increase")
    z_m = [numbers(row, f"surface.z_m.{index}", count=len(d_m)) for index, row in enumerate(rows)]
    return DrawnSurface(s_m, d_m, np.array(z_m))

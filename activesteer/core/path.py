"""A path on the road, set by the manoeuvre and followed by the driver."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from activesteer.core.conventions import Array
from activesteer.errors import ManeuverError

SPACING_M: Final = 0.5
"""Distance between two points of a path [m]: a car at 100 km/h covers it in 18 ms."""
MIN_CHORD_M: Final = 1e-6
"""Smallest distance between two points in a row. Below it they count as the same point [m]."""
_FINE: Final = 20
"""Points per spacing used to measure the length of the curve."""


@dataclass(frozen=True, eq=False)
class Path:
    """Path through points at equal distances, straight beyond both ends; y and curvature are left positive."""

    s_m: Array
    x_m: Array
    y_m: Array
    heading_rad: Array  # direction of travel, unwrapped
    curvature_1pm: Array

    @classmethod
    def through(cls, x_m: ArrayLike, y_m: ArrayLike) -> Path:
        """Return a cubic spline through points over the chord length, which overshoots at very uneven distances."""
        from scipy.interpolate import CubicSpline  # noqa: PLC0415 - slow to import, and not needed to read a path

        x, y = np.asarray(x_m, dtype=np.float64), np.asarray(y_m, dtype=np.float64)
        if x.ndim != 1 or x.shape != y.shape or x.size < 2:
            raise ManeuverError(
                f"a path needs as many x as y, at least 2 of each; there are {x.size} and {y.size}",
                value=(x.size, y.size),
            )
        if bad := _first(~(np.isfinite(x) & np.isfinite(y))):
            raise ManeuverError(f"point {bad} of the path is not finite: ({x[bad - 1]:g}, {y[bad - 1]:g})", value=bad)
        chords = np.hypot(np.diff(x), np.diff(y))
        if bad := _first(chords < MIN_CHORD_M):
            raise ManeuverError(
                f"points {bad} and {bad + 1} of the path are the same: ({x[bad]:g}, {y[bad]:g}); leave one out",
                value=bad,
            )
        knots = np.concatenate([[0.0], np.cumsum(chords)])
        curve = CubicSpline(knots, np.column_stack([x, y]))
        fine = np.linspace(0.0, knots[-1], max(2, math.ceil(knots[-1] / SPACING_M) * _FINE + 1))
        steps = np.hypot(*np.diff(curve(fine), axis=0).T)
        lengths = np.concatenate([[0.0], np.cumsum(steps)])
        s = np.linspace(0.0, lengths[-1], max(2, math.ceil(lengths[-1] / SPACING_M) + 1))
        at = np.interp(s, lengths, fine)
        (px, py), (dx, dy), (ddx, ddy) = curve(at).T, curve(at, 1).T, curve(at, 2).T
        speed = np.hypot(dx, dy)
        # Native code walks along the points.
        px, py = np.ascontiguousarray(px), np.ascontiguousarray(py)
        return cls(s, px, py, np.unwrap(np.arctan2(dy, dx)), (dx * ddy - dy * ddx) / speed**3)

    @classmethod
    def between(cls, x_m: Array, y_m: Array) -> Path:
        """Create a path from known points, with arc length, heading and curvature by finite differences."""
        s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x_m), np.diff(y_m)))])
        heading = np.unwrap(np.arctan2(np.gradient(y_m, s), np.gradient(x_m, s)))
        x_m, y_m = np.ascontiguousarray(x_m), np.ascontiguousarray(y_m)
        return cls(s, x_m, y_m, heading, np.gradient(heading, s))

    @property
    def length_m(self) -> float:
        """Arc length of the whole path [m]."""
        return float(self.s_m[-1])

    def extended(self, by_m: float) -> tuple[Array, Array]:
        """Return x and y with one more point, straight ahead beyond the end."""
        end = self.heading_rad[-1]
        x = np.append(self.x_m, self.x_m[-1] + by_m * math.cos(end))
        return x, np.append(self.y_m, self.y_m[-1] + by_m * math.sin(end))


def _first(wrong: Sequence[bool] | NDArray[np.bool_]) -> int:
    """Return the number of the first invalid point, counted from 1, or 0 if all are valid."""
    found = np.flatnonzero(wrong)
    return int(found[0]) + 1 if found.size else 0

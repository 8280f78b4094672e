"""A path on the road: asked for by the manoeuvre, followed by the driver."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from activesteer.compilation import compiled
from activesteer.errors import ManeuverError

Array = NDArray[np.float64]

SPACING_M: Final = 0.5
"""Distance of two points of a path: a car at 100 km/h passes one in 18 ms."""
_FINE: Final = 20
"""Points per spacing with which the length of the curve is measured."""


@dataclass(frozen=True, eq=False)
class Path:
    """Points of equal distance along a curve; beyond both ends it goes on straight.

    Attributes:
        s_m: Arc length [m], from 0, shape (n,).
        x_m: World x [m], shape (n,).
        y_m: World y, left positive [m], shape (n,).
        heading_rad: Direction of travel [rad], counted on beyond half a turn, shape (n,).
        curvature_1pm: Curvature, left positive [1/m], shape (n,).
    """

    s_m: Array
    x_m: Array
    y_m: Array
    heading_rad: Array
    curvature_1pm: Array

    @classmethod
    def through(cls, x_m: ArrayLike, y_m: ArrayLike) -> Path:
        """The smooth curve through points: a cubic spline over the chord length.

        Between points of very uneven distance a spline swings out; a gap belongs where the path is straight.

        Args:
            x_m: World x of the points in the order of travel [m], at least two.
            y_m: World y [m], as many.

        Returns:
            The path, its points `SPACING_M` apart (a little less, so that they end with the last point).

        Raises:
            ManeuverError: there are too few points, one is not finite, or two in a row are the same.
        """
        x, y = np.asarray(x_m, dtype=np.float64), np.asarray(y_m, dtype=np.float64)
        if x.ndim != 1 or x.shape != y.shape or x.size < 2:
            msg = f"a path needs as many x as y, at least 2 of each; there are {x.size} and {y.size}"
            raise ManeuverError(msg)
        if bad := _first(~(np.isfinite(x) & np.isfinite(y))):
            msg = f"point {bad} of the path is not finite: ({x[bad - 1]:g}, {y[bad - 1]:g})"
            raise ManeuverError(msg)
        chords = np.hypot(np.diff(x), np.diff(y))
        if bad := _first(chords < 1e-6):
            msg = f"points {bad} and {bad + 1} of the path are the same: ({x[bad]:g}, {y[bad]:g}); leave one out"
            raise ManeuverError(msg)
        knots = np.concatenate([[0.0], np.cumsum(chords)])
        curve = CubicSpline(knots, np.column_stack([x, y]))
        fine = np.linspace(0.0, knots[-1], max(2, math.ceil(knots[-1] / SPACING_M) * _FINE + 1))
        steps = np.hypot(*np.diff(curve(fine), axis=0).T)
        lengths = np.concatenate([[0.0], np.cumsum(steps)])
        s = np.linspace(0.0, lengths[-1], max(2, math.ceil(lengths[-1] / SPACING_M) + 1))
        at = np.interp(s, lengths, fine)
        (px, py), (dx, dy), (ddx, ddy) = curve(at).T, curve(at, 1).T, curve(at, 2).T
        speed = np.hypot(dx, dy)
        return cls(s, px, py, np.unwrap(np.arctan2(dy, dx)), (dx * ddy - dy * ddx) / speed**3)

    @property
    def length_m(self) -> float:
        """Arc length [m]."""
        return float(self.s_m[-1])

    def at(self, s_m: Array) -> tuple[Array, Array]:
        """Points at arc lengths, also before the beginning and beyond the end.

        Args:
            s_m: Arc lengths [m], shape (k,).

        Returns:
            World x and y [m], shape (k,) each.
        """
        return _points_at(s_m, *self._line)

    def nearest(self, x_m: float, y_m: float, around_m: float, window_m: float) -> float:
        """Arc length of the point of the path nearest to a point, looked for around a place where it was before.

        Args:
            x_m: World x of the point [m].
            y_m: World y of the point [m].
            around_m: Arc length to look around [m].
            window_m: How far to look to either side [m].

        Returns:
            Arc length [m]; below 0 or above the length where the path goes on straight.
        """
        return _nearest(x_m, y_m, around_m, window_m, *self._line)

    @cached_property
    def _line(self) -> tuple[float, Array, Array, float, float]:
        """What the kernels take: spacing [m], x and y of the points [m], headings at both ends [rad]."""
        spacing = self.length_m / (len(self.s_m) - 1)
        return spacing, self.x_m, self.y_m, float(self.heading_rad[0]), float(self.heading_rad[-1])


@compiled
def _point_at(s, spacing, xs, ys, heading_first, heading_last):
    """One point: linear between points, straight beyond the ends."""
    last = len(xs) - 1
    place = s / spacing
    if place <= 0.0:
        return xs[0] + s * math.cos(heading_first), ys[0] + s * math.sin(heading_first)
    if place >= last:
        beyond = s - last * spacing
        return xs[last] + beyond * math.cos(heading_last), ys[last] + beyond * math.sin(heading_last)
    index = min(int(place), last - 1)
    share = place - index
    return xs[index] + share * (xs[index + 1] - xs[index]), ys[index] + share * (ys[index + 1] - ys[index])


@compiled
def _points_at(s, spacing, xs, ys, heading_first, heading_last):
    """`Path.at` as native code."""
    x, y = np.empty(len(s)), np.empty(len(s))
    for index in range(len(s)):
        x[index], y[index] = _point_at(s[index], spacing, xs, ys, heading_first, heading_last)
    return x, y


@compiled
def _nearest(x, y, around, window, spacing, xs, ys, heading_first, heading_last):
    """`Path.nearest` as native code."""
    count = math.ceil(2.0 * window / SPACING_M) + 1
    best, least, before, after = 0, math.inf, math.inf, math.inf
    previous = math.inf
    for index in range(count):
        px, py = _point_at(around - window + index * SPACING_M, spacing, xs, ys, heading_first, heading_last)
        distance = (px - x) ** 2 + (py - y) ** 2
        if index == best + 1:
            after = distance
        if distance < least:
            best, least, before, after = index, distance, previous, math.inf
        previous = distance
    # The parabola through the three nearest points: the result moves on smoothly between them.
    bend = before - 2.0 * least + after
    shift = 0.5 * (before - after) / bend if 0.0 < bend < math.inf else 0.0
    return around - window + (best + min(max(shift, -1.0), 1.0)) * SPACING_M


def _first(wrong: Sequence[bool] | NDArray[np.bool_]) -> int:
    """Number of the first point that is wrong, counted from 1; 0 where none is."""
    found = np.flatnonzero(wrong)
    return int(found[0]) + 1 if found.size else 0

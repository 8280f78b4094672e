"""Position of a car along a path, and points of the path ahead: native code, since a driver needs it in each step."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from activesteer.compilation import compiled
from activesteer.conventions import Array
from activesteer.road.path import SPACING_M, Path


class PathSearch:
    """Positions along a path, also before its start and beyond its end.

    Attributes:
        line: The path as `nearest` and `point_at` take it: distance of its points [m], their world x and y [m], heading
            at both ends [rad].
    """

    def __init__(self, path: Path) -> None:
        """Prepare the arguments of the kernels.

        Args:
            path: The path; its points have equal distances.
        """
        spacing = path.length_m / (len(path.s_m) - 1)
        self.line = spacing, path.x_m, path.y_m, float(path.heading_rad[0]), float(path.heading_rad[-1])

    def at(self, s_m: Array) -> tuple[Array, Array]:
        """Return points at arc lengths, also before the start and beyond the end.

        Args:
            s_m: Arc lengths [m], shape (k,).

        Returns:
            World x and y [m], shape (k,) each.
        """
        return _points_at(s_m, *self.line)

    def nearest(self, x_m: float, y_m: float, around_m: float, window_m: float) -> float:
        """Find the arc length of the point of the path nearest to a given point, near its last position.

        Args:
            x_m: World x of the point [m].
            y_m: World y of the point [m].
            around_m: Arc length to search around [m].
            window_m: Search distance to either side [m].

        Returns:
            Arc length [m]; below 0 or above the length on the straight continuation of the path.
        """
        return nearest(x_m, y_m, around_m, window_m, *self.line)


class PathSearches:
    """Positions of many cars, each along its own path; see `PathSearch`."""

    def __init__(self, paths: Sequence[Path]) -> None:
        """Prepare the arguments of the kernel.

        Args:
            paths: The path of each car.
        """
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
        """Find the nearest points of the paths, and points ahead of them.

        Args:
            cars: Numbers of the cars, shape (n,).
            x_m: Their world x [m], shape (n,).
            y_m: Their world y [m], shape (n,).
            around_m: Arc lengths to search around [m], shape (n,).
            window_m: Search distance to either side [m].
            ahead_m: Distances from the nearest point along the path [m], shape (n, k).

        Returns:
            Arc lengths of the nearest points [m], shape (n,); world x and y of the points ahead [m], shape (n, k) each.
        """
        return _ahead(self._path[cars], x_m, y_m, around_m, window_m, ahead_m, self._starts, *self._points, self._ends)


@compiled
def point_at(s, spacing, xs, ys, heading_first, heading_last):
    """Return one point: linear between points, straight beyond the ends."""
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
    """`PathSearch.at` as native code."""
    x, y = np.empty(len(s)), np.empty(len(s))
    for index in range(len(s)):
        x[index], y[index] = point_at(s[index], spacing, xs, ys, heading_first, heading_last)
    return x, y


@compiled
def nearest(x, y, around, window, spacing, xs, ys, heading_first, heading_last):
    """`PathSearch.nearest` as native code."""
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
    """`PathSearches.ahead` as native code."""
    along, px, py = np.empty(len(path)), np.empty(ahead.shape), np.empty(ahead.shape)
    for car, own in enumerate(path):
        own_xs, own_ys = xs[starts[own] : starts[own + 1]], ys[starts[own] : starts[own + 1]]
        spacing, first, last = ends[own]
        along[car] = nearest(x[car], y[car], around[car], window, spacing, own_xs, own_ys, first, last)
        for place in range(ahead.shape[1]):
            s = along[car] + ahead[car, place]
            px[car, place], py[car, place] = point_at(s, spacing, own_xs, own_ys, first, last)
    return along, px, py

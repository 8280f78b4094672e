"""Lanes and cones: distances of the outline of the car's body from them.

The body is a rectangle of the car's width with a usual overhang beyond the axles (`Footprint`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.source import RecordingLike, read_footprint
from activesteer.conventions import Array
from activesteer.errors import RecordingError
from activesteer.road.course import CONE_RADIUS_M, Course, Footprint


def lane_overstep(recording: RecordingLike, course: Course, car: Footprint) -> float:
    """Return the largest distance of the body beyond the side of a lane.

    A corner of the body counts while it is between the two ends of a lane. The end of a side always counts, since a
    body that turns there covers it while its corners are elsewhere.

    Returns:
        Distance [m]; below 0, the smallest distance from a side. nan if no corner is ever inside a lane.
    """
    oversteps = [math.nan]
    for x, y in corners(recording, car):
        for lane in course.lanes:
            inside = y[(x >= lane.start_x_m) & (x <= lane.end_x_m)]
            if inside.size:
                oversteps += [float(inside.max()) - lane.left_y_m, lane.right_y_m - float(inside.min())]
    if len(oversteps) == 1:
        return math.nan
    ends = np.concatenate([lane.outline_m()[:4] for lane in course.lanes])
    return max(float(np.nanmax(oversteps)), -float(_distances(recording, ends, car).min()))


def stays_in_lanes(recording: RecordingLike, course: Course, car: Footprint) -> bool:
    """Return whether the whole body passes every lane to its end and never crosses a side.

    A car that turns round before the last lane crosses no side there, but it does not keep to the lanes.
    """
    for x, _ in corners(recording, car):
        for lane in course.lanes:
            if not ((x >= lane.start_x_m) & (x <= lane.end_x_m)).any() or not (x > lane.end_x_m).any():
                return False
    return lane_overstep(recording, course, car) <= 0.0


def cone_distances(recording: RecordingLike, course: Course, car: Footprint) -> Array:
    """Return the smallest distance between each cone and the body of the car.

    A cone is a disc of `CONE_RADIUS_M` around its point. A cone on the side of a lane is the point itself, since the
    width of a lane is measured between the sides of its cones.

    Returns:
        Distance [m], shape (number of cones,); 0 or less for a cone that is hit, by the depth that the body covers.
    """
    radius_m = np.where(course.on_lane_side(), 0.0, CONE_RADIUS_M)
    return _distances(recording, course.cones_m, car) - radius_m


def _distances(recording: RecordingLike, points_m: Array, car: Footprint) -> Array:
    """Return the smallest distance of each point from the body over the run [m], below 0 inside; points are (n, 2)."""
    front_x, front_y, cos, sin = _pose(recording)
    middle_m = 0.5 * (car.front_m + car.rear_m)
    half_length_m = car.front_m - middle_m
    distances = np.empty(len(points_m))
    for index, (x, y) in enumerate(points_m):
        ahead = (x - front_x) * cos + (y - front_y) * sin
        left = (y - front_y) * cos - (x - front_x) * sin
        beyond = np.abs(ahead - middle_m) - half_length_m
        beside = np.abs(left) - 0.5 * car.width_m
        outside = np.hypot(np.maximum(beyond, 0.0), np.maximum(beside, 0.0))
        distances[index] = (outside + np.minimum(np.maximum(beyond, beside), 0.0)).min()
    return distances


def struck_cones(recordings: Iterable[RecordingLike], course: Course) -> NDArray[np.bool_]:
    """Return which cones of a course at least one of the cars hits, shape (number of cones,).

    A run without the place or the size of its car hits none.
    """
    struck = np.zeros(len(course.cones_m), dtype=bool)
    for recording in recordings:
        with suppress(RecordingError):
            struck |= cone_distances(recording, course, read_footprint(recording)) <= 0.0
    return struck


def corners(recording: RecordingLike, car: Footprint) -> list[tuple[Array, Array]]:
    """Return world x and y of the corners of the body over time [m]: front left and right, rear left and right."""
    front_x, front_y, cos, sin = _pose(recording)
    return [
        (front_x + ahead * cos - left * sin, front_y + ahead * sin + left * cos)
        for ahead in (car.front_m, car.rear_m)
        for left in (0.5 * car.width_m, -0.5 * car.width_m)
    ]


def _pose(recording: RecordingLike) -> tuple[Array, Array, Array, Array]:
    """Return world x and y of the front axle centre [m], cosine and sine of the yaw angle, over time."""
    x, y, yaw = (
        np.asarray(recording[name], dtype=np.float64) for name in ("front_axle_x_m", "front_axle_y_m", "yaw_rad")
    )
    return x, y, np.cos(yaw), np.sin(yaw)

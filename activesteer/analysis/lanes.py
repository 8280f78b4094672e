"""Lanes, corridors and bands of a run.

The body is a rectangle of the car's width with a usual overhang beyond the axles (`Footprint`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from contextlib import suppress
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.source import RecordingLike, read_footprint
from activesteer.core.conventions import Array
from activesteer.core.path import Path
from activesteer.errors import RecordingError
from activesteer.road.course import CONE_RADIUS_M, Course, Footprint


def lane_overstep(recording: RecordingLike, course: Course, car: Footprint) -> float:
    """Return the largest distance of the body beyond the side of a lane."""
    # A corner of the body counts while it is between the two ends of a lane. The end of a side always counts, since a
    # body that turns there covers it while its corners are elsewhere.
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


def passes_lanes(recording: RecordingLike, course: Course, car: Footprint) -> bool:
    """Return whether the whole body passes the ends of all lanes."""
    # A car that turns round before the last lane crosses no side there, but it does not keep to the lanes.
    return all(
        ((x >= lane.start_x_m) & (x <= lane.end_x_m)).any() and (x > lane.end_x_m).any()
        for x, _ in corners(recording, car)
        for lane in course.lanes
    )


def cone_distances(recording: RecordingLike, course: Course, car: Footprint) -> Array:
    """Return the smallest distance between each cone and the body of the car."""
    # A cone is a disc of `CONE_RADIUS_M` around its point. A cone on the side of a lane is the point itself, since the
    # width of a lane is measured between the sides of its cones.
    radius_m = np.where(course.on_lane_side(), 0.0, CONE_RADIUS_M)
    return _distances(recording, course.cones_m, car) - radius_m


def _distances(recording: RecordingLike, points_m: Array, car: Footprint) -> Array:
    """Return the smallest distance between each point and the body over the run [m], negative inside the body."""
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
    """Return the mask of the cones that at least one of the cars hits, shape (number of cones,)."""
    # A run without the place or the size of its car hits none.
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
    """Return position and direction of the front axle over time: x and y [m], cosine and sine of the yaw angle."""
    yaw = recording["yaw_rad"]
    return *front_axle(recording), np.cos(yaw), np.sin(yaw)


_NEAR: Final = 10
"""Number of path points to search on either side of a car's last position: 5 m."""


def front_axle(recording: RecordingLike) -> tuple[Array, Array]:
    """Return world x and y of the front axle centre over time [m]."""
    return recording["front_axle_x_m"], recording["front_axle_y_m"]


def first_at(recording: RecordingLike, x_m: float) -> int | None:
    """Return the first sample at which the front axle centre has reached an x, or None."""
    reached = np.flatnonzero(front_axle(recording)[0] >= x_m)
    return int(reached[0]) if reached.size else None


def path_distance(x_m: Array, y_m: Array, path_x_m: Array, path_y_m: Array) -> Array:
    """Return the distances of points from a polyline, which continues straight beyond both ends."""
    # The nearest point of the path is on a piece next to the nearest corner point.
    from scipy.spatial import KDTree  # noqa: PLC0415 - takes a while to import

    points = np.column_stack([x_m, y_m])
    corners = np.column_stack([path_x_m, path_y_m])
    # For a point that is not finite, or whose distance is not, the tree returns a corner that does not exist.
    nearest = np.minimum(KDTree(corners).query(np.nan_to_num(points))[1], len(corners) - 1)
    pieces = np.diff(corners, axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    last = len(pieces) - 1
    best = np.full(len(points), math.inf)
    signed = np.full(len(points), math.nan)
    for piece in (np.maximum(nearest - 1, 0), np.minimum(nearest, last)):
        along, start = pieces[piece] / lengths[piece, None], points - corners[piece]
        along_m = np.einsum("ij,ij->i", start, along)
        low = np.where(piece == 0, -math.inf, 0.0)
        high = np.where(piece == last, math.inf, lengths[piece])
        offset = start - np.clip(along_m, low, high)[:, None] * along
        distance = np.linalg.norm(offset, axis=1)
        left = along[:, 0] * start[:, 1] - along[:, 1] * start[:, 0]
        closer = distance < best
        best = np.where(closer, distance, best)
        signed = np.where(closer, np.copysign(distance, left), signed)
    return signed


def heading_at_end(recording: RecordingLike, path_x_m: Array, path_y_m: Array) -> float:
    """Return the final heading of the car relative to the nearest segment of a path [rad]."""
    # A car that turned around several times has its whole turns left out.
    x, y = (channel[-1] for channel in front_axle(recording))
    nearest = int(np.argmin(np.hypot(path_x_m - x, path_y_m - y)))
    begin = min(nearest, len(path_x_m) - 2)
    along = math.atan2(path_y_m[begin + 1] - path_y_m[begin], path_x_m[begin + 1] - path_x_m[begin])
    return math.remainder(float(recording["yaw_rad"][-1]) - along, 2.0 * math.pi)


def places_along(x_m: Array, y_m: Array, path: Path) -> tuple[Array, Array]:
    """Return the position of a car relative to a path: distances along the path and to its left [m]."""
    along, beside = np.empty(len(x_m)), np.empty(len(x_m))
    at = 0
    for row, (x, y) in enumerate(zip(x_m.tolist(), y_m.tolist(), strict=True)):
        low = max(at - _NEAR, 0)
        dx, dy = x - path.x_m[low : at + _NEAR + 1], y - path.y_m[low : at + _NEAR + 1]
        nearest = int(np.argmin(dx**2 + dy**2))
        at = low + nearest
        cos, sin = math.cos(path.heading_rad[at]), math.sin(path.heading_rad[at])
        along[row] = path.s_m[at] + dx[nearest] * cos + dy[nearest] * sin
        beside[row] = dy[nearest] * cos - dx[nearest] * sin
    return along, beside


def track_over_x(recording: RecordingLike, x_m: Array) -> Array:
    """Return the lateral position of the front axle centre when it first passes each x [m], shape (n,)."""
    # The values of x ascend; y is nan where the run never gets there.
    x, y = front_axle(recording)
    # A car that spins may go back: only samples ahead of all earlier ones count.
    ahead = np.concatenate([[True], x[1:] > np.maximum.accumulate(x)[:-1]])
    return np.interp(x_m, x[ahead], y[ahead], left=math.nan, right=math.nan)


def largest_difference(first: RecordingLike, second: RecordingLike, from_x_m: float, to_x_m: float) -> float:
    """Return the largest lateral distance between two tracks at the same x [m], or nan if a track is too short."""
    x = np.linspace(from_x_m, to_x_m, max(2, math.ceil((to_x_m - from_x_m) / 0.1) + 1))
    return float(np.abs(track_over_x(first, x) - track_over_x(second, x)).max())


BEFORE_M: Final = 20.0
AFTER_M: Final = 50.0
"""Length of the road before the first gate and after the last gate [m]."""
BESIDE_M: Final = 2.0
"""Width of the road next to the course [m]. A car further off is outside the plot."""


class CourseView(NamedTuple):
    """Geometry of a course in a figure."""

    x_m: tuple[float, float]  # limits of x [m]
    y_m: tuple[float, float]  # limits of y [m]
    path_x_m: Array  # world x of the path, extended straight to the ends of the picture [m], shape (n,)
    path_y_m: Array  # world y of the path [m], shape (n,)


def view_of(course: Course) -> CourseView:
    """Return the part of a course to show: all gates, or the whole path of a course without gates."""
    path = course.path
    sides = [y for lane in course.lanes for y in (lane.right_y_m, lane.left_y_m)]
    every_y = np.concatenate([path.y_m, course.cones_m[:, 1], sides])
    low, high = float(every_y.min()) - BESIDE_M, float(every_y.max()) + BESIDE_M
    if course.last_gate_x_m is None:
        left, right = float(path.x_m.min()) - BESIDE_M, float(path.x_m.max()) + BESIDE_M
    else:
        left, right = course.first_gate_x_m - BEFORE_M, course.last_gate_x_m + AFTER_M
    return CourseView((left, right), (low, high), *path.extended(right - left))


TIME_TOLERANCE_S: Final = 0.02
"""Tolerance in time, to either side [s]; agreed for comparisons with another code."""


def corridor(time_s: Array, values: Array, width: float | Array) -> tuple[Array, Array]:
    """Return the lower and the upper edge of a tolerance corridor around a signal."""
    fine = np.linspace(-TIME_TOLERANCE_S, TIME_TOLERANCE_S, 9)
    moved = np.stack([np.interp(time_s + shift, time_s, values) for shift in fine])
    return moved.min(axis=0) - width, moved.max(axis=0) + width

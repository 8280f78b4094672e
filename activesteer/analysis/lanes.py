"""Whether a car keeps within lanes, and how it passes cones."""

from __future__ import annotations

import math

import numpy as np

from activesteer.analysis.source import RecordingLike
from activesteer.conventions import CORNERS, Array
from activesteer.road.course import CONE_RADIUS_M, Course
from activesteer.road.footprint import Footprint


def lane_overstep(recording: RecordingLike, course: Course, car: Footprint) -> float:
    """How far a wheel gets beyond the side of a lane at most.

    A wheel counts while its contact point is between the two ends of a lane. Its outer side is half the tyre's width
    from the contact point.

    Args:
        recording: The run.
        course: Its course, with lanes.
        car: Its car.

    Returns:
        Largest distance beyond a side [m]; below 0 it is the smallest distance to one. nan where no wheel is ever
        inside a lane.
    """
    oversteps = [math.nan]
    for index, corner in enumerate(CORNERS):
        x, y = _contact(recording, corner)
        half_m = 0.5 * car.tyre_width_m[index // 2]
        for lane in course.lanes:
            inside = y[(x >= lane.start_x_m) & (x <= lane.end_x_m)]
            if inside.size:
                oversteps.append(float(inside.max()) + half_m - lane.left_y_m)
                oversteps.append(lane.right_y_m - float(inside.min()) + half_m)
    return float(np.nanmax(oversteps)) if len(oversteps) > 1 else math.nan


def all_wheels_in_lanes(recording: RecordingLike, course: Course, car: Footprint) -> bool:
    """Whether all four wheels go through every lane to its end and none gets beyond a side.

    A car that turns round before the last lane oversteps nothing there, but it has not kept to the lanes.
    """
    for corner in CORNERS:
        x, _ = _contact(recording, corner)
        for lane in course.lanes:
            if not ((x >= lane.start_x_m) & (x <= lane.end_x_m)).any() or not (x > lane.end_x_m).any():
                return False
    return lane_overstep(recording, course, car) <= 0.0


def cone_distances(recording: RecordingLike, course: Course, car: Footprint) -> Array:
    """Smallest distance between the side of each cone and the body of the car.

    The body is a rectangle of the car's width with a usual overhang beyond the axles (`Footprint`). A cone is a disc of
    `CONE_RADIUS_M` around its point; one on the side of a lane is the point itself, since a lane's width is measured
    between the sides of its cones.

    Returns:
        Distance [m], shape (number of cones,); 0 or less where the cone is hit, by how far the body covers it.
    """
    front_x, front_y, yaw = (
        np.asarray(recording[name], dtype=np.float64) for name in ("front_axle_x_m", "front_axle_y_m", "yaw_rad")
    )
    cos, sin = np.cos(yaw), np.sin(yaw)
    middle_m = 0.5 * (car.front_m + car.rear_m)
    half_length_m = car.front_m - middle_m
    distances = np.empty(len(course.cones_m))
    for index, (x, y) in enumerate(course.cones_m):
        ahead = (x - front_x) * cos + (y - front_y) * sin
        left = (y - front_y) * cos - (x - front_x) * sin
        beyond = np.abs(ahead - middle_m) - half_length_m
        beside = np.abs(left) - 0.5 * car.width_m
        outside = np.hypot(np.maximum(beyond, 0.0), np.maximum(beside, 0.0))
        distances[index] = (outside + np.minimum(np.maximum(beyond, beside), 0.0)).min()
    return distances - np.where(course.on_lane_side(), 0.0, CONE_RADIUS_M)


def _contact(recording: RecordingLike, corner: str) -> tuple[Array, Array]:
    x, y = (np.asarray(recording[f"{corner}_contact_{axis}_m"], dtype=np.float64) for axis in "xy")
    return x, y

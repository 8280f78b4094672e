"""The part of a course that a picture shows."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from activesteer.conventions import Array
from activesteer.road.course import Course

BEFORE_M: Final = 20.0
AFTER_M: Final = 50.0
"""Length of the road before the first gate and after the last gate [m]."""
BESIDE_M: Final = 2.0
"""Width of the road beside the course [m]; a car further off is outside the picture."""


class CourseView(NamedTuple):
    """A course as it is drawn.

    Attributes:
        x_m: Limits of x [m].
        y_m: Limits of y [m].
        path_x_m: World x of the path, extended straight to the ends of the picture [m], shape (n,).
        path_y_m: World y of the path [m], shape (n,).
    """

    x_m: tuple[float, float]
    y_m: tuple[float, float]
    path_x_m: Array
    path_y_m: Array


def view_of(course: Course) -> CourseView:
    """Return the view from before the first gate to behind the last gate, or of the whole path without gates."""
    path = course.path
    sides = [y for lane in course.lanes for y in (lane.right_y_m, lane.left_y_m)]
    every_y = np.concatenate([path.y_m, course.cones_m[:, 1], sides])
    low, high = float(every_y.min()) - BESIDE_M, float(every_y.max()) + BESIDE_M
    if course.last_gate_x_m is None:
        left, right = float(path.x_m.min()) - BESIDE_M, float(path.x_m.max()) + BESIDE_M
    else:
        left, right = course.first_gate_x_m - BEFORE_M, course.last_gate_x_m + AFTER_M
    return CourseView((left, right), (low, high), *path.extended(right - left))

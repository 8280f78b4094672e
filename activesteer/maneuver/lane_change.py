"""Double lane change (ISO 3888): into the neighbouring lane and back, at constant speed or coasting."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated, ClassVar, Final, Literal

import numpy as np

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.along_course import AlongCourse, Width, known_width
from activesteer.maneuver.base import SIGNS, Side
from activesteer.maneuver.iso_3888 import LaneStandard, cones, lanes
from activesteer.maneuver.least_jerk import Bound, least_jerk
from activesteer.road.course import Course
from activesteer.road.lane import Lane
from activesteer.road.path import Path
from activesteer.signals import Setpoint

_AXLES_M: Final = (1.3, -1.3)
"""Axles of a car of 2.6 m wheelbase ahead of its centre [m]: there its sides keep the margin."""
_BOUND_SPACING_M: Final = 0.5
_BEYOND_M: Final = 0.1
"""Length of the bounds beyond both ends of a lane [m]: a front wheel is ahead of its axle while the car turns."""
_SAMPLE_M: Final = 0.5
_SLACK_M: Final = 0.01
"""Room that a margin must leave in the narrowest lane [m]."""


@dataclass(frozen=True)
class LaneLayout:
    """The lanes and the path through them."""

    OVERRULED: ClassVar = {"margin_m": {"path": "middle"}}

    standard: LaneStandard = "iso_3888_1"
    """Standard of the lanes: `iso_3888_1` (double lane change) or `iso_3888_2` (obstacle avoidance)."""
    side: Side = "left"
    """Side of the first lane change: `left` or `right`."""
    entry_m: Annotated[float, Range(0.0, 1000.0)] = 30.0
    """Distance from the start to the entry lane, straight ahead [m]."""
    path: Literal["middle", "least_jerk"] = "middle"
    """Path to follow: the `middle` of the lanes, changed in the sections between them, or the path of `least_jerk` that
    keeps the margin."""
    margin_m: Annotated[float, Range(0.0, 1.0)] = 0.1
    """Smallest distance of the car's sides, at its axles, from the edges of the lanes; path of least jerk only [m]."""
    length_factor: Annotated[float, Range(0.5, 2.0)] = 1.0
    """Factor on all lengths of the standard's course, for courses that only resemble it [-]."""
    offset_factor: Annotated[float, Range(0.5, 2.0)] = 1.0
    """Factor on the offset of the standard's lanes, for courses that only resemble it [-]."""
    throttle_off_m: Annotated[float, Range(0.0, 1000.0)] | None = None
    """Distance into the entry lane at which the car begins to coast, 2 m in ISO 3888-2 [m]. Default: the speed is
    held."""


@dataclass(frozen=True, kw_only=True)
class LaneChange(AlongCourse):
    """A double lane change."""

    lane: LaneLayout = LaneLayout()
    """The lanes."""
    vehicle_width_m: Width | None = None
    """Width of the vehicle, for which the lanes are laid out [m]. Default: the width in the vehicle file."""

    def setpoint(self, time_s: float) -> Setpoint:
        """Path and speed, or the path without throttle."""
        return self._setpoint if time_s < self._throttle_off_s else self._coasting

    @cached_property
    def _throttle_off_s(self) -> float:
        off_m = self.lane.throttle_off_m
        return math.inf if off_m is None else (self.lane.entry_m + off_m) / self.speed_mps

    @cached_property
    def _coasting(self) -> Setpoint:
        return self._setpoint._replace(hold_speed=False)

    def _make_course(self) -> Course:
        layout, width = self.lane, known_width(self.vehicle_width_m)
        # Laid out to the left and then mirrored, so that left and right agree to the last digit.
        left = self._lanes(width, 1.0)
        if layout.path == "middle":
            path_x, path_y = _middle(left)
        else:
            self._check_margin(left, width)
            path_x, path_y = _least_jerk_path(left, 0.5 * width + layout.margin_m)
        side = SIGNS[layout.side]
        course = self._lanes(width, side)
        return Course(Path.through(path_x, side * path_y), course, cones(course), course[-1].end_x_m)

    def _lanes(self, width: float, side: float) -> tuple[Lane, ...]:
        layout = self.lane
        return lanes(layout.standard, width, layout.entry_m, side, layout.length_factor, layout.offset_factor)

    def _check_margin(self, course: Sequence[Lane], width: float) -> None:
        narrowest = min(course, key=lambda lane: lane.left_y_m - lane.right_y_m)
        lane_width = narrowest.left_y_m - narrowest.right_y_m
        maximum = 0.5 * (lane_width - width) - _SLACK_M
        if self.lane.margin_m > maximum:
            raise ManeuverError(
                f"is {self.lane.margin_m:g} m, but the {narrowest.name} is {lane_width:.3g} m wide and "
                f"the car {width:g} m; allowed is 0 to {maximum:.3f} m",
                key="lane.margin_m",
                value=self.lane.margin_m,
                allowed=Range(0.0, maximum),
            )


def _middle(course: Sequence[Lane]) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle of the lanes, with quintics between them that join without heading and curvature."""
    end = course[-1].end_x_m
    x = np.linspace(0.0, end, math.ceil(end / _SAMPLE_M) + 1)
    middles = [0.5 * (lane.right_y_m + lane.left_y_m) for lane in course]
    y = np.zeros_like(x)
    for (before, after), (low, high) in zip(pairwise(course), pairwise(middles), strict=True):
        fraction = np.clip((x - before.end_x_m) / (after.start_x_m - before.end_x_m), 0.0, 1.0)
        y += (high - low) * fraction**3 * (10.0 + fraction * (6.0 * fraction - 15.0))
    return x, y


def _least_jerk_path(course: Sequence[Lane], half_width_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a straight line to the first lane, then the path of least jerk to the middle of the last lane's end."""
    start, end = course[0].start_x_m, course[-1].end_x_m
    end_y = 0.5 * (course[-1].right_y_m + course[-1].left_y_m)
    path = least_jerk(start, end, end_y, list(_bounds(course, half_width_m)))
    before = np.linspace(0.0, start, math.ceil(start / _SAMPLE_M), endpoint=False)
    along = np.linspace(start, end, math.ceil((end - start) / _SAMPLE_M) + 1)
    return np.concatenate([before, along]), np.concatenate([np.zeros(len(before)), path(along)])


def _bounds(course: Sequence[Lane], half_width_m: float) -> Iterator[Bound]:
    for lane in course:
        first, last = lane.start_x_m - _BEYOND_M, lane.end_x_m + _BEYOND_M
        for x in np.linspace(first, last, math.ceil((last - first) / _BOUND_SPACING_M) + 1).tolist():
            for ahead in _AXLES_M:
                yield Bound(x - ahead, ahead, lane.right_y_m + half_width_m, lane.left_y_m - half_width_m)

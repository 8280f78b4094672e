"""Lanes and cones of the double lane changes of ISO 3888.

| section | ISO 3888-1: length, width | ISO 3888-2: length, width |
|---|---|---|
| 1 entry lane | 15 m, 1.1 b + 0.25 m | 12 m, 1.1 b + 0.25 m |
| 2 | 30 m | 13.5 m |
| 3 side lane | 25 m, 1.2 b + 0.25 m | 11 m, b + 1 m |
| 4 | 25 m | 12.5 m |
| 5 exit lane | 15 m + 15 m, 1.3 b + 0.25 m | 12 m, 3 m |

b is the width of the vehicle. Sources differ in some points; this file chooses the following. ISO 3888-1: the offset of
3.5 m is between the centre lines, and the exit lane has the centre line of the entry lane. ISO 3888-2: the offset of
1 m is between the facing edges of entry lane and side lane. The exit lane is 3 m wide (elsewhere 1.3 b + 0.25 m), and
its edge away from the side lane is in line with the same edge of the entry lane (as in Project Chrono).

Source: ISO 3888-1 and ISO 3888-2, Passenger cars - Test track for a severe lane-change manoeuvre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.road.lane import Lane

LaneStandard = Literal["iso_3888_1", "iso_3888_2"]
_CONE_SPACING_M: Final = 5.0
"""Largest distance between cones along a lane [m]."""


class _Section(NamedTuple):
    name: str
    start_m: float
    length_m: float
    width_m: float
    centre_m: float


def lanes(
    standard: LaneStandard,
    vehicle_width_m: float,
    start_x_m: float,
    side: float,
    length_factor: float = 1.0,
    offset_factor: float = 1.0,
) -> tuple[Lane, ...]:
    """Return entry, side and exit lane.

    The centre line of the entry lane is y = 0. The side is 1 for a side lane on the left, -1 on the right. The offset
    of side lane and exit lane has a factor of its own.
    """
    b = vehicle_width_m
    entry, exit_first = 1.1 * b + 0.25, 1.3 * b + 0.25
    if standard == "iso_3888_1":
        sections = (
            _Section("entry lane", 0.0, 15.0, entry, 0.0),
            _Section("side lane", 45.0, 25.0, 1.2 * b + 0.25, 3.5),
            _Section("exit lane", 95.0, 30.0, exit_first, 0.0),
        )
    else:
        aside, back = b + 1.0, 3.0
        sections = (
            _Section("entry lane", 0.0, 12.0, entry, 0.0),
            _Section("side lane", 25.5, 11.0, aside, 0.5 * entry + 1.0 + 0.5 * aside),
            _Section("exit lane", 49.0, 12.0, back, 0.5 * (back - entry)),
        )
    return tuple(_lane(section, start_x_m, length_factor, side * offset_factor) for section in sections)


def _lane(section: _Section, start_x_m: float, along: float, aside: float) -> Lane:
    start = start_x_m + along * section.start_m
    centre, half = aside * section.centre_m, 0.5 * section.width_m
    return Lane(section.name, start, start + along * section.length_m, centre - half, centre + half)


def cones(course: Sequence[Lane]) -> NDArray[np.float64]:
    """Return the points at which cones touch the edges of lanes: at both ends, and at most 5 m apart in between.

    By the standards the edges of a lane are tangents to the feet of its cones.

    Returns:
        World x and y of the cones [m], shape (number of cones, 2).
    """
    points: list[tuple[float, float]] = []
    for lane in course:
        gaps = math.ceil((lane.end_x_m - lane.start_x_m) / _CONE_SPACING_M)
        for number in range(gaps + 1):
            x = lane.start_x_m + (lane.end_x_m - lane.start_x_m) * number / gaps
            points += [(x, lane.right_y_m), (x, lane.left_y_m)]
    return np.array(points)

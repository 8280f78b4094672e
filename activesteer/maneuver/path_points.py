"""Points of a user's path: read from a CSV, and checked before a car follows them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, NoReturn

from activesteer.errors import ManeuverError
from activesteer.maneuver.base import read_columns

COLUMNS: Final = ("x_m", "y_m")
"""Columns that a CSV must have."""
OPTIONAL: Final = ("speed_mps", "width_m")
"""Columns that a CSV may have. Others are ignored."""

MIN_POINTS: Final = 4
_MAX_GAP_M: Final = 20.0
"""Largest distance of two points. A larger one counts as a jump [m]."""
_MIN_GAP_M: Final = 1e-3
_MAX_TURN_RAD: Final = math.radians(90.0)
"""Largest turn at a point. A larger one counts as going back [rad]."""
_MIN_RADIUS_M: Final = 6.0
"""Smallest radius. A tighter bend counts as a kink. A car of the compact class turns on 5.2 m [m]."""
_MAX_START_M: Final = 1.0
"""Largest distance of the first point from the car [m]."""
_MAX_START_RAD: Final = math.radians(15.0)
"""Largest angle of the first section to the car's heading [rad]."""


def read_csv(path: Path) -> tuple[dict[str, list[float]], list[int]]:
    """Read the points from a CSV with the header x_m,y_m, and speed and width there if it has such columns."""
    return read_columns(path, COLUMNS, OPTIONAL)


def check_points(x_m: Sequence[float], y_m: Sequence[float], place: Callable[[int], str]) -> None:
    """Check that a car can start on the path and follow it."""
    count = len(x_m)
    if count != len(y_m) or count < MIN_POINTS:
        raise ManeuverError(
            f"the path has {count} x_m and {len(y_m)} y_m; as many of each are needed, at least {MIN_POINTS}",
            value=(count, len(y_m)),
        )

    def fail(index: int, problem: str) -> NoReturn:
        point = x_m[index], y_m[index]
        raise ManeuverError(f"{place(index)}: the point ({point[0]:g}, {point[1]:g}) m {problem}", value=point)

    gaps = [math.hypot(x_m[i + 1] - x_m[i], y_m[i + 1] - y_m[i]) for i in range(count - 1)]
    for i, gap in enumerate(gaps, 1):
        if gap < _MIN_GAP_M:
            fail(i, "is the same as the point before; leave one of them out")
        if gap > _MAX_GAP_M:
            fail(i, f"is {gap:.3g} m from the point before; at most {_MAX_GAP_M:g} m are allowed, add points")
    for i in range(1, count - 1):
        ahead = math.atan2(y_m[i + 1] - y_m[i], x_m[i + 1] - x_m[i])
        behind = math.atan2(y_m[i] - y_m[i - 1], x_m[i] - x_m[i - 1])
        turn = abs(math.remainder(ahead - behind, math.tau))
        if turn > _MAX_TURN_RAD:
            fail(i, f"turns the path back, by {math.degrees(turn):.0f} deg; are the points in the order of travel?")
        # Radius of the circle through this point and its neighbours: chord over twice the sine of the angle between.
        chord = math.hypot(x_m[i + 1] - x_m[i - 1], y_m[i + 1] - y_m[i - 1])
        if 2.0 * math.sin(turn) * _MIN_RADIUS_M > chord:
            radius = chord / (2.0 * math.sin(turn))
            fail(i, f"is a kink of {radius:.2g} m radius; at least {_MIN_RADIUS_M:g} m are needed, round it off")
    if math.hypot(x_m[0], y_m[0]) > _MAX_START_M:
        fail(
            0,
            f"is {math.hypot(x_m[0], y_m[0]):.3g} m from the car: the path must begin at the car, at (0, 0), at most "
            f"{_MAX_START_M:g} m off; shift it by ({-x_m[0]:g}, {-y_m[0]:g}) m",
        )
    heading = math.atan2(y_m[1] - y_m[0], x_m[1] - x_m[0])
    if abs(heading) > _MAX_START_RAD:
        fail(
            0,
            f"begins with a heading of {math.degrees(heading):.0f} deg: the car starts along x, the path may be at "
            f"most {math.degrees(_MAX_START_RAD):g} deg off; turn it by {-math.degrees(heading):.0f} deg about (0, 0)",
        )

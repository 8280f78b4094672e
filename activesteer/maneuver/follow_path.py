"""Manoeuvres along a path: points, circle, free path."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path as FilePath
from typing import Annotated, Any, ClassVar, Final, NoReturn

import numpy as np

from activesteer.config import Range
from activesteer.core.conventions import Array
from activesteer.core.path import Path
from activesteer.core.signals import Setpoint
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver, NamedFile, read_columns, within
from activesteer.maneuver.lane_changes import AlongCourse
from activesteer.road.course import Course
from activesteer.road.native_path import PathSearch

_WINDOW_M: Final = 5.0
"""Distance to either side of the last position in which the car is searched [m]. A path may therefore cross itself."""
_COAST_MPS2: Final = 0.7
"""Deceleration that drag and engine give without the brake [m/s2]."""
_PEDAL_PER_MPS2: Final = 1.0 / 13.0
"""Pedal over deceleration of a typical car [s2/m]: 0.38 gives 5 m/s2 in `brake_in_turn`."""
_PEDAL_PER_MPS: Final = 0.08
"""Pedal position per excess speed [s/m]."""
_FREE_MPS: Final = 0.3
"""Excess speed up to which no brake is needed [m/s]."""


COLUMNS: Final = ("x_m", "y_m")
"""Columns that a CSV must have."""
OPTIONAL: Final = ("speed_mps", "width_m")
"""Columns that a CSV may have. Others are ignored."""

MIN_POINTS: Final = 4
_MAX_GAP_M: Final = 20.0
"""Largest distance between two points. A larger gap counts as a jump [m]."""
_MIN_GAP_M: Final = 1e-3
_MAX_TURN_RAD: Final = math.radians(90.0)
"""Largest turn at a point. A larger turn counts as going back [rad]."""
_MIN_RADIUS_M: Final = 6.0
"""Smallest radius. A tighter bend counts as a kink. A car of the compact class turns on 5.2 m [m]."""
_MAX_START_M: Final = 1.0
"""Largest distance of the first point from the car [m]."""
_MAX_START_RAD: Final = math.radians(15.0)
"""Largest angle between the first section and the car's heading [rad]."""


def check_points(x_m: Sequence[float], y_m: Sequence[float], place: Callable[[int], str]) -> None:
    """Check that a car can start on the path and follow it."""
    count = len(x_m)
    if count != len(y_m) or count < MIN_POINTS:
        raise ManeuverError(
            f"the path has {count} x_m and {len(y_m)} y_m; equal numbers are needed, at least {MIN_POINTS}",
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
            fail(i, f"is {gap:.3g} m from the point before; at most {_MAX_GAP_M:g} m are allowed, so add points")
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
            fail(i, f"is a kink of {radius:.2g} m radius; at least {_MIN_RADIUS_M:g} m are needed, so round it off")
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
            f"begins with a heading of {math.degrees(heading):.0f} deg: the car starts along x, and the path may be at "
            f"most {math.degrees(_MAX_START_RAD):g} deg off; turn it by {-math.degrees(heading):.0f} deg about (0, 0)",
        )


def _read_points(file: FilePath) -> dict[str, Any]:
    """Read the points from a CSV with the columns x_m and y_m, and optional columns for speed and width."""
    columns, lines = read_columns(file, COLUMNS, OPTIONAL)
    check_points(columns["x_m"], columns["y_m"], lambda index: f"{file.name}, line {lines[index]}")
    return columns


class PathSpeed:
    """Setpoints of one run along a path with speeds; a path has no phases."""

    def __init__(self, maneuver: Maneuver, path: Path, speed_mps: Array) -> None:
        self.maneuver, self.present = maneuver, maneuver.setpoint(0.0)
        self.began: list[tuple[float, str]] = []
        self._search, self._along_m = PathSearch(path), 0.0
        self._s_m, self._speed_mps = path.s_m, speed_mps
        self._acceleration_mps2 = speed_mps * np.gradient(speed_mps, path.s_m)

    def setpoint(self, time_s: float, seen: Sequence[float]) -> Setpoint:
        """Return the setpoint for the current position of the car (see `PhaseSequence.setpoint`)."""
        speed_mps, x_m, y_m = seen[3:6]
        self._along_m = self._search.nearest(x_m, y_m, self._along_m, _WINDOW_M)
        wanted_mps = float(np.interp(self._along_m, self._s_m, self._speed_mps))
        deceleration = -float(np.interp(self._along_m, self._s_m, self._acceleration_mps2, right=0.0)) - _COAST_MPS2
        excess_mps = speed_mps - wanted_mps - _FREE_MPS
        pedal = _PEDAL_PER_MPS2 * max(deceleration, 0.0) + _PEDAL_PER_MPS * excess_mps if excess_mps > -2.0 else 0.0
        pedal = within(pedal, 1.0)
        self.present = self.maneuver.setpoint(time_s)._replace(
            speed_demand_mps=wanted_mps, brake_pedal=pedal, hold_speed=pedal == 0.0
        )
        return self.present

    def __deepcopy__(self, memo: dict[int, Any]) -> PathSpeed:
        return copy.copy(self)


@dataclass(frozen=True)
class PathTable:
    """Points in the order of travel, from (0, 0) along x."""

    csv: str | None = None
    """CSV file with the columns x_m and y_m, optionally also speed_mps (or speed_kmh) and width_m: a path, or a name
    in the manoeuvre's folder."""
    x_m: tuple[float, ...] | None = None
    """World x of the points [m]. Default: the points of the CSV."""
    y_m: tuple[float, ...] | None = None
    """World y, left positive [m]."""
    speed_mps: Annotated[tuple[float, ...] | None, Range(1.0, 100.0)] = None
    """Speeds at the points [m/s], linear along the path between them. Default: the speed of the manoeuvre."""
    width_m: Annotated[tuple[float, ...] | None, Range(1.0, 100.0)] = None
    """Widths of the road at the points [m], with the path in the middle; for evaluation."""

    def __post_init__(self) -> None:
        """Check that the points form a path."""
        if self.x_m is None or self.y_m is None:
            raise ManeuverError("csv (a file with the columns x_m and y_m) or both lists x_m and y_m are needed")
        check_points(self.x_m, self.y_m, lambda index: f"point {index + 1}")
        for key in OPTIONAL:
            values = getattr(self, key)
            if values is not None and len(values) != len(self.x_m):
                raise ManeuverError(f"has {len(values)} values for {len(self.x_m)} points", key=key)


@dataclass(frozen=True, kw_only=True)
class FollowPath(AlongCourse, kind="follow_path"):
    """A path through given points."""

    path: PathTable
    """Points of the path."""

    FILES: ClassVar = (NamedFile(("path", "csv"), (*COLUMNS, *OPTIONAL), _read_points, "path"),)

    @cached_property
    def course(self) -> Course:
        """The path, and the road along it."""
        path = Path.through(self.path.x_m or (), self.path.y_m or ())
        return Course(path, width_m=self._along(path, self.path.width_m))

    def _along(self, path: Path, values: tuple[float, ...] | None) -> Array | None:
        """Interpolate values at the given points to the resampled path."""
        if values is None:
            return None
        chords = np.hypot(np.diff(self.path.x_m or ()), np.diff(self.path.y_m or ()))
        at = np.concatenate([[0.0], np.cumsum(chords)])
        return np.interp(path.s_m, at * (path.length_m / at[-1]), values)

    def sequence(self) -> PathSpeed | None:
        """Return the speed sequence along the path, or None if the path has no speeds."""
        path = self.course.path
        speeds_mps = self._along(path, self.path.speed_mps)
        return None if speeds_mps is None else PathSpeed(self, path, speeds_mps)


@dataclass(frozen=True)
class Circle:
    """Circle, and the speed on it."""

    radius_m: Annotated[float, Range(-2000.0, 2000.0)] = 100.0
    """Radius of the path of the centre of gravity [m], positive to the left."""
    entry_s: Annotated[float, Range(0.1, 60.0)] = 4.0
    """Time in which the curvature rises from zero to its value on the circle, at the initial speed [s]."""
    acceleration_mps2: Annotated[float, Range(0.01, 2.0)] = 0.4
    """Rate of change of the speed after the entry [m/s2]."""
    end_speed_mps: Annotated[float, Range(0.0, 100.0)] = 30.0
    """Final speed [m/s]."""


@dataclass(frozen=True, kw_only=True)
class ConstantRadius(Maneuver, kind="constant_radius"):
    """A circle at a slowly rising speed."""

    circle: Circle = Circle()
    """Circle, and speed on it."""

    def __post_init__(self) -> None:
        """Check that a car can drive the circle and that its speed rises."""
        circle = self.circle
        if abs(circle.radius_m) < 10.0:
            raise ManeuverError(
                f"is {circle.radius_m:g} m; at least 10 m to either side are needed",
                key="circle.radius_m",
                value=circle.radius_m,
            )
        if circle.end_speed_mps <= self.speed_mps:
            raise ManeuverError(
                f"is {3.6 * circle.end_speed_mps:g} km/h; it must be above the speed at the "
                f"start, {3.6 * self.speed_mps:g} km/h (speed_kmh)",
                key="circle.end_speed_kmh",
                value=3.6 * circle.end_speed_mps,
            )

    def setpoint(self, time_s: float) -> Setpoint:
        """Return curvature and speed (see the base class)."""
        circle = self.circle
        fraction = within(time_s / circle.entry_s, 1.0)
        # Half a wave of a cosine: the curvature has no kink at the start and the end of the rise.
        curvature = 0.5 * (1.0 - math.cos(math.pi * fraction)) / circle.radius_m
        rising_s = max(time_s - circle.entry_s, 0.0)
        speed = min(self.speed_mps + rising_s * circle.acceleration_mps2, circle.end_speed_mps)
        return Setpoint(0.0, speed, 0.0, True, curvature)

    def settling_setpoint(self) -> Setpoint:
        """Return the initial setpoint, straight ahead."""
        return self.setpoint(0.0)

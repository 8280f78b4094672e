"""The course of a road and its profile."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range, check_points
from activesteer.core.conventions import Array
from activesteer.core.limits import fail, number, numbers, sequence, table_of, text
from activesteer.core.path import MIN_CHORD_M, Path
from activesteer.errors import ManeuverError
from activesteer.road.obstacles import Grid


class Lane(NamedTuple):
    """A lane between two rows of cones, along the world's x [m]."""

    name: str
    start_x_m: float
    end_x_m: float
    right_y_m: float
    left_y_m: float

    def outline_m(self) -> NDArray[np.float64]:
        """Return the corners of the lane as a closed line in world axes [m], shape (5, 2)."""
        (start, end), (right, left) = self[1:3], self[3:]
        return np.array([(start, right), (end, right), (end, left), (start, left), (start, right)])


CONE_RADIUS_M: Final = 0.145
"""Half the side of the square base of a traffic cone of height `CONE_HEIGHT_M` [m]."""
CONE_HEIGHT_M: Final = 0.5
_ON_SIDE_M: Final = 1e-3
"""Largest distance of a cone from the side of a lane that the cone marks [m]."""


@dataclass(frozen=True, eq=False)
class Course:
    """Path of the centre of gravity, lanes and cones (n, 2) in the world frame, from the origin along x."""

    path: Path
    lanes: tuple[Lane, ...] = ()
    cones_m: Array = field(default_factory=lambda: np.empty((0, 2)))
    last_gate_x_m: float | None = None
    width_m: Array | None = None  # of the road, at the points of the path

    @property
    def first_gate_x_m(self) -> float:
        """Start of the first lane or, without lanes, of the first cone [m]."""
        if self.lanes:
            return min(lane.start_x_m for lane in self.lanes)
        return float(self.cones_m[:, 0].min()) if len(self.cones_m) else 0.0

    def row_m(self) -> Array:
        """Return the cones that mark no lane, such as the cones of a slalom [m], shape (n, 2)."""
        return self.cones_m[~self.on_lane_side()]

    def on_lane_side(self) -> NDArray[np.bool_]:
        """Return the mask of the cones that mark a lane."""
        return self._outward() != 0.0

    def cone_centres_m(self) -> Array:
        """Return the centres of the cones [m], outside the lanes that they mark, shape (n, 2)."""
        return np.column_stack([self.cones_m[:, 0], self.cones_m[:, 1] + CONE_RADIUS_M * self._outward()])

    def _outward(self) -> Array:
        """Return the side of each cone: 1 on the left of a lane, -1 on the right, 0 elsewhere."""
        x, y = self.cones_m.T
        outward = np.zeros(len(x))
        for lane in self.lanes:
            along = (x >= lane.start_x_m - _ON_SIDE_M) & (x <= lane.end_x_m + _ON_SIDE_M)
            outward[along & (np.abs(y - lane.left_y_m) < _ON_SIDE_M)] = 1.0
            outward[along & (np.abs(y - lane.right_y_m) < _ON_SIDE_M)] = -1.0
        return outward

    def to_table(self) -> dict[str, Any]:
        """Return the course as plain tables, as a recording stores it."""
        return {
            "path": {"x_m": self.path.x_m.tolist(), "y_m": self.path.y_m.tolist()},
            "lanes": [lane._asdict() for lane in self.lanes],
            "cones": self.cones_m.tolist(),
            "last_gate_x_m": self.last_gate_x_m,
            **({} if self.width_m is None else {"width_m": self.width_m.tolist()}),
        }

    @classmethod
    def from_table(cls, table: object) -> Course:
        """Create the course that `to_table` describes."""
        course = table_of(table, "course")
        path = table_of(course.get("path"), "course.path")
        x_m, y_m = (numbers(path.get(key), f"course.path.{key}") for key in ("x_m", "y_m"))
        if len(x_m) != len(y_m) or len(x_m) < 2:
            raise fail("course.path", f"has {len(x_m)} x_m and {len(y_m)} y_m; equal numbers are needed, at least 2")
        if (np.hypot(np.diff(x_m), np.diff(y_m)) < MIN_CHORD_M).any():
            raise fail("course.path", "has two points in a row that are the same")
        lanes = sequence(course.get("lanes", ()), "course.lanes")
        cones = sequence(course.get("cones", ()), "course.cones")
        places = [numbers(cone, f"course.cones.{index}", count=2) for index, cone in enumerate(cones)]
        last, widths = course.get("last_gate_x_m"), course.get("width_m")
        return cls(
            Path.between(x_m, y_m),
            tuple(_lane(lane, f"course.lanes.{index}") for index, lane in enumerate(lanes)),
            np.reshape(places, (-1, 2)),
            None if last is None else number(last, "course.last_gate_x_m"),
            None if widths is None else numbers(widths, "course.width_m", 0.0, count=len(x_m)),
        )


def course_of(metadata: Mapping[str, Any]) -> Course | None:
    """Return the course of a recorded run, or None if its manoeuvre has no course."""
    table = metadata.get("course")
    return None if table is None else Course.from_table(table)


def _lane(table: object, key: str) -> Lane:
    lane = table_of(table, key)
    sides = [number(lane.get(field), f"{key}.{field}") for field in Lane._fields[1:]]
    found = Lane(text(lane.get("name", ""), f"{key}.name"), *sides)
    if not (found.start_x_m <= found.end_x_m and found.right_y_m <= found.left_y_m):
        raise fail(key, f"is {tuple(sides)}: its end must be after its start, and its left edge left of its right edge")
    return found


FRONT_OVERHANG_M: Final = 0.85
"""Distance from the front axle to the front end of the body [m], usual for the class: recordings do not hold it."""
REAR_OVERHANG_M: Final = 0.75
"""Distance from the rear axle to the rear end of the body [m]; usual for the class."""
_RANGE_M: Final = (0.01, 100.0)


class Footprint(NamedTuple):
    """Dimensions of a car, with usual values for drawing as defaults."""

    width_m: float = 1.8
    wheelbase_m: float = 2.7
    tyre_width_m: tuple[float, float] = (0.2, 0.2)

    @property
    def front_m(self) -> float:
        """Position of the front end of the body, ahead of the front axle [m]."""
        return FRONT_OVERHANG_M

    @property
    def rear_m(self) -> float:
        """Position of the rear end of the body, ahead of the front axle and therefore negative [m]."""
        return -self.wheelbase_m - REAR_OVERHANG_M

    @classmethod
    def from_table(cls, table: object) -> Footprint:
        """Read the dimensions from the table `car` of the metadata."""
        car = table_of(table, "car")
        width, wheelbase = (number(car.get(key), f"car.{key}", *_RANGE_M) for key in ("width_m", "wheelbase_m"))
        front, rear = numbers(car.get("tyre_width_m"), "car.tyre_width_m", *_RANGE_M, count=2).tolist()
        return cls(width, wheelbase, (front, rear))


def footprint_of(metadata: Mapping[str, Any]) -> Footprint | None:
    """Return the dimensions of the car of a recorded run, or None if not recorded."""
    table = metadata.get("car")
    return None if table is None else Footprint.from_table(table)


STEP_M: Final = 0.05
"""Distance of the samples of a profile [m]."""
_MAX_LENGTH_M: Final = 50_000.0
_HIGHEST_M: Final = 1000.0


@dataclass(frozen=True)
class ProfileTable:
    """Height profile of a road.

    Keys of the table [road.heights], which a CSV of `road.profile` fills.

    The road runs smoothly through the points, without overshoot (monotone cubics), and linearly from track to track. It
    is even across outside the tracks.
    """

    s_m: tuple[float, ...]
    """Distances along x or along the path [m], increasing."""
    left_z_m: tuple[float, ...]
    """Heights of the left track [m]."""
    right_z_m: tuple[float, ...] | None = None
    """Heights of the right track [m]. Default: the heights of the left track."""
    track_m: Annotated[float, Range(0.1, 10.0)] = 1.5
    """Distance between the two tracks [m]."""

    def __post_init__(self) -> None:
        """Check the points of the height profile."""
        tracks = {"left_z_m": self.left_z_m, "right_z_m": self.right_z_m}
        check_points("s_m", self.s_m, tracks, Range(2), ManeuverError)
        for key, values in tracks.items():
            if any(abs(value) > _HIGHEST_M for value in values or ()):
                raise ManeuverError(f"has heights beyond +-{_HIGHEST_M:g} m, the largest allowed size", key=key)
        if self.s_m[-1] - self.s_m[0] > _MAX_LENGTH_M:
            raise ManeuverError(
                f"is {self.s_m[-1] - self.s_m[0]:g} m long; at most {_MAX_LENGTH_M:g} m is allowed", key="s_m"
            )

    def grid(self) -> Grid:
        """Return the grid of heights."""
        right = self.left_z_m if self.right_z_m is None else self.right_z_m
        (step, right_z), (_, left_z) = (sampled(self.s_m, track, STEP_M) for track in (right, self.left_z_m))
        return Grid(self.s_m[0], step, -0.5 * self.track_m, self.track_m, np.column_stack([right_z, left_z]))


def sampled(s_m: tuple[float, ...], values: tuple[float, ...], step_m: float) -> tuple[float, Array]:
    """Resample a smooth curve at even positions (monotone cubics), and return the step [m]."""
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - slow to import, and needed for few roads

    count = max(2, math.ceil((s_m[-1] - s_m[0]) / step_m) + 1)
    places, step = np.linspace(s_m[0], s_m[-1], count, retstep=True)
    return float(step), PchipInterpolator(s_m, values)(places)

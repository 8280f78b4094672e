"""Manoeuvres through lanes and cones: double lane changes of ISO 3888, and the slalom.

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

The path is a quintic B-spline y(x) between two straight sections. Its coefficients minimise the integral of y'''^2:
the lateral jerk at constant speed is proportional to y'''. The axles of the car, ahead of and behind its
centre, stay within bounds. This strictly convex quadratic programme is written as a least distance programme.
Non-negative least squares solve it exactly in a finite number of steps.

Source: C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, 1974, chapter 23 (problems LSI and LDP). Minimum
jerk for smooth motion: T. Flash, N. Hogan, The coordination of arm movements, Journal of Neuroscience 5 (1985).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range
from activesteer.core.conventions import Array
from activesteer.core.path import Path
from activesteer.core.signals import Setpoint
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import SIGNS, Maneuver, Side, check_speed
from activesteer.road.course import Course, Lane

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


Width = Annotated[float, Range(0.5, 4.0)]

_MIN_SPEED_MPS: Final = 5.0 / 3.6
"""Speed below which a preview of one or two seconds ends within the car's own length [m/s]."""
_AFTER_S: Final = 3.5
"""Time after the last gate in which the car can be seen to settle [s]."""


@dataclass(frozen=True, kw_only=True)
class AlongCourse(Maneuver):
    """Base of the kinds of manoeuvres that follow a course at constant speed."""

    def __post_init__(self) -> None:
        """Check that the car drives forwards and passes the last gate within the run."""
        check_speed(self.speed_mps, "a course", least_mps=_MIN_SPEED_MPS)
        last = self.course.last_gate_x_m
        if last is not None and self.duration_s * self.speed_mps < last:
            gate_s = last / self.speed_mps
            raise ManeuverError(
                f"is {self.duration_s:g} s, but at {3.6 * self.speed_mps:g} km/h the last gate, {last:g} m "
                f"from the start, is reached at {gate_s:.1f} s; {gate_s + _AFTER_S:.1f} s are needed",
                key="duration_s",
                value=self.duration_s,
                allowed=Range(gate_s + _AFTER_S),
            )

    @cached_property
    @abstractmethod
    def course(self) -> Course:
        """Path, lanes and cones of the course."""

    def setpoint(self, time_s: float) -> Setpoint:
        """Return the path and the speed (see the base class)."""
        return self._setpoint

    @cached_property
    def _setpoint(self) -> Setpoint:
        return self.settling_setpoint()._replace(path=self.course.path)


def known_width(vehicle_width_m: float | None) -> float:
    """Return the vehicle width that sets the width of the lanes [m]."""
    if vehicle_width_m is None:
        raise ManeuverError(
            "is missing; it comes from the vehicle file (width_m) unless it is given here", key="vehicle_width_m"
        )
    return vehicle_width_m


_CONE_SPACING_M: Final = 5.0
"""Largest distance between cones along a lane [m]."""


def lanes(layout: LaneLayout, vehicle_width_m: float, side: float) -> tuple[Lane, ...]:
    """Return entry lane (about y = 0), side lane and exit lane. The side lane is on the left (1) or right (-1)."""
    b = vehicle_width_m
    entry = 1.1 * b + 0.25
    # Name, start, length, width, and offset of the centre line [m].
    if layout.standard == "iso_3888_1":
        sections = (
            ("entry lane", 0.0, 15.0, entry, 0.0),
            ("side lane", 45.0, 25.0, 1.2 * b + 0.25, 3.5),
            ("exit lane", 95.0, 30.0, 1.3 * b + 0.25, 0.0),
        )
    else:
        aside, back = b + 1.0, 3.0
        sections = (
            ("entry lane", 0.0, 12.0, entry, 0.0),
            ("side lane", 25.5, 11.0, aside, 0.5 * entry + 1.0 + 0.5 * aside),
            ("exit lane", 49.0, 12.0, back, 0.5 * (back - entry)),
        )
    found = []
    for name, start_m, length_m, width_m, offset_m in sections:
        start = layout.entry_m + layout.length_factor * start_m
        centre, half = side * layout.offset_factor * offset_m, 0.5 * width_m
        found.append(Lane(name, start, start + layout.length_factor * length_m, centre - half, centre + half))
    return tuple(found)


def cones(course: Sequence[Lane]) -> NDArray[np.float64]:
    """Return points on the lane edges, which the bases of the cones touch, at most 5 m apart."""
    points: list[tuple[float, float]] = []
    for lane in course:
        gaps = math.ceil((lane.end_x_m - lane.start_x_m) / _CONE_SPACING_M)
        for number in range(gaps + 1):
            x = lane.start_x_m + (lane.end_x_m - lane.start_x_m) * number / gaps
            points += [(x, lane.right_y_m), (x, lane.left_y_m)]
    return np.array(points)


_DEGREE: Final = 5
"""Degree of the splines: without active bounds, the path of least jerk is a quintic polynomial."""
_KNOT_SPACING_M: Final = 2.0
"""Distance of the knots [m]. Halving it changes the paths of ISO 3888 by less than 1 cm."""
_INCOMPATIBLE: Final = 1e-9
"""Residual of the dual below which bounds contradict each other. Usual values are above 1e-4."""


class Bound(NamedTuple):
    """Bounds on the lateral position of a point that moves with the car."""

    x_m: float  # position of the car's centre [m]
    ahead_m: float  # distance of the point ahead of the centre, along the path [m]
    low_m: float  # least y of the point [m]
    high_m: float  # largest y of the point [m]


def least_jerk(start_x_m: float, end_x_m: float, end_y_m: float, bounds: Sequence[Bound]) -> BSpline:
    """Return the path y(x) of least jerk from y = 0 to another straight line along x.

    Args:
        start_x_m: Point at which the path leaves y = 0, without heading and curvature [m].
        end_x_m: Point at which it is straight again [m].
        end_y_m: y at this point [m].
        bounds: The bounds; those outside start and end are ignored.

    Returns:
        Spline y(x) [m] between start and end, with its derivatives.

    Validity: small headings; a point ahead is at y + ahead y', its x at x + ahead.
    """
    from scipy.interpolate import BSpline  # noqa: PLC0415 - slow to import, and few manoeuvres need it

    count = max(_DEGREE + 2, round((end_x_m - start_x_m) / _KNOT_SPACING_M))
    knots = np.linspace(start_x_m, end_x_m, count + 1)
    on_knots = partial(BSpline, np.concatenate([[start_x_m] * _DEGREE, knots, [end_x_m] * _DEGREE]), k=_DEGREE)
    basis = on_knots(np.eye(count + _DEGREE))
    # y''' is a parabola between knots: three points of Gauss integrate its square exactly.
    points, weights = np.polynomial.legendre.leggauss(3)
    half = 0.5 * np.diff(knots)[:, None]
    middle = 0.5 * (knots[:-1] + knots[1:])[:, None]
    jerk = np.sqrt(half * weights).reshape(-1, 1) * basis((middle + half * points).ravel(), 3)
    inside = np.array([bound for bound in bounds if start_x_m <= bound.x_m <= end_x_m]).reshape(-1, 4)
    x, ahead, low, high = inside.T
    at = basis(x) + ahead[:, None] * basis(x, 1)
    # The last three coefficients are y at the end without slope and curvature, the first three are 0.
    coefficients = np.zeros(count + _DEGREE)
    coefficients[-3:] = end_y_m
    rest = at @ coefficients
    coefficients[3:-3] = _bounded(jerk[:, 3:-3], -jerk @ coefficients, at[:, 3:-3], low - rest, high - rest)
    return on_knots(coefficients)


def _bounded(a: Array, b: Array, g: Array, low: Array, high: Array) -> Array:
    """Minimise |A z - b| for low <= G z <= high, with A of full column rank (LSI, LDP)."""
    from scipy.linalg import solve_triangular  # noqa: PLC0415 - slow to import
    from scipy.optimize import nnls  # noqa: PLC0415 - slow to import

    q, r = np.linalg.qr(a)
    target = q.T @ b
    if not len(g):  # nnls does not take an empty matrix
        return solve_triangular(r, target)
    g = solve_triangular(r.T, g.T, lower=True).T
    shift = g @ target
    # In w = R z - Q^T b the problem is: least |w| within S w >= h.
    s = np.concatenate([g, -g])
    h = np.concatenate([low - shift, shift - high])
    e = np.concatenate([s.T, h[None, :]])
    f = np.zeros(len(e))
    f[-1] = 1.0
    dual, _ = nnls(e, f)
    residual = e @ dual - f
    if -residual[-1] < _INCOMPATIBLE:
        raise ManeuverError("no path keeps all bounds: the gates are too narrow or too close to each other")
    w = -residual[:-1] / residual[-1]
    return solve_triangular(r, w + target)


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

    standard: Literal["iso_3888_1", "iso_3888_2"] = "iso_3888_1"
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
class LaneChange(AlongCourse, kind="lane_change"):
    """Double lane change of ISO 3888-1 or -2."""

    lane: LaneLayout = LaneLayout()
    """Lanes, and the path through them."""
    vehicle_width_m: Width | None = None
    """Width of the vehicle, for which the lanes are laid out [m]. Default: the width in the vehicle file."""

    def setpoint(self, time_s: float) -> Setpoint:
        """Return the path and the speed, which is not held after the release of the throttle."""
        return self._setpoint if time_s < self._throttle_off_s else self._coasting

    @cached_property
    def _throttle_off_s(self) -> float:
        off_m = self.lane.throttle_off_m
        return math.inf if off_m is None else (self.lane.entry_m + off_m) / self.speed_mps

    @cached_property
    def _coasting(self) -> Setpoint:
        return self._setpoint._replace(hold_speed=False)

    @cached_property
    def course(self) -> Course:
        """Path, lanes and cones of the standard."""
        layout, width = self.lane, known_width(self.vehicle_width_m)
        # Laid out to the left and then mirrored, so that left and right agree to the last digit.
        left = lanes(layout, width, 1.0)
        if layout.path == "middle":
            path_x, path_y = _middle(left)
        else:
            self._check_margin(left, width)
            path_x, path_y = _least_jerk_path(left, 0.5 * width + layout.margin_m)
        side = SIGNS[layout.side]
        course = lanes(layout, width, side)
        return Course(Path.through(path_x, side * path_y), course, cones(course), course[-1].end_x_m)

    def _check_margin(self, course: Sequence[Lane], width: float) -> None:
        narrowest = min(course, key=lambda lane: lane.left_y_m - lane.right_y_m)
        lane_width = narrowest.left_y_m - narrowest.right_y_m
        maximum = 0.5 * (lane_width - width) - _SLACK_M
        if self.lane.margin_m > maximum:
            raise ManeuverError(
                f"is {self.lane.margin_m:g} m, but the {narrowest.name} is {lane_width:.3g} m wide and "
                f"the car {width:g} m; allowed: 0 to {maximum:.3f} m",
                key="lane.margin_m",
                value=self.lane.margin_m,
                allowed=Range(0.0, maximum),
            )


def _middle(course: Sequence[Lane]) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle line of the lanes, joined by quintics with zero heading and curvature at the joints."""
    end = course[-1].end_x_m
    x = np.linspace(0.0, end, math.ceil(end / _SAMPLE_M) + 1)
    middles = [0.5 * (lane.right_y_m + lane.left_y_m) for lane in course]
    y = np.zeros_like(x)
    for (before, after), (low, high) in zip(pairwise(course), pairwise(middles), strict=True):
        fraction = np.clip((x - before.end_x_m) / (after.start_x_m - before.end_x_m), 0.0, 1.0)
        y += (high - low) * fraction**3 * (10.0 + fraction * (6.0 * fraction - 15.0))
    return x, y


@lru_cache(maxsize=64)  # runs of a study mostly have the same lanes
def _least_jerk_path(course: tuple[Lane, ...], half_width_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a straight line to the first lane, then a path of least jerk to the middle of the end of the last lane."""
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


@dataclass(frozen=True)
class ConeRow:
    """The row of cones along x and the path past it."""

    spacing_m: Annotated[float, Range(5.0, 200.0)] = 36.0
    """Distance between cones [m]; 18 and 30.5 m (100 ft) are common."""
    count: Annotated[int, Range(2, 100)] = 6
    """Number of cones."""
    offset_m: Annotated[float, Range(0.0, 10.0)] = 1.15
    """Distance of the path from the row at every cone: the amplitude of its sine [m]."""
    entry_m: Annotated[float, Range(0.0, 1000.0)] = 50.0
    """Distance from the start to the first cone [m]."""
    side: Side = "left"
    """Side on which the car passes the first cone: `left` or `right`."""

    def __post_init__(self) -> None:
        """Check that the path has room to leave the straight line before the first cone."""
        if self.entry_m < self.spacing_m:
            raise ManeuverError(
                f"is {self.entry_m:g} m; the path leaves the straight line one spacing before the first cone: "
                f"at least {self.spacing_m:g} m are needed (spacing_m)",
                key="entry_m",
                value=self.entry_m,
                allowed=Range(self.spacing_m),
            )


@dataclass(frozen=True, kw_only=True)
class Slalom(AlongCourse, kind="slalom"):
    """A slalom along a sine.

    Between the cones the path is a cosine with its crests at the cones. It leaves the line of the cones one spacing
    before the first crest, with no more curvature than the cosine. Between the last two cones it straightens, with 15 %
    more curvature. After the last cone it is straight and parallel to the row, so that the car oscillates there only
    by itself. Both transitions are quintics without a jump of curvature.
    """

    cones: ConeRow = ConeRow()
    """Row of cones, and the path past it."""
    vehicle_width_m: Width | None = None
    """Width of the vehicle, which must fit past the cones [m]. Default: the width in the vehicle file."""

    @cached_property
    def course(self) -> Course:
        """Path and cones of the slalom."""
        row, width = self.cones, known_width(self.vehicle_width_m)
        if row.offset_m <= 0.5 * width:
            raise ManeuverError(
                f"is {row.offset_m:g} m; a car of {width:g} m width touches the cones unless it is "
                f"above {0.5 * width:g} m",
                key="cones.offset_m",
                value=row.offset_m,
                allowed=Range(0.5 * width),
            )
        places = row.entry_m + row.spacing_m * np.arange(row.count, dtype=np.float64)
        path_x, path_y = _slalom_path(places, row.spacing_m, row.offset_m)
        cones = np.column_stack([places, np.zeros_like(places)])
        return Course(Path.through(path_x, SIGNS[row.side] * path_y), (), cones, float(places[-1]))


def _slalom_path(places: np.ndarray, spacing: float, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of a path that passes the first cone on the left."""
    from scipy.interpolate import BPoly  # noqa: PLC0415 - slow to import, and only a slalom needs it

    first, last = float(places[0]), float(places[-1])
    wave_number = math.pi / spacing
    crest = np.array([offset, 0.0, -offset * wave_number**2])
    straight = np.array([1.0, 0.0, 0.0])
    last_side = 1.0 if len(places) % 2 else -1.0
    entry = BPoly.from_derivatives([first - spacing, first], [0.0 * straight, crest])
    leaving = BPoly.from_derivatives([last - spacing, last], [-last_side * crest, last_side * offset * straight])
    x = np.linspace(0.0, last, math.ceil(last / _SAMPLE_M) + 1)
    y = np.select(
        [x < first - spacing, x < first, x < last - spacing],
        [0.0, entry(x), offset * np.cos(wave_number * (x - first))],
        leaving(x),
    )
    return x, y

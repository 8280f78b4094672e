"""The double lane change: the path through the lanes, and the messages for wrong ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from activesteer.errors import ManeuverError, ParameterError
from activesteer.maneuver.lane_changes import LaneChange
from activesteer.road.course import Course
from activesteer.road.native_path import PathSearch
from activesteer.scenario import resolve
from tests.raising import raises
from tests.unit.maneuver.made import made

STANDARDS = ("iso_3888_1", "iso_3888_2")


def change(lane: dict[str, Any] | None = None, **keys: Any) -> LaneChange:
    table = {"kind": "lane_change", "speed_kmh": 80, "duration_s": 11.0, "vehicle_width_m": 1.8, "lane": lane or {}}
    return made(LaneChange, table | keys)


def course(lane: dict[str, Any]) -> Course:
    return change(lane).course


def least_distance_m(course: Course, width_m: float) -> float:
    """Smallest distance of the car's sides, at axles 1.3 m from its centre, from the edges of the lanes."""
    path = course.path
    s = np.arange(0.0, path.length_m, 0.02)
    x, y = PathSearch(path).at(s)
    heading = np.interp(s, path.s_m, path.heading_rad)
    distances = []
    for ahead in (1.3, -1.3):
        for aside in (0.5 * width_m, -0.5 * width_m):
            side_x = x + ahead * np.cos(heading) - aside * np.sin(heading)
            side_y = y + ahead * np.sin(heading) + aside * np.cos(heading)
            for lane in course.lanes:
                there = (side_x >= lane.start_x_m) & (side_x <= lane.end_x_m)
                distances += [(side_y[there] - lane.right_y_m).min(), (lane.left_y_m - side_y[there]).min()]
    return min(distances)


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("margin", [0.0, 0.1, 0.15])
def test_sides_of_the_car_keep_the_margin(standard, margin):
    reached = least_distance_m(course({"standard": standard, "path": "least_jerk", "margin_m": margin}), 1.8)
    # To 1 cm: the path of the sides is that of small headings.
    assert margin - 0.01 < reached < margin + 0.03


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("path", ["middle", "least_jerk"])
def test_path_is_straight_before_the_first_lane_and_behind_the_last(standard, path):
    laid = course({"standard": standard, "path": path, "entry_m": 40.0})
    first, last = laid.lanes[0], laid.lanes[-1]
    at = laid.path
    before = at.x_m < first.start_x_m - 0.5
    assert np.abs(at.y_m[before]).max() < 1e-3
    assert (at.x_m[0], at.y_m[0]) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert at.x_m[-1] == pytest.approx(last.end_x_m)
    assert at.y_m[-1] == pytest.approx(0.5 * (last.left_y_m + last.right_y_m))
    assert at.heading_rad[-1] == pytest.approx(0.0, abs=2e-3)
    assert laid.last_gate_x_m == last.end_x_m


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("path", ["middle", "least_jerk"])
def test_curvature_has_no_jump(standard, path):
    at = course({"standard": standard, "path": path}).path
    # From point to point, half a metre; a jump would be as large as the curvature itself.
    assert np.abs(np.diff(at.curvature_1pm)).max() < 0.4 * np.abs(at.curvature_1pm).max()


def test_path_of_least_jerk_asks_for_less_acceleration_than_the_middle():
    peaks = [
        float(np.abs(course(lane).path.curvature_1pm).max()) * (80.0 / 3.6) ** 2
        for lane in ({"path": "least_jerk", "margin_m": 0.1}, {"path": "least_jerk", "margin_m": 0.2}, {})
    ]
    # Not below the 3.07 m/s2 that any path with 0.1 m margin needs (a linear programme for the least peak says so).
    assert 3.07 < peaks[0] < 4.5
    assert peaks[0] < peaks[1]


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("path", ["middle", "least_jerk"])
def test_change_to_the_right_is_the_mirror_image(standard, path):
    left, right = (course({"standard": standard, "path": path, "side": side}) for side in ("left", "right"))
    assert np.array_equal(right.path.y_m, -left.path.y_m)
    assert np.array_equal(right.path.x_m, left.path.x_m)
    assert {(x, -y) for x, y in right.cones_m.tolist()} == set(map(tuple, left.cones_m.tolist()))


def test_course_is_the_same_every_time():
    first, again = (course({"path": "least_jerk"}).path for _ in range(2))
    assert np.array_equal(first.y_m, again.y_m)


def test_driver_is_asked_for_speed_and_path_and_while_the_car_settles_for_speed_only():
    maneuver = change()
    setpoint = maneuver.setpoint(3.0)
    assert setpoint.path is maneuver.course.path
    assert setpoint._replace(path=None) == maneuver.settling_setpoint()
    assert setpoint.speed_demand_mps == pytest.approx(80.0 / 3.6)
    assert setpoint.hold_speed
    assert setpoint.steering_wheel_demand_rad == 0.0
    assert setpoint.curvature_demand_1pm is None


def test_lanes_are_made_for_the_car_unless_the_file_says_otherwise():
    own = resolve("double_lane_change", overrides={"width_m": 1.9}).maneuver
    given = resolve("double_lane_change", overrides={"vehicle_width_m": 1.7}).maneuver
    assert isinstance(own, LaneChange)
    assert isinstance(given, LaneChange)
    assert own.vehicle_width_m == 1.9
    assert given.vehicle_width_m == 1.7
    entry = own.course.lanes[0]
    assert entry.left_y_m - entry.right_y_m == pytest.approx(1.1 * 1.9 + 0.25)


@pytest.mark.parametrize("standard", STANDARDS)
def test_largest_margin_that_is_allowed_can_be_driven(standard):
    with raises(ManeuverError, key="lane.margin_m") as refused:
        change({"standard": standard, "path": "least_jerk", "margin_m": 0.5})
    maximum = refused.value.allowed.high
    laid = course({"standard": standard, "path": "least_jerk", "margin_m": maximum - 0.001})
    assert least_distance_m(laid, 1.8) == pytest.approx(maximum, abs=0.02)


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"lane": {"standard": "iso_3888"}}, "lane.standard"),
        ({"lane": {"side": "up"}}, "lane.side"),
        ({"lane": {"path": "least_jerk", "margin_m": 0.3}}, "lane.margin_m"),
        ({"lane": {"margin_m": -0.1}}, "lane.margin_m"),
        ({"speed_kmh": -20}, "speed_kmh"),
        ({"speed_kmh": 0}, "speed_kmh"),
        ({"duration_s": 5.0}, "duration_s"),
        ({"vehicle_width_m": None}, "vehicle_width_m"),
        ({"vehicle_width_m": 0.1}, "vehicle_width_m"),
        ({"road": "ice"}, "road"),
    ],
)
def test_wrong_values_are_answered_with_what_is_allowed(keys, key):
    with raises(ManeuverError, file="mine.toml", key=key):
        change(**keys)


def test_least_duration_is_part_of_the_answer():
    with raises(ManeuverError, key="duration_s") as refused:
        change(duration_s=5.0)
    assert refused.value.allowed.low == pytest.approx(10.5, abs=0.05)


def test_overridden_speed_is_answered_the_same_way():
    with raises(ManeuverError, file="double_lane_change.toml", key="speed_kmh", value=-20.0):
        resolve("double_lane_change", overrides={"speed_kmh": -20})
    with raises(ParameterError, key="lane.margim_m"):
        resolve("double_lane_change", overrides={"lane.margim_m": 0.1})

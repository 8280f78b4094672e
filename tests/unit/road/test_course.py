"""Course and outline of the car, as stored in a recording."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from activesteer.config import read_toml
from activesteer.errors import RecordingError
from activesteer.maneuver import build_maneuver
from activesteer.resources import find_maneuver
from activesteer.road.course import Course, Footprint, course_of, footprint_of
from activesteer.road.road import Road, road_of
from tests.raising import raises

TABLE: dict[str, Any] = {
    "path": {"x_m": [0.0, 50.0, 100.0], "y_m": [0.0, 0.0, 20.0]},
    "lanes": [{"name": "a", "start_x_m": 10.0, "end_x_m": 30.0, "right_y_m": -1.5, "left_y_m": 1.5}],
    "cones": [[10.0, -1.5], [10, 4]],
    "last_gate_x_m": 30.0,
}
CAR: dict[str, Any] = {"width_m": 1.8, "wheelbase_m": 2.6, "tyre_width_m": [0.2, 0.21], "front_track_m": 1.5}
LANE = TABLE["lanes"][0]


def test_a_course_comes_back_from_its_table():
    course = Course.from_table(TABLE)
    assert course.path.x_m.tolist() == [0.0, 50.0, 100.0]
    assert course.lanes[0].name == "a"
    assert course.on_lane_side().tolist() == [True, False]
    assert json.loads(json.dumps(course.to_table())) == TABLE


def test_the_course_of_a_manoeuvre_is_read_as_it_was_written():
    table, source = read_toml(find_maneuver("double_lane_change"))
    laid = build_maneuver({"vehicle_width_m": 1.8, "name": "lane", **table}, source).course
    assert laid is not None
    read = Course.from_table(json.loads(json.dumps(laid.to_table())))
    assert read.lanes == laid.lanes
    assert read.to_table() == laid.to_table()
    assert read.path.length_m == pytest.approx(laid.path.length_m, rel=1e-4)
    assert read.path.heading_rad == pytest.approx(laid.path.heading_rad, abs=0.01)
    assert read.path.curvature_1pm == pytest.approx(laid.path.curvature_1pm, abs=0.003)


def test_lanes_cones_and_gates_may_be_missing():
    course = Course.from_table({"path": TABLE["path"]})
    assert course.lanes == ()
    assert course.cones_m.shape == (0, 2)
    assert course.last_gate_x_m is None
    assert course.first_gate_x_m == 0.0


def test_without_lanes_the_first_cone_is_the_first_gate():
    assert Course.from_table({**TABLE, "cones": [[12.0, 0.0], [7.0, 0.0]]}).first_gate_x_m == 10.0
    assert Course.from_table({**TABLE, "lanes": [], "cones": [[12.0, 0.0], [7.0, 0.0]]}).first_gate_x_m == 7.0


def test_what_was_not_recorded_is_none_or_plain():
    assert course_of({}) is None
    assert footprint_of({}) is None
    assert road_of({}) == road_of({"maneuver": {"kind": "slalom"}}) == Road()


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"path": None}, "course.path"),
        ({"path": [1.0]}, "course.path"),
        ({"path": {"x_m": [0.0, 1.0]}}, "course.path.y_m"),
        ({"path": {"x_m": "01", "y_m": [0.0, 0.0]}}, "course.path.x_m"),
        ({"path": {"x_m": [0.0, 1.0], "y_m": [0.0]}}, "course.path"),
        ({"path": {"x_m": [0.0], "y_m": [0.0]}}, "course.path"),
        ({"path": {"x_m": [0.0, 1.0, 1.0], "y_m": [0.0, 0.0, 0.0]}}, "course.path"),
        ({"path": {"x_m": [0.0, math.nan], "y_m": [0.0, 0.0]}}, "course.path.x_m.1"),
        ({"path": {"x_m": [0.0, 10**400], "y_m": [0.0, 0.0]}}, "course.path.x_m.1"),
        ({"path": {"x_m": [0.0, True], "y_m": [0.0, 0.0]}}, "course.path.x_m.1"),
        ({"lanes": {"a": 1}}, "course.lanes"),
        ({"lanes": ["entry"]}, "course.lanes.0"),
        ({"lanes": [{**LANE, "name": 3}]}, "course.lanes.0.name"),
        ({"lanes": [LANE, {"name": "b", "start_x_m": 0.0}]}, "course.lanes.1.end_x_m"),
        ({"lanes": [{**LANE, "end_x_m": 5.0}]}, "course.lanes.0"),
        ({"lanes": [{**LANE, "left_y_m": -5.0}]}, "course.lanes.0"),
        ({"cones": [[1.0, 2.0, 3.0]]}, "course.cones.0"),
        ({"cones": [1.0, 2.0]}, "course.cones.0"),
        ({"cones": [[1.0, "x" * 1000]]}, "course.cones.0.1"),
        ({"last_gate_x_m": "far"}, "course.last_gate_x_m"),
        ({"last_gate_x_m": 1e9}, "course.last_gate_x_m"),
    ],
)
def test_a_damaged_course_is_refused_with_the_key(change: Mapping[str, Any], key: str):
    with raises(RecordingError, key=key) as caught:
        course_of({"course": {**TABLE, **change}})
    assert len(str(caught.value)) < 350  # at most 200 characters of a value


@pytest.mark.parametrize("table", [[], "course", 3, {}])
def test_what_is_no_course_is_refused(table: object):
    with pytest.raises(RecordingError):
        course_of({"course": table})


def test_the_footprint_reaches_beyond_both_axles():
    car = Footprint.from_table(CAR)
    assert car == Footprint(1.8, 2.6, (0.2, 0.21))
    assert car.front_m > 0.0
    assert car.rear_m < -2.6


@pytest.mark.parametrize(
    "change",
    [{"tyre_width_m": [0.2]}, {"width_m": None}, {"wheelbase_m": "long"}, {"width_m": -1.8}, {"wheelbase_m": math.inf}],
)
def test_a_damaged_car_is_refused_with_the_key(change: dict[str, Any]):
    with raises(RecordingError, key=f"car.{next(iter(change))}"):
        footprint_of({"car": {**CAR, **change}})


@pytest.mark.parametrize(
    "road",
    [
        {"patches": [{"mu": 0.3}]},
        {"mu": "ice"},
        {"mu": math.nan},
        {"patches": {"start_m": 0.0}},
        {"patches": [{"start_m": 5.0, "end_m": 1.0, "mu": 0.3}]},
        {"patches": [{"start_m": 0.0, "end_m": 1.0, "mu": 0.3, "side": "up"}]},
        [],
    ],
)
def test_a_damaged_road_is_refused(road: object):
    with pytest.raises(RecordingError):
        road_of({"maneuver": {"road": road}})


def test_areas_are_clipped_to_what_is_shown():
    road = Road(0.9, mu_left=0.3)
    (left,) = road.areas()
    assert left.clipped(-5.0, 10.0, -3.0, 4.0) == (-5.0, 10.0, 0.0, 4.0, 0.3, 0.0)
    assert left.clipped(-5.0, 10.0, -3.0, 0.0) is None


def test_the_outline_of_a_lane_is_closed():
    outline = Course.from_table(TABLE).lanes[0].outline_m()
    assert np.array_equal(outline[0], outline[-1])
    assert np.ptp(outline, axis=0) == pytest.approx([20.0, 3.0])

"""Lanes and cones, with a car whose body is 1.8 m wide and 4.2 m long."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.lanes import (
    TIME_TOLERANCE_S,
    cone_distances,
    corridor,
    first_at,
    heading_at_end,
    lane_overstep,
    largest_difference,
    path_distance,
    places_along,
    struck_cones,
    track_over_x,
    view_of,
)
from activesteer.analysis.path_following import path_following_metrics
from activesteer.analysis.source import read_course, read_footprint
from activesteer.core.path import Path
from activesteer.road.course import CONE_RADIUS_M, FRONT_OVERHANG_M, REAR_OVERHANG_M
from tests.unit.analysis.synthetic import LANES, WHEELBASE_M, WIDTH_M, SyntheticRun, along_path, offset_track

HALF_M = 0.5 * WIDTH_M
"""From the middle of the car to its side [m]."""


def straight(y_m: float, **words) -> SyntheticRun:
    return along_path(lambda x: np.full_like(x, y_m), **words)


def overstep(run: SyntheticRun) -> float:
    return lane_overstep(run, read_course(run), read_footprint(run))


def kept(run: SyntheticRun) -> bool:
    return path_following_metrics(run)["stays_in_lanes"] == 1.0


def distances(run: SyntheticRun) -> np.ndarray:
    return cone_distances(run, read_course(run), read_footprint(run))


@pytest.mark.parametrize("y_m", [-0.5, 0.0, 0.3])
def test_overstep_is_the_distance_of_the_body_from_the_nearer_side_of_the_lane(y_m):
    run = straight(y_m, lanes=(("lane", 30.0, 45.0, -1.2, 1.2),))
    assert overstep(run) == pytest.approx(abs(y_m) + HALF_M - 1.2)


@pytest.mark.parametrize(("margin_m", "inside"), [(0.002, True), (-0.002, False)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_body_just_inside_is_inside_and_just_outside_is_not(margin_m, inside, side):
    run = straight(side * (1.2 - HALF_M - margin_m), lanes=(("lane", 30.0, 45.0, -1.2, 1.2),))
    assert overstep(run) == pytest.approx(-margin_m)
    assert kept(run) is inside


@pytest.mark.parametrize("yaw_rad", [0.1, -0.1])
@pytest.mark.parametrize(("end_m", "turns"), [(FRONT_OVERHANG_M, 1.0), (WHEELBASE_M + REAR_OVERHANG_M, -1.0)])
def test_every_corner_counts(yaw_rad, end_m, turns):
    """The body is shifted until one end fits; the other end oversteps the lane by the value calculated by hand."""
    sideways = math.sin(abs(yaw_rad)) * end_m + math.cos(yaw_rad) * HALF_M
    y_m = turns * math.copysign(0.5, yaw_rad)
    run = straight(y_m, lanes=(("lane", 30.0, 45.0, -2.0, 2.0),))
    run.channels["yaw_rad"] = np.full_like(run.time_s, yaw_rad)
    assert overstep(run) == pytest.approx(0.5 + sideways - 2.0, abs=1e-3)


def test_a_body_that_turns_over_the_end_of_a_side_oversteps_there_though_no_corner_is_in_the_lane():
    run = straight(0.0, lanes=(("entry", 10.0, 12.0, -5.0, 5.0), ("lane", 50.0, 80.0, -3.0, 0.5)), stops_m=49.4)
    run.channels["yaw_rad"] = np.full_like(run.time_s, 0.25 * math.pi)
    # The front right corner is at y = -0.04 m, in the lane; the end of the side is this far behind the front end:
    assert overstep(run) == pytest.approx(FRONT_OVERHANG_M - (0.6 + 0.5) * math.sqrt(0.5), abs=1e-3)


def test_between_the_lanes_the_body_may_go_where_it_likes():
    def track(x_m):
        return offset_track(x_m) + 6.0 * np.exp(-((x_m - 60.0) ** 2) / 4.0)

    assert kept(along_path(track))


def test_a_rear_corner_that_is_still_in_the_lane_counts_though_the_front_axle_has_left_it():
    # The front axle moves over half a metre behind the end of the lane, while the rear end is still inside.
    def track(x_m):
        return np.interp(x_m, (45.5, 45.6), (0.0, 3.0))

    run = along_path(track, lanes=LANES[:1])
    assert not kept(run)


def test_a_car_that_stops_before_the_last_lane_has_not_kept_to_the_lanes():
    run = along_path(stops_m=110.0)
    assert overstep(run) <= 0.0
    assert not kept(run)
    assert not kept(along_path(stops_m=150.0))


def test_a_car_that_never_gets_to_a_lane_has_no_overstep():
    assert math.isnan(overstep(along_path(stops_m=20.0)))


@pytest.mark.parametrize("gap_m", [0.05, -0.05])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_cone_beside_the_car_is_hit_when_the_body_reaches_its_disc(gap_m, side):
    y_m = side * (0.5 * WIDTH_M + CONE_RADIUS_M + gap_m)
    run = straight(0.0, lanes=(), cones=((60.0, y_m),))
    assert distances(run) == pytest.approx([gap_m], abs=1e-6)


def test_a_cone_in_front_of_a_car_that_stops_is_hit_by_the_front_end():
    nose_m = 50.0 + FRONT_OVERHANG_M
    run = straight(0.0, lanes=(), cones=((nose_m + CONE_RADIUS_M + 0.1, 0.0), (nose_m - 0.2, 0.0)), stops_m=50.0)
    assert distances(run) == pytest.approx([0.1, -0.2 - CONE_RADIUS_M], abs=0.02)


def test_the_tail_of_a_turned_car_hits_what_its_front_axle_is_far_from():
    run = straight(0.0, lanes=(), cones=((50.0, -WHEELBASE_M - REAR_OVERHANG_M - 0.1),), stops_m=50.0)
    run.channels["yaw_rad"] = np.full_like(run.time_s, math.pi / 2.0)
    assert distances(run)[0] == pytest.approx(0.1 - CONE_RADIUS_M, abs=1e-6)


def test_a_cone_that_marks_a_lane_is_measured_from_the_side_of_the_lane():
    cones = ((35.0, 1.2), (35.0, -1.3))
    run = straight(0.0, lanes=(("lane", 30.0, 45.0, -1.2, 1.2),), cones=cones)
    assert read_course(run).on_lane_side().tolist() == [True, False]
    assert distances(run) == pytest.approx([0.3, 0.4 - CONE_RADIUS_M])


def distance(x: float, y: float, path: list[tuple[float, float]]) -> float:
    px, py = np.array(path, dtype=float).T
    return float(path_distance(np.array([x]), np.array([y]), px, py)[0])


@pytest.mark.parametrize(
    ("x", "y", "expected"),
    [
        (3.3, 2.0, 2.0),  # beside a piece, left
        (3.3, -2.0, -2.0),  # right
        (-50.0, 1.0, 1.0),  # before the beginning the path goes on straight
        (12.0, 40.0, -2.0),  # beyond the end too
        (13.0, -4.0, -5.0),  # outside a corner, the distance is that to its point
        (9.0, 0.3, 0.3),  # inside the corner, the nearer piece counts
    ],
)
def test_signed_distance_from_a_bent_path(x, y, expected):
    assert distance(x, y, [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]) == pytest.approx(expected)


def test_distance_from_a_circle_of_points_is_that_from_the_circle():
    angle = np.linspace(0.0, math.pi, 400)
    distances = path_distance(
        9.0 * np.cos(angle[3:-3:7]), 9.0 * np.sin(angle[3:-3:7]), 10.0 * np.cos(angle), 10.0 * np.sin(angle)
    )
    np.testing.assert_allclose(distances, 1.0, atol=1e-3)


CIRCLE_M = 10.0


@pytest.mark.parametrize("outside_m", [2.0, -2.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_place_along_a_circle_and_beside_it(outside_m, side):
    angle = np.linspace(0.0, 1.5 * math.pi, 95)
    path = Path.through(CIRCLE_M * np.sin(angle), side * CIRCLE_M * (1.0 - np.cos(angle)))
    driven, radius = np.linspace(0.1, 4.0, 200), CIRCLE_M + outside_m
    along, left = places_along(radius * np.sin(driven), side * (CIRCLE_M - radius * np.cos(driven)), path)
    # Points 0.5 m apart: beside the tangent at the nearest point the circle is 4 mm further.
    np.testing.assert_allclose(left, -side * outside_m, atol=0.005)
    np.testing.assert_allclose(along, CIRCLE_M * driven, atol=0.08)


@pytest.mark.parametrize("turns", [0, 2])
@pytest.mark.parametrize(("x_m", "along_deg"), [(2.0, 0.0), (18.0, 60.0), (40.0, 60.0)])
def test_the_final_heading_is_that_against_the_path_beside_the_car_without_whole_turns(x_m, along_deg, turns):
    run = straight(0.0, stops_m=x_m)
    path_x_m, path_y_m = np.array([0.0, 10.0, 20.0]), np.array([0.0, 0.0, 10.0 * math.tan(math.radians(60.0))])
    run.channels["yaw_rad"] = np.full_like(run.time_s, math.radians(50.0) + 2.0 * math.pi * turns)
    assert math.degrees(heading_at_end(run, path_x_m, path_y_m)) == pytest.approx(50.0 - along_deg)


def test_difference_of_two_tracks_is_lateral_at_the_same_x_and_within_the_gates():
    one = along_path(np.zeros_like)
    other = along_path(lambda x: np.where(x < 50.0, 0.3 * np.sin(x / 5.0), 5.0))
    assert largest_difference(one, other, 0.0, 49.0) == pytest.approx(0.3, rel=1e-3)
    assert largest_difference(other, one, 0.0, 60.0) == pytest.approx(5.0)


def test_a_car_that_does_not_get_there_has_no_difference():
    stopped = along_path(stops_m=100.0)
    assert math.isnan(largest_difference(along_path(), stopped, 30.0, 150.0))
    assert first_at(stopped, 150.0) is None


def test_a_car_that_turns_back_counts_where_it_was_first():
    run = along_path(np.zeros_like, duration_s=4.0, timestep_s=0.001)
    x = run["front_axle_x_m"]
    run.channels["front_axle_y_m"] = np.where(run.time_s < 2.0, 0.0, 3.0)
    run.channels["front_axle_x_m"] = np.where(run.time_s < 2.0, x, 2.0 * x[2000] - x)
    np.testing.assert_allclose(track_over_x(run, np.array([10.0, 30.0, 39.0])), 0.0)


def test_the_corridor_of_a_ramp_is_wider_by_its_tolerances_in_time_and_size():
    time_s = np.arange(0.0, 1.0, 0.001)
    inside = slice(50, -50)
    for slope in (3.0, -3.0):
        low, high = corridor(time_s, slope * time_s, 0.1)
        np.testing.assert_allclose((slope * time_s - low)[inside], 3.0 * TIME_TOLERANCE_S + 0.1, atol=1e-9)
        np.testing.assert_allclose((high - slope * time_s)[inside], 3.0 * TIME_TOLERANCE_S + 0.1, atol=1e-9)


def test_a_cone_is_struck_if_any_of_the_cars_hits_it():
    cones = ((50.0, 0.0), (70.0, 3.0), (90.0, -6.0))
    middle, left = (straight(y_m, lanes=(), cones=cones) for y_m in (0.0, 3.0))
    nowhere = straight(0.0, lanes=(), cones=cones)
    del nowhere.metadata["car"]
    assert struck_cones([middle, nowhere], read_course(middle)).tolist() == [True, False, False]
    assert struck_cones([middle, left], read_course(middle)).tolist() == [True, True, False]


def test_a_course_is_shown_with_road_before_and_behind_its_gates_and_beside_it():
    course = read_course(along_path())
    view = view_of(course)
    assert view.x_m == (30.0 - 20.0, 155.0 + 50.0)
    assert view.y_m == (-1.7 - 2.0, 5.1 + 2.0)
    assert view.path_x_m[-1] == pytest.approx(course.path.x_m[-1] + 195.0)
    free = view_of(read_course(along_path(last_gate_m=None, lanes=(), path=lambda x: 0.01 * x)))
    assert free.x_m == (-2.0, pytest.approx(299.5 + 2.0))
    assert free.y_m == (-2.0, pytest.approx(2.995 + 2.0))

"""The manoeuvres of the package: values of the paper, and sufficient lengths for the evaluation."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from activesteer.maneuver.lane_changes import LaneChange, Slalom
from activesteer.maneuver.steering_tests import SineWithDwell
from activesteer.resources import find_maneuver, list_maneuvers
from activesteer.scenario import resolve


def test_all_kinds_that_were_asked_for_are_there():
    asked = {
        "step_steer", "sine_with_dwell", "double_lane_change", "double_lane_change_low_mu", "slalom", "straight_line",
        "sine_sweep", "slowly_increasing_steer", "ramp_steer", "constant_radius", "brake_in_turn", "severe_lane_change",
        "split_mu_braking", "mu_jump", "random_steer",
    }  # fmt: skip
    assert asked <= set(list_maneuvers())


@pytest.mark.parametrize("name", list_maneuvers())
def test_course_goes_on_long_enough_behind_the_last_gate(name):
    maneuver = resolve(name).maneuver
    if maneuver.course is None or maneuver.course.last_gate_x_m is None:
        return
    slow = maneuver.speed_mps - 3.0 / 3.6
    assert maneuver.duration_s - maneuver.course.last_gate_x_m / slow > 3.5


@pytest.mark.parametrize(
    ("name", "kmh", "mu"),
    [
        ("step_steer", 80.0, 0.9),
        ("sine_with_dwell", 80.0, 0.9),
        ("double_lane_change", 80.0, 0.9),
        ("slalom", 100.0, 0.9),
        ("double_lane_change_low_mu", 80.0, 0.4),
    ],
)
def test_speed_and_road_are_those_of_the_paper(name, kmh, mu):
    maneuver = resolve(name).maneuver
    assert maneuver.speed_mps == pytest.approx(kmh / 3.6)
    assert maneuver.road.mu == mu


def test_sine_with_dwell_is_that_of_the_paper():
    maneuver = resolve("sine_with_dwell").maneuver
    assert isinstance(maneuver, SineWithDwell)
    assert maneuver.steer.frequency_Hz == 0.7
    assert maneuver.steer.dwell_s == 0.5
    assert maneuver.duration_s - maneuver.steer.completion_s > 2.5


def test_both_lane_changes_differ_by_the_road_and_by_how_much_of_the_lanes_is_used():
    dry, slippery = (resolve(name).maneuver for name in ("double_lane_change", "double_lane_change_low_mu"))
    assert isinstance(dry, LaneChange)
    assert isinstance(slippery, LaneChange)
    assert dry.course.lanes == slippery.course.lanes
    assert replace(dry.lane, margin_m=slippery.lane.margin_m) == slippery.lane
    # The line of the dry road asks for less than there is, that of the slippery one for more.
    for maneuver, minimum, maximum in ((dry, 0.6, 0.75), (slippery, 1.0, 1.1)):
        asked = np.abs(maneuver.course.path.curvature_1pm).max() * maneuver.speed_mps**2
        assert minimum < asked / (maneuver.road.mu * 9.81) < maximum
    assert dry.lane.standard == "iso_3888_1"
    assert dry.speed_mps == slippery.speed_mps


def test_the_sine_of_the_slalom_asks_for_nearly_what_the_road_gives():
    maneuver = resolve("slalom").maneuver
    assert isinstance(maneuver, Slalom)
    asked = maneuver.cones.offset_m * (np.pi * maneuver.speed_mps / maneuver.cones.spacing_m) ** 2
    assert 0.9 < asked / (maneuver.road.mu * 9.81) < 1.0


def test_the_snow_of_the_mu_jump_gives_less_than_the_turn_asks_for_and_the_dry_road_more():
    maneuver = resolve("mu_jump").maneuver
    assert maneuver.course is not None
    [snow] = maneuver.road.patches
    path = maneuver.course.path
    asked = maneuver.speed_mps**2 * path.curvature_1pm[(path.x_m >= snow.start_m) & (path.x_m < snow.end_m)]
    assert asked == pytest.approx(maneuver.speed_mps**2 / 100.0, rel=0.01)
    assert snow.mu * 9.81 < 0.7 * asked.min()
    assert maneuver.road.mu * 9.81 > 1.5 * asked.max()


@pytest.mark.parametrize("name", list_maneuvers())
def test_road_is_stated(name: str) -> None:
    """Every file gives its friction, for the whole road or for each side; the program has no default for "dry"."""
    road = tomllib.loads(find_maneuver(name).read_text(encoding="utf-8")).get("road", {})
    assert "mu" in road or {"mu_left", "mu_right"} <= road.keys()

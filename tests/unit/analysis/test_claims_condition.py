"""Conditions have the verdict of their inequality and a distance that grows with the gap."""

from __future__ import annotations

import math

import pytest

from activesteer.analysis.claims.condition import at_least, at_most, both, either, true
from tests.unit.analysis.good_runs import check, good


def test_a_condition_is_its_inequality():
    assert at_most(1.0, 1.0).holds
    assert not at_most(1.0, 1.0, strict=True).holds
    assert at_least(2.0, 1.0, strict=True).holds
    assert not at_most(math.nan, 1.0).holds
    assert at_most(1.0, 1.0).negated.holds is at_most(1.0, 1.0).strict


def test_the_distance_is_half_a_scale_away_and_one_if_undefined():
    assert at_most(0.5, 1.0).distance == 0.0
    assert at_most(2.0, 1.0).distance == pytest.approx(0.5)
    assert at_least(-1.0, 0.0, 0.5).distance == pytest.approx(2.0 / 3.0)
    assert at_most(math.nan, 1.0).distance == 1.0
    assert 0.0 < at_most(1.0, 1.0, strict=True).distance < 1e-5


def test_alternatives_take_the_nearest_and_all_the_furthest():
    near, far = at_most(1.1, 1.0), at_most(3.0, 1.0)
    assert either([near, far]) == near
    assert both([near, far]) == far
    assert both([near, true(True)]) == near
    assert true(False).negated.holds


def test_a_claim_is_nearer_the_smaller_its_gap_and_at_zero_if_it_passes():
    arguments = good("slalom")
    distances = []
    for amplitude_m in (1.4, 1.6, 1.7, 2.0):
        arguments["ars"]["amplitude_m"] = amplitude_m
        distances.append(check("slalom", arguments)["Z1"].distance)
    assert distances[0] == pytest.approx(-1.0, abs=1e-4)  # graded: it nears -1
    assert sorted(distances) == distances
    assert distances[1] > 0.0


def test_delays_are_compared_at_the_level_of_the_car_without_control():
    """A system that answers as soon and turns further reaches 90 % of its own steady state later."""
    arguments = good("step_steer")
    s2 = check("step_steer", arguments)["S2"]
    assert s2.passed
    assert s2.values["none_yaw_rate_delay_s"] == pytest.approx(s2.values["none_yaw_rate_response_time_s"])

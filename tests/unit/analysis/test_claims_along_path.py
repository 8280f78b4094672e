"""Claims L, Z and W pass if they hold and fail if they do not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.unit.analysis.good_runs import check, failing, good, wider
from tests.unit.analysis.synthetic import offset_track


@pytest.mark.parametrize(
    ("broken", "system", "change"),
    [
        (["L1"], "none", {"track": wider(1.15)}),  # 0.6 m from ars
        (["L1"], "afs", {"track": wider(0.80)}),
        (["L2"], "ars", {"after": 0.65}),
        (["L2"], "afs", {"after": 0.65}),
        (["L2"], "none", {"after": 0.4}),
        (["L3"], "ars", {"yaw_rate": 0.28}),
        (["L3"], "afs", {"yaw_rate": 0.28}),
        (["L3", "L4"], "ars", {"sideslip": 0.047}),
        (["L3"], "afs", {"sideslip": 0.047}),
    ],
)
def test_only_the_broken_one_of_the_lane_change_fails(broken, system, change):
    arguments = good("double_lane_change")
    arguments[system] |= change
    assert failing("double_lane_change", arguments) == broken


@pytest.mark.parametrize(
    ("broken", "system", "change"),
    [
        (["Z1"], "ars", {"amplitude_m": 1.7}),
        (["Z1"], "afs", {"amplitude_m": 1.7}),
        (["Z2"], "ars", {"after": 0.95}),
        (["Z2"], "afs", {"after": 0.6}),
        (["Z3"], "afs", {"yaw_rate": 0.27}),  # 10 % lower: reduced
        (["Z3"], "afs", {"sideslip": 0.045}),
        (["Z3"], "afs", {"steering_rad": 0.9}),
        (["Z3"], "ars", {"steering_rad": 1.65}),  # 2.5 deg RMS less
        (["Z3"], "afs", {"path": lambda x: np.full_like(x, -2.0)}),
        (["Z4"], "ars", {"yaw_rate": 0.305}),
        (["Z4", "Z5"], "ars", {"sideslip": 0.055}),
        (["Z5"], "ars", {"sideslip": 0.037}),
        (["Z3", "Z4"], "afs", {"yaw_rate": 0.19}),
        (["Z3", "Z4", "Z5"], "afs", {"sideslip": 0.029}),
    ],
)
def test_only_the_broken_one_of_the_slalom_fails(broken, system, change):
    arguments = good("slalom")
    arguments[system] |= change
    assert failing("slalom", arguments) == broken


@pytest.mark.parametrize(
    ("broken", "system", "change"),
    [
        (["W1", "W2", "W3"], "none", {"track": offset_track}),  # keeps to the lanes
        (["W1"], "none", {"steering_rad": 1.5}),  # below 90 deg
        (["W1"], "ars", {"steering_rad": 2.1}),  # less than 1.5 times as much
        (["W1"], "afs", {"steering_rad": 2.1}),
        (["W1"], "none", {"yaw_rate": 0.1}),  # 4 deg/s
        (["W1"], "none", {"sideslip": 0.1}),  # 4 deg
        (["W1"], "none", {"after": 0.1}),  # calm in the end
        (["W2"], "ars", {"track": wider(1.6)}),
        (["W2"], "ars", {"stops_m": 110.0}),
        (["W2"], "ars", {"after": 1.0}),  # through the lanes, but not straight at the end
        (["W3"], "afs", {"after": 1.0}),
        (["W2", "W4"], "ars", {"sideslip": 0.09}),  # 5.2 deg
        (["W3"], "afs", {"track": wider(1.6)}),
        (["W3"], "afs", {"stops_m": 110.0}),
        (["W4"], "ars", {"sideslip": 0.036}),  # 2.06 deg
        (["W4"], "ars", {"sideslip": 0.029}),  # 0.06 deg below afs
    ],
)
def test_only_the_broken_one_of_the_slippery_lane_change_fails(broken, system, change):
    arguments = good("double_lane_change_low_mu")
    arguments[system] |= change
    assert failing("double_lane_change_low_mu", arguments) == broken


@pytest.mark.parametrize(("number", "system"), [("W2", "ars"), ("W3", "afs")])
def test_who_keeps_a_lane_by_less_than_can_be_measured_has_not_kept_it(number, system):
    arguments = good("double_lane_change_low_mu")
    arguments[system]["track"] = wider(1.06)  # 1 cm inside
    for share, outside_m, holds in ((1.07, 0.03, False), (1.08, 0.07, True)):
        arguments["none"]["track"] = wider(share)
        claim = check("double_lane_change_low_mu", arguments)[number]
        assert claim.values["none_lane_overstep_m"] == pytest.approx(outside_m, abs=0.005)
        assert claim.passed is holds


def test_nothing_to_calm_is_nothing_calmed():
    arguments = good("double_lane_change")
    for words in arguments.values():
        words["after"] = 0.0
    assert failing("double_lane_change", arguments) == ["L2"]


@pytest.mark.parametrize("system", ["none", "ars", "afs"])
def test_who_never_gets_to_the_last_gate_fails_what_needs_it(system):
    arguments = good("double_lane_change")
    arguments[system]["stops_m"] = 120.0
    claims = check("double_lane_change", arguments)
    assert not claims["L1"].passed
    assert not claims["L2"].passed
    assert math.isnan(claims["L2"].values[f"{system}_yaw_rate_after_gates_rms_radps"])


def test_a_car_that_spins_off_before_the_last_gate_is_judged_by_the_end_of_its_run():
    arguments = good("double_lane_change_low_mu")
    arguments["none"] |= {"stops_m": 120.0}
    assert failing("double_lane_change_low_mu", arguments) == []
    arguments["none"]["yaw_rate"] = lambda time_s: np.where(time_s < 9.0, 0.3, 0.01)
    assert failing("double_lane_change_low_mu", arguments) == ["W1"]


def test_a_small_angle_is_not_large_however_much_smaller_the_others_are():
    arguments = good("double_lane_change_low_mu")
    for system, angle_rad in (("none", 1.5), ("ars", 0.2), ("afs", 0.2)):
        arguments[system]["steering_rad"] = angle_rad
    assert failing("double_lane_change_low_mu", arguments) == ["W1"]


def test_a_course_without_lanes_has_no_track_to_stay_on():
    arguments = good("double_lane_change_low_mu")
    for words in arguments.values():
        words["lanes"] = ()
    assert failing("double_lane_change_low_mu", arguments) == ["W1", "W2", "W3"]

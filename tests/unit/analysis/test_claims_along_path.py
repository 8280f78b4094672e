"""Claims L, Z and W pass where they hold and fail where they do not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from activesteer.analysis.claims import SCENARIOS, Claim, claims_for
from activesteer.errors import ParameterError
from tests.unit.analysis.synthetic import along_path, offset_track, slalom, step_steer

Arguments = dict[str, dict[str, Any]]


def wider(share: float):
    return lambda x: share * offset_track(x)


def lane_change() -> Arguments:
    return {
        "none": {"yaw_rate": 0.30, "sideslip": 0.05, "track": wider(1.02)},
        "ars": {"yaw_rate": 0.25, "sideslip": 0.03, "after": 0.3, "track": wider(0.98)},
        "afs": {"yaw_rate": 0.26, "sideslip": 0.04, "after": 0.4, "track": wider(1.0)},
    }


def slaloms() -> Arguments:
    return {
        "none": {"amplitude_m": 1.6, "yaw_rate": 0.30, "sideslip": 0.05, "steering_rad": 1.0},
        "ars": {"amplitude_m": 1.4, "yaw_rate": 0.20, "sideslip": 0.03, "after": 0.3, "steering_rad": 0.8},
        "afs": {"amplitude_m": 1.5, "yaw_rate": 0.31, "sideslip": 0.06, "after": 0.3, "steering_rad": 1.3},
    }


def slippery() -> Arguments:
    return {
        "none": {"track": wider(1.6), "steering_rad": 3.0, "yaw_rate": 0.3, "sideslip": 0.2},
        "ars": {"track": wider(1.02), "steering_rad": 0.9},
        "afs": {"track": wider(0.98), "steering_rad": 1.2},
    }


def check(scenario: str, arguments: Arguments) -> dict[str, Claim]:
    make = slalom if scenario == "slalom" else along_path
    runs = {system: make(**words) for system, words in arguments.items()}
    return {claim.id: claim for claim in SCENARIOS[scenario](runs)}


def failing(scenario: str, arguments: Arguments) -> list[str]:
    return [name for name, claim in check(scenario, arguments).items() if not claim.passed]


CASES = [
    ("double_lane_change", lane_change, ["L1", "L2", "L3"]),
    ("slalom", slaloms, ["Z1", "Z2", "Z3", "Z4"]),
    ("double_lane_change_low_mu", slippery, ["W1", "W2", "W3"]),
]


@pytest.mark.parametrize(("scenario", "good", "names"), CASES)
def test_all_hold_where_they_hold(scenario, good, names):
    assert list(check(scenario, good())) == names
    assert failing(scenario, good()) == []


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
        (["L3"], "ars", {"sideslip": 0.047}),
        (["L3"], "afs", {"sideslip": 0.047}),
    ],
)
def test_only_the_broken_one_of_the_lane_change_fails(broken, system, change):
    arguments = lane_change()
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
        (["Z3"], "ars", {"steering_rad": 1.5}),
        (["Z4"], "ars", {"yaw_rate": 0.305}),
        (["Z4"], "ars", {"sideslip": 0.055}),
        (["Z3", "Z4"], "afs", {"yaw_rate": 0.19}),
        (["Z3", "Z4"], "afs", {"sideslip": 0.029}),
    ],
)
def test_only_the_broken_one_of_the_slalom_fails(broken, system, change):
    arguments = slaloms()
    arguments[system] |= change
    assert failing("slalom", arguments) == broken


@pytest.mark.parametrize(
    ("broken", "system", "change"),
    [
        (["W1"], "none", {"track": offset_track}),  # keeps to the lanes
        (["W1"], "none", {"steering_rad": 1.5}),  # below 90 deg
        (["W1"], "ars", {"steering_rad": 2.1}),  # less than 1.5 times as much
        (["W1"], "afs", {"steering_rad": 2.1}),
        (["W1"], "none", {"yaw_rate": 0.1}),  # 4 deg/s
        (["W1"], "none", {"sideslip": 0.1}),  # 4 deg
        (["W1"], "none", {"after": 0.1}),  # calm in the end
        (["W2"], "ars", {"track": wider(1.6)}),
        (["W2"], "ars", {"stops_m": 110.0}),
        (["W3"], "afs", {"track": wider(1.6)}),
        (["W3"], "afs", {"stops_m": 110.0}),
    ],
)
def test_only_the_broken_one_of_the_slippery_lane_change_fails(broken, system, change):
    arguments = slippery()
    arguments[system] |= change
    assert failing("double_lane_change_low_mu", arguments) == broken


@pytest.mark.parametrize(("scenario", "good", "names"), CASES)
def test_three_runs_that_are_the_same_do_not_prove_anything_but_likeness(scenario, good, names):
    words = {"yaw_rate": 0.1, "sideslip": 0.02}
    same = {system: dict(words) for system in good()}
    passed = [name for name in names if name not in failing(scenario, same)]
    assert passed == {"L1": ["L1"], "Z1": [], "W1": ["W2", "W3"]}[names[0]]


def test_nothing_to_calm_is_nothing_calmed():
    arguments = lane_change()
    for words in arguments.values():
        words["after"] = 0.0
    assert failing("double_lane_change", arguments) == ["L2"]


@pytest.mark.parametrize("system", ["none", "ars", "afs"])
def test_who_never_gets_to_the_last_gate_fails_what_needs_it(system):
    arguments = lane_change()
    arguments[system]["stops_m"] = 120.0
    claims = check("double_lane_change", arguments)
    assert not claims["L1"].passed
    assert not claims["L2"].passed
    assert math.isnan(claims["L2"].values[f"{system}_yaw_rate_after_gates_rms_radps"])


def test_a_car_that_spins_off_before_the_last_gate_is_judged_by_the_end_of_its_run():
    arguments = slippery()
    arguments["none"] |= {"stops_m": 120.0}
    assert failing("double_lane_change_low_mu", arguments) == []
    arguments["none"]["yaw_rate"] = lambda time_s: np.where(time_s < 9.0, 0.3, 0.01)
    assert failing("double_lane_change_low_mu", arguments) == ["W1"]


def test_a_small_angle_is_not_large_however_much_smaller_the_others_are():
    arguments = slippery()
    for system, angle_rad in (("none", 1.5), ("ars", 0.2), ("afs", 0.2)):
        arguments[system]["steering_rad"] = angle_rad
    assert failing("double_lane_change_low_mu", arguments) == ["W1"]


def test_a_course_without_lanes_has_no_track_to_stay_on():
    arguments = slippery()
    for words in arguments.values():
        words["lanes"] = ()
    assert failing("double_lane_change_low_mu", arguments) == ["W1", "W2", "W3"]


@pytest.mark.parametrize(("scenario", "good", "names"), CASES)
def test_a_missing_run_is_named(scenario, good, names):
    arguments = good()
    del arguments["ars"]
    with pytest.raises(ParameterError, match="missing: ars"):
        check(scenario, arguments)


def test_claims_are_found_by_the_name_of_the_manoeuvre():
    run = along_path()
    run.metadata["maneuver"] = {"kind": "lane_change", "name": "double_lane_change_low_mu"}
    assert claims_for(run) is SCENARIOS["double_lane_change_low_mu"]
    run.metadata["vehicle"] = {"name": "compact", "controllers": {}}
    for key in ("road.mu", "maneuver.speed_kmh"):
        run.metadata["overrides"] = {key: 1.0}
        assert claims_for(run) is None
    for key in ("controllers.ars.limit_deg", "vehicle.load.payload_kg", "duration_s"):
        run.metadata["overrides"] = {key: 1.0}
        assert claims_for(run) is not None
    run.metadata["overrides"] = {}
    run.metadata["maneuver"] = {"kind": "lane_change", "name": "my_own"}
    assert claims_for(run) is None
    assert claims_for(step_steer()) is SCENARIOS["step_steer"]
    run.metadata["maneuver"] = None
    assert claims_for(run) is None

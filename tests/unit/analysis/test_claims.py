"""Claims S1 to S5 pass if they hold and fail if they do not; common properties of all claims."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.analysis.claims.judge import SCENARIOS, STATEMENTS
from activesteer.analysis.claims.scorecard import claims_for
from activesteer.errors import ParameterError, RecordingError
from tests.raising import raises
from tests.unit.analysis.good_runs import check, failing, good, runs_of
from tests.unit.analysis.synthetic import along_path, second_order, step_steer


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_all_hold_where_they_hold(scenario):
    claims = check(scenario, good(scenario))
    assert [claim.id for claim in claims.values() if not claim.passed] == []
    assert list(claims) == [number for number in STATEMENTS if number in claims]
    assert all(claim.statement is STATEMENTS[number] for number, claim in claims.items())


def test_every_statement_is_checked_once():
    checked = [number for scenario in SCENARIOS for number in check(scenario, good(scenario))]
    assert checked == list(STATEMENTS)


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_missing_run_is_named(scenario):
    arguments = good(scenario)
    del arguments["ars"]
    with raises(ParameterError, value=["ars"], allowed=("none", "ars", "afs")):
        check(scenario, arguments)


def test_a_whole_run_of_another_kind_is_refused():
    runs = runs_of("step_steer", good("step_steer"))
    with pytest.raises(RecordingError):
        SCENARIOS["slalom"](runs)


@pytest.mark.parametrize("scenario", ["step_steer", "sine_with_dwell"])
def test_the_side_is_no_matter(scenario):
    assert failing(scenario, good(scenario), side=-1.0) == []


@pytest.mark.parametrize(
    ("broken", "system", "change"),
    [
        (["S1", "S2", "S3", "S5"], "ars", {"yaw_radps": 0.25}),
        (["S1", "S2", "S4"], "afs", {"yaw_radps": 0.25}),
        (["S1", "S2", "S3", "S5"], "ars", {"yaw_radps": 0.15}),  # it turns less
        (["S2"], "ars", {"yaw": lambda t: second_order(t - 0.05, 10.0, 0.6)}),
        (["S2"], "afs", {"yaw": lambda t: second_order(t - 0.05, 10.0, 0.6)}),
        (["S2"], "ars", {"ay_lag_s": 0.25}),
        (["S2"], "afs", {"ay_lag_s": 0.25}),
        (["S3"], "ars", {"rear_rad": 0.01}),
        (["S4"], "afs", {"superposition_rad": -0.005}),
        (["S5"], "ars", {"sideslip_rad": -0.005}),
        (["S5"], "ars", {"sideslip_rad": -0.0105}),  # 0.03 deg more than none
        (["S5"], "afs", {"sideslip_rad": -0.02}),
    ],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_only_the_broken_one_fails(broken, system, change, side):
    arguments = good("step_steer")
    arguments[system] |= change
    assert failing("step_steer", arguments, side=side) == broken


def test_a_peak_that_is_hardly_lower_is_not_lowered():
    arguments = good("step_steer")
    none = check("step_steer", arguments)["S1"].values["none_yaw_rate_peak_abs_radps"]
    for less_degps, holds in ((0.4, False), (0.6, True)):
        yaw_radps = 0.2 * (1.0 - np.radians(less_degps) / none)
        arguments["afs"] = {"superposition_rad": 0.005, "sideslip_rad": -0.01, "yaw_radps": yaw_radps}
        assert check("step_steer", arguments)["S1"].passed is holds


@pytest.mark.parametrize(("number", "system", "word"), [("S3", "ars", "rear"), ("S4", "afs", "superposition")])
def test_a_settled_angle_that_no_workshop_could_set_has_no_sign(number, system, word):
    channel = {"rear": "rear_steer_rad", "superposition": "superposition_rad"}[word]
    for angle_deg, holds in ((0.04, False), (0.06, True)):
        runs = runs_of("step_steer", good("step_steer"))
        settled = runs[system].channels[channel][-1]
        runs[system].channels[channel] *= np.radians(angle_deg) / abs(settled)  # the demand is as it was: it acts
        assert {claim.id: claim for claim in SCENARIOS["step_steer"](runs)}[number].passed is holds


def test_a_response_within_the_tolerance_is_not_later():
    arguments = good("step_steer")
    arguments["ars"]["ay_lag_s"] = 0.204  # 90 % after 2.3 times as long
    assert check("step_steer", arguments)["S2"].passed
    arguments["ars"]["ay_lag_s"] = 0.206
    assert not check("step_steer", arguments)["S2"].passed


def test_values_name_system_and_metric():
    claim = check("step_steer", good("step_steer"))["S1"]
    names = ("yaw_rate_peak_abs_radps", "yaw_rate_steady_state_radps")
    assert set(claim.values) == {f"{system}_{name}" for name in names for system in ("none", "ars", "afs")}


def test_the_give_of_a_hinge_is_no_added_rear_angle():
    runs = runs_of("step_steer", good("step_steer"))
    runs["none"].channels["rear_steer_rad"] = runs["ars"]["rear_steer_rad"]
    assert not {claim.id: claim for claim in SCENARIOS["step_steer"](runs)}["S3"].passed


@pytest.mark.parametrize(("number", "system", "name"), [("S3", "ars", "rear_steer"), ("S4", "afs", "superposition")])
def test_what_the_offset_of_a_sensor_adds_straight_ahead_too_is_nothing_added(number, system, name):
    runs = runs_of("step_steer", good("step_steer"))
    channel = runs[system].channels[f"{name}_rad"]
    runs[system].channels[f"{name}_rad"] = np.full_like(channel, channel[-1])
    assert not {claim.id: claim for claim in SCENARIOS["step_steer"](runs)}[number].passed


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_system_that_does_as_much_straight_ahead_does_not_act(scenario):
    for system, demand in (("ars", "rear_steer_demand_rad"), ("afs", "superposition_demand_rad")):
        runs = runs_of(scenario, good(scenario))
        run = runs[system]
        ahead, largest_rad = run.time_s < 0.5, np.abs(run[demand]).max()
        run.channels["steering_wheel_rad"] = np.where(ahead, 0.0, run["steering_wheel_rad"])
        run.channels[demand] = np.where(ahead, largest_rad, run[demand])
        obstacles = {claim.obstacle for claim in SCENARIOS[scenario](runs)}
        assert all(obstacle.startswith(f"the run {system} never demands") for obstacle in obstacles)


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

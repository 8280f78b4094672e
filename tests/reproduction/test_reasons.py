"""Reasons given in the guides for failed claims, faults and brakes: without the cause, the effect disappears."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from activesteer import simulate
from activesteer.analysis.claims.judge import SCENARIOS, SYSTEMS, Claim
from activesteer.core.conventions import CORNERS
from activesteer.core.metric_table import STEER_RAD

pytestmark = pytest.mark.slow

NARROW_BAND = {
    f"controllers.{system}.corrector.deadband_{end}_degps": value
    for system in ("ars", "afs")
    for end, value in (("start", 0.09), ("end", 0.16))
}
LIGHT, HEAVY = {"factors.mass": 0.9}, {"factors.mass": 1.1}


def claims(maneuver: str, overrides: Mapping[str, Any]) -> dict[str, Claim]:
    runs = {system: simulate(maneuver, system, overrides=overrides) for system in SYSTEMS}
    return {claim.id: claim for claim in SCENARIOS[maneuver](runs)}


def sideslip_peak_deg(maneuver: str, controller: str, **overrides: float) -> float:
    run = simulate(maneuver, controller, overrides={key.replace("__", "."): value for key, value in overrides.items()})
    return math.degrees(np.abs(run["sideslip_rad"]).max())


def test_it_is_the_tolerance_band_that_leaves_the_peak_of_the_step_steer() -> None:
    found = claims("step_steer", NARROW_BAND)
    assert found["S1"].passed
    assert found["S2"].passed
    added = found["S4"].values["afs_added_superposition_steady_state_rad"]
    assert 0.0 < added < STEER_RAD  # S4: the right sign, and too little
    assert not found["S4"].passed


def test_rear_wheels_settle_as_eq_5_says_at_any_speed() -> None:
    slow, fast = (claims("step_steer", {"speed_kmh": speed})["S3"].values for speed in (60, 80))
    rear, front = "ars_added_rear_steer_steady_state_rad", "ars_front_steer_steady_state_rad"
    assert slow[rear] * slow[front] < 0.0 < fast[rear] * fast[front]


def test_it_is_the_prediction_that_takes_the_sideslip_of_the_step_steer() -> None:
    left = [
        simulate("step_steer", "ars", overrides={"controllers.ars.prediction_gain": gain}).metrics
        for gain in (0.0, 0.5, 1.0)
    ]
    none, half, whole = (math.degrees(abs(each["sideslip_steady_state_rad"])) for each in left)
    assert none == pytest.approx(0.26, abs=0.01)
    assert (none - half) == pytest.approx(0.5 * (none - whole), rel=0.2)


@pytest.mark.parametrize("overrides", [NARROW_BAND, LIGHT, HEAVY], ids=["narrow band", "light", "heavy"])
def test_tracks_of_the_lane_change_look_alike_once_front_superposition_acts(overrides: dict[str, float]) -> None:
    assert claims("double_lane_change", overrides)["L1"].passed


@pytest.mark.parametrize("factor", [0.85, 1.15])
def test_it_does_not_act_where_the_yaw_gain_is_the_one_it_believes(factor: float) -> None:
    found = claims("double_lane_change", {"factors.tyre_cornering_stiffness": factor})
    assert "afs never demands" in found["L1"].obstacle


def test_a_corrector_that_believes_in_a_lighter_car_gives_the_sideslip_back() -> None:
    scenario, mass = "double_lane_change_low_mu", 1.1
    none, whole = (sideslip_peak_deg(scenario, each, factors__mass=mass) for each in ("none", "ars"))
    without = sideslip_peak_deg(
        scenario, "ars", factors__mass=mass, controllers__ars__corrector__proportional_gain_s=0.0
    )
    assert without < 0.6 * none
    assert whole > 0.9 * none


def test_the_tesla_is_kept_by_its_grip_and_not_by_its_understeer() -> None:
    def left(vehicle: str, key: str, value: float) -> dict[str, float]:
        return dict(simulate("sine_with_dwell", "none", vehicle=vehicle, overrides={key: value}).metrics)

    gradients = [
        simulate("slowly_increasing_steer", "none", vehicle=vehicle, overrides=overrides).metrics[
            "understeer_gradient_radpmps2"
        ]
        for vehicle, overrides in (("tesla_model_s", {"load.cg_forward_change_m": -0.1}), ("compact", {}))
    ]
    assert gradients[0] < gradients[1]
    moved = left("tesla_model_s", "load.cg_forward_change_m", -0.1)
    slippery = left("tesla_model_s", "factors.tyre_friction", 0.85)
    assert moved["yaw_rate_after_1750ms_share"] < 0.2 < slippery["yaw_rate_after_1750ms_share"]
    assert math.degrees(moved["sideslip_peak_abs_rad"]) < 20.0 < math.degrees(slippery["sideslip_peak_abs_rad"])


@pytest.mark.parametrize(("controller", "low", "high"), [("ars", 0.0, 0.5), ("ars_tuned", 5.0, 90.0)])
def test_feedback_without_a_band_drives_a_reversed_actuator_away_straight_ahead(controller, low, high) -> None:
    changes = {"sensors.preset": "production", "fault": "rear:reversed@1.0", "speed_kmh": 100.0, "duration_s": 3.0}
    recording = simulate("straight_line", controller, overrides=changes)
    assert low <= math.degrees(recording.metrics["yaw_rate_peak_abs_radps"]) <= high


def test_on_split_friction_the_left_rear_wheel_leaves_most_of_what_the_sedan_could_have() -> None:
    """The cause is neither the brakes nor the pressure reduction of the front wheel with grip."""
    limits = {"brakes.front_torque_Nm": 2600.0, "brakes.antilock.side_difference_rise_Paps": 8e6}
    nominal, *others = (
        simulate("split_mu_braking", vehicle="sedan", overrides=overrides)
        for overrides in ({}, *({key: value} for key, value in limits.items()))
    )
    efficiency = nominal.metrics["braking_efficiency"]
    assert all(other.metrics["braking_efficiency"] < efficiency + 0.02 for other in others)
    fast = (nominal.time_s > 1.0) & (nominal["speed_mps"] > 3.0)
    used = {corner: np.mean(nominal[f"{corner}_friction_utilisation"][fast]) for corner in CORNERS}
    assert used["rl"] < 0.5
    assert min(value for corner, value in used.items() if corner != "rl") > 0.8

"""Rear steering by screws in the toe links: range, rate, held load, compliance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer import ActuatorCommand, Recording
from activesteer.config.faults import fault_table
from activesteer.errors import ParameterError
from activesteer.rigs.kc import kinematics_compliance
from activesteer.rigs.kc.held_car import Case, HeldCar
from activesteer.rigs.kc.programme import run
from activesteer.scenario import load_car
from activesteer.studies.linear.linearisation import linearise
from activesteer.vehicle.electric_actuators import RearActuator, presets_of
from activesteer.vehicle.toe_links import evaluated, toe_link_map
from tests.physics.runs import assert_goes_on_bit_by_bit
from tests.raising import raises

SCREW = {"rear_actuator.preset": "screw_3deg"}
STRAIGHT: dict[str, Any] = {"duration_s": 1.2, "settle_s": 0.5, "speed_kmh": 30.0}
TURN = {"steer.steering_wheel_deg": 60.0, "duration_s": 2.0, "settle_s": 0.5, "speed_kmh": 80.0}
LINK = {"compact": "rl_toe_link", "sedan": "rl_tie_rod"}
AT = 100
"""Step at which the rear wheels are asked to steer."""


class Asks:
    """A controller that demands an angle from 0.1 s on."""

    def __init__(self, angle_deg: float) -> None:
        self._angle_rad = math.radians(angle_deg)

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        return ActuatorCommand(self._angle_rad if measurement.time_s >= 1e-3 * (AT - 1) - 1e-9 else 0.0)


def asked(angle_deg: float, overrides: dict[str, Any] | None = None, vehicle: str = "compact") -> Recording:
    changes = {**STRAIGHT, **SCREW, **(overrides or {})}
    return activesteer.simulate("straight_line", Asks(angle_deg), vehicle, overrides=changes)


@pytest.fixture(scope="module")
def three_degrees() -> Recording:
    return asked(3.0)


def arm_m(vehicle: str) -> float:
    """Return the change of the toe link's length over the angle, at the design position [m/rad]."""
    model = load_car(vehicle, SCREW).on().model
    return float(toe_link_map(model, "rl", LINK[vehicle], math.radians(3.0)).travel_of_angle[0])


@pytest.mark.parametrize("vehicle", ["compact", "sedan"])
@pytest.mark.parametrize("preset", ["screw_3deg", "screw_10deg"])
def test_the_wheels_of_both_cars_go_where_they_are_asked_to(vehicle: str, preset: str) -> None:
    angle_deg = 2.0 if preset == "screw_3deg" else 6.0
    run = asked(angle_deg, {"rear_actuator.preset": preset}, vehicle)
    assert run["rear_steer_rad"][-1] == pytest.approx(math.radians(angle_deg), rel=0.005)
    turned = np.array([run[f"{corner}_steer_rad"][[AT - 1, -1]] for corner in ("rl", "rr")])
    # In the mean; each wheel gives way to its own forces, and one screw for both knows one travel.
    assert np.diff(turned).mean() == pytest.approx(math.radians(angle_deg), rel=0.03)


def test_the_speed_limit_of_the_motor_is_the_slew_of_the_wheel(three_degrees: Recording) -> None:
    preset = presets_of(RearActuator)["screw_3deg"]
    slew = preset["speed_limit_radps"] * preset["lead_m"] / (2.0 * math.pi * preset["gear"]) / arm_m("compact")
    middle = slice(AT + 40, AT + 180)
    rate = np.gradient(three_degrees["rear_steer_rad"], 1e-3)[middle]
    # 4.2e-4 m per radian on an arm of 0.222 m, at 100 rad/s.
    assert math.degrees(slew) == pytest.approx(12.3, abs=0.1)
    np.testing.assert_allclose(rate, slew, rtol=0.01)
    assert (three_degrees["rl_steer_saturated"][middle] == 1).all()
    assert not three_degrees["rl_steer_saturated"][-100:].any()


def test_of_a_weak_supply_it_gets_slower_and_without_one_it_stays(three_degrees: Recording) -> None:
    weak = asked(3.0, {"rear_actuator.supply_power_W": 15.0})
    off = asked(3.0, {"rear_actuator.supply_voltage_V": 0.0})
    # The torque of a step belongs to the speed that the step before left.
    power = weak["rl_motor_torque_Nm"][1:] * weak["rl_motor_speed_radps"][:-1]
    assert power.max() == pytest.approx(15.0, rel=1e-9)
    assert weak["rl_screw_m"][AT + 150] < 0.8 * three_degrees["rl_screw_m"][AT + 150]
    assert not off["rl_screw_m"].any()


def test_a_self_locking_screw_holds_under_side_force_without_power_and_another_gives_way() -> None:
    unpowered = {**TURN, **SCREW, "rear_actuator.supply_voltage_V": 0.0}
    holds = activesteer.simulate("step_steer", overrides=unpowered)
    assert np.ptp(holds["rl_toe_link_force_N"]) > 500.0
    assert not holds["rl_screw_m"].any()
    assert not holds["rr_screw_m"].any()
    slips = activesteer.simulate(
        "step_steer",
        overrides={**unpowered, "rear_actuator.load_friction": 0.3, "rear_actuator.friction_torque_Nm": 0.02},
    )
    assert np.abs(slips["rl_screw_m"]).max() > 1e-3
    # The link is under tension and gets longer.
    assert (slips["rl_toe_link_force_N"] * slips["rl_screw_m"])[-1] >= 0.0


def test_tension_is_what_the_stretched_link_carries(three_degrees: Recording) -> None:
    hinged = activesteer.simulate("straight_line", overrides=STRAIGHT)
    assert three_degrees["rl_toe_link_force_N"][50] == pytest.approx(hinged["rl_toe_link_force_N"][50], rel=0.02)


def toe_by_side_force(screw_stiffness_Npm: float) -> float:
    """Return the toe of the left rear wheel per side force at all wheels, on the rig [rad/N]."""
    without_friction = {f"friction.{part}_N": 0.0 for part in ("front_damper", "rear_damper", "rack")}
    changes = {**SCREW, **without_friction, "rear_actuator.screw_stiffness_Npm": screw_stiffness_Npm}
    cases = {x: Case(patch_N=x * np.outer(np.ones(4), [0.0, 1.0, 0.0])) for x in np.linspace(-4000.0, 4000.0, 5)}
    sweep = run(HeldCar(load_car("compact", changes).on()), "side force", "side force", "N", cases)
    return float(np.polyfit(sweep.x, sweep.toe_rad[:, 2], 1)[0])


def test_side_force_turns_the_wheel_by_what_the_link_in_series_with_the_screw_gives() -> None:
    link, arm = 1.64e6, arm_m("compact")
    slope = [toe_by_side_force(stiffness) for stiffness in (1e9, 5e6)]
    # The link's force per side force is that of the lever about the other links: it is the same in both.
    more = {True: 1.0 / 1e9, False: 1.0 / 5e6}
    per_N = (slope[1] - slope[0]) / ((more[False] - more[True]) / arm)
    # By hand, from the hardpoints: the two lower links carry 0.466 / (0.466 - 0.205) of a force at the road, which the
    # camber link balances; of it the toe link has (2.742 - 2.637) / (2.742 - 2.512). Toe-out for a link that gives.
    assert per_N == pytest.approx(-0.82, rel=0.15)
    # With the whole link as soft again, by the same law.
    expected = slope[0] + per_N * (1.0 / link - 1.0 / 1e9) / arm
    assert toe_by_side_force(link) == pytest.approx(expected, rel=0.03)


def test_play_turns_the_wheel_by_half_of_it_towards_the_load() -> None:
    tight, loose = (asked(0.0, {"rear_actuator.backlash_m": play, "duration_s": 0.3}) for play in (0.0, 1e-3))
    assert tight["rl_toe_link_force_N"][-1] > 200.0
    turned = loose["rl_steer_rad"][-1] - tight["rl_steer_rad"][-1]
    # Tension pulls the link out of the nut by half of the play.
    assert turned == pytest.approx(0.5e-3 / arm_m("compact"), rel=0.1)


def test_left_and_right_mirror() -> None:
    left, right = asked(2.0), asked(-2.0)
    for name in ("y_m", "yaw_rate_radps", "rear_steer_rad"):
        np.testing.assert_allclose(left[name], -right[name], atol=1e-7)
    np.testing.assert_allclose(left["rl_toe_link_force_N"], right["rr_toe_link_force_N"], atol=0.5)


def test_a_saved_state_goes_on_bit_by_bit() -> None:
    overrides = {**TURN, **SCREW, "fault": [fault_table("rear:stuck@0.9-1.1")]}
    assert_goes_on_bit_by_bit(overrides, save_at=700, back_after=500)


def test_a_seized_screw_stays_and_a_broken_one_lets_the_link_go() -> None:
    stuck = asked(3.0, {"fault": [fault_table("rear:stuck@0.2")]})
    assert np.ptp(stuck["rl_screw_m"][202:]) == 0.0
    assert 0.1 * np.ptp(stuck["rl_screw_m"]) < stuck["rl_screw_m"][-1]
    broken = activesteer.simulate("step_steer", overrides={**TURN, **SCREW, "fault": [fault_table("rear:float@1.0")]})
    whole = activesteer.simulate("step_steer", overrides={**TURN, **SCREW})
    assert abs(whole["rl_toe_link_force_N"][1500]) > 200.0
    assert abs(broken["rl_steer_rad"][1500] - whole["rl_steer_rad"][1500]) > math.radians(0.5)


@pytest.mark.parametrize(("vehicle", "link"), [("compact", "toe_link"), ("sedan", "tie_rod")])
def test_the_mapping_is_that_of_the_model(vehicle: str, link: str) -> None:
    model = load_car(vehicle, {"rear_actuator.preset": "screw_10deg"}).on().model
    left, right = (toe_link_map(model, corner, f"{corner}_{link}", math.radians(10.0)) for corner in ("rl", "rr"))
    angles = np.radians(np.linspace(-10.0, 10.0, 9))
    there_and_back = evaluated(left.angle_of_travel, evaluated(left.travel_of_angle, angles))
    np.testing.assert_allclose(there_and_back, angles, atol=math.radians(0.01))
    np.testing.assert_allclose(
        evaluated(right.travel_of_angle, angles), evaluated(left.travel_of_angle, -angles), atol=1e-8
    )
    # The compact's toe link is ahead of the wheel: longer steers the left one to the left; the sedan's is behind.
    assert bool(left.travel_of_angle[0] > 0.0) is (vehicle == "compact")


def test_what_only_a_screw_has_is_an_error_at_the_hinge() -> None:
    with raises(ParameterError, key="rear_actuator.lead_m", value=0.003):
        load_car("compact", {"rear_actuator.lead_m": 0.003})


def test_the_rig_shows_angle_camber_and_track_over_the_screw_s_travel() -> None:
    result = kinematics_compliance("compact", {"rear_actuator.preset": "screw_10deg"})
    standing, bump = (result.curves[f"rear_steering{ending}"] for ending in ("", "_bump"))
    turned = np.ptp(standing.steer_rad[:, 2])
    assert turned == pytest.approx(math.radians(20.0), rel=0.03)
    # The axis about which the toe link turns the wheel is not upright: camber and track change with the angle.
    assert np.ptp(standing.camber_rad[:, 2]) > 0.1 * turned
    assert np.ptp(standing.contact_m[:, 2, 1]) > 0.01
    assert bump.camber_rad[6, 2] - standing.camber_rad[6, 2] == pytest.approx(
        math.radians(result["rear", "bump_camber"]) * 0.04, rel=0.3
    )


def test_the_linearised_car_with_screws_steers_as_the_one_with_hinges() -> None:
    hinge, screw = (
        linearise("compact", 80.0 / 3.6, overrides).dcgain()
        for overrides in ({}, {"rear_actuator.preset": "screw_10deg"})
    )
    # The axis about which the toe link turns the wheel leans, and link and screw give way otherwise than the hinge.
    np.testing.assert_allclose(screw[:2, 1], hinge[:2, 1], rtol=0.05)

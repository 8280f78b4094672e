"""The searched steering wheel angle of a manoeuvre, against independent measurements."""

from __future__ import annotations

import functools
import math
from typing import Any

import pytest

import activesteer
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.errors import ManeuverError
from activesteer.maneuver.braking import BrakeInTurn
from activesteer.maneuver.steering_tests import SineWithDwell, StepSteer
from activesteer.scenario import describe, resolve
from activesteer.simulation.preparation import identified, with_amplitude_found
from tests.raising import raises


def dwell_deg(factor: float = 1.0, **overrides: Any) -> float:
    keys = {"steer.amplitude_factor": factor, "settle_s": 1.0}
    keys |= {key.replace("__", "."): value for key, value in overrides.items()}
    maneuver = with_amplitude_found(resolve("sine_with_dwell", overrides=keys)).maneuver
    assert isinstance(maneuver, SineWithDwell)
    assert maneuver.steer.steering_wheel_rad is not None
    return math.degrees(maneuver.steer.steering_wheel_rad)


@functools.cache
def expected_deg() -> float:
    """A from the understeer gradient: ratio times (wheelbase over radius, and the part of the characteristic speed)."""
    scenario = resolve("sine_with_dwell")
    car, speed = identified(scenario.car), scenario.maneuver.speed_mps
    assert car.characteristic_speed_mps is not None
    ackermann = (car.cg_to_front_m + car.cg_to_rear_m) * 0.3 * 9.81 / speed**2
    understeer = 1.0 + (speed / car.characteristic_speed_mps) ** 2
    return math.degrees(scenario.car.config.steering.ratio * ackermann * understeer)


def test_angle_at_03_g_is_that_of_the_understeer_gradient():
    # Above: the tyres give way from the linear range to 0.375 g, and the car lags 0.1 s behind 13.5 deg/s.
    assert expected_deg() < dwell_deg() < 1.12 * expected_deg()


def test_angle_is_rounded_to_a_tenth_of_a_degree_and_then_multiplied():
    one = dwell_deg()
    assert one * 10.0 == pytest.approx(round(one * 10.0), abs=1e-6)
    assert dwell_deg(5.0) == pytest.approx(5.0 * one)
    assert dwell_deg(6.5) == pytest.approx(6.5 * one)


def test_search_judges_whole_step_steers():
    # The search shares the time before the step between its runs, and records the end only.
    wanted, keys = 0.5 * GRAVITY_MPS2, {"steer.start_s": 0.3, "settle_s": 1.0}
    maneuver = with_amplitude_found(
        resolve("step_steer", overrides=keys | {"steer.lateral_acceleration_g": 0.5})
    ).maneuver
    assert isinstance(maneuver, StepSteer)
    assert maneuver.steer.steering_wheel_rad is not None
    found_deg = math.degrees(maneuver.steer.steering_wheel_rad)

    def steady_mps2(steering_wheel_deg: float) -> float:
        overrides = keys | {"steer.steering_wheel_deg": steering_wheel_deg, "duration_s": 4.8}
        return activesteer.simulate("step_steer", overrides=overrides)["ay_mps2"][-500:].mean()

    assert steady_mps2(found_deg) == pytest.approx(wanted, rel=5e-4)
    assert steady_mps2(1.01 * found_deg) > 1.001 * wanted


def test_step_to_the_angle_reaches_03_g():
    angle = dwell_deg()
    overrides = {"steer.steering_wheel_deg": angle, "duration_s": 4.0, "settle_s": 1.0}
    steady = activesteer.simulate("step_steer", overrides=overrides)["ay_mps2"][-500:].mean()
    # Less lag than in the ramp: somewhat more than 0.3 g.
    assert 0.3 * 9.81 < steady < 1.06 * 0.3 * 9.81


def test_ramp_to_the_right_would_give_the_same_angle():
    ramps = [
        activesteer.simulate(
            "slowly_increasing_steer",
            overrides={"steer.rate_degps": rate, "duration_s": 3.0, "settle_s": 1.0},
        )["ay_mps2"]
        for rate in (13.5, -13.5)
    ]
    assert ramps[1] == pytest.approx(-ramps[0], abs=1e-6)


def test_heavier_car_has_an_angle_of_its_own():
    assert dwell_deg(factors__mass=1.2) != dwell_deg()


def test_found_angle_is_described_beside_its_aim():
    scenario = with_amplitude_found(resolve("sine_with_dwell", overrides={"settle_s": 1.0}))
    steer = describe(scenario)["maneuver"]["steer"]
    assert steer["amplitude_factor"] == 5.0
    assert steer["steering_wheel_rad"] == pytest.approx(math.radians(dwell_deg(5.0)))
    assert with_amplitude_found(scenario) is scenario


def test_road_too_slippery_for_03_g_is_answered():
    with raises(ManeuverError, value=pytest.approx(0.375 * GRAVITY_MPS2)):
        dwell_deg(road__mu=0.2)


def test_turn_before_the_brake_has_the_angle_of_a_step_steer():
    overrides = {"settle_s": 1.0, "turn.lateral_acceleration_mps2": 4.0}
    maneuver = with_amplitude_found(resolve("brake_in_turn", overrides=overrides)).maneuver
    assert isinstance(maneuver, BrakeInTurn)
    angle = maneuver.turn.steering_wheel_rad
    assert angle is not None
    run = {"steer.steering_wheel_rad": angle, "settle_s": 1.0}
    assert activesteer.simulate("step_steer", overrides=run)["ay_mps2"][-500:].mean() == pytest.approx(4.0, rel=2e-3)

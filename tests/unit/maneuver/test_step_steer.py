"""Setpoints of the step steer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.steering_tests import StepSteer
from tests.raising import raises
from tests.unit.maneuver.made import made


def step(**keys: Any) -> StepSteer:
    steer = {"steering_wheel_deg": 40.0, "rate_degps": 400.0, "start_s": 0.5} | keys.pop("steer", {})
    steer = {key: value for key, value in steer.items() if value is not None}
    return made(StepSteer, {"kind": "step_steer", "speed_kmh": 80, "duration_s": 3.0, "steer": steer} | keys)


def angle_deg(maneuver: StepSteer, time_s: float) -> float:
    return math.degrees(maneuver.setpoint(time_s).steering_wheel_demand_rad)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_steering_wheel_is_turned_at_its_rate_and_then_held(side):
    maneuver = step(steer={"steering_wheel_deg": side * 40.0})
    times = (0.0, 0.5, 0.55, 0.6, 0.7, 3.0)
    assert [angle_deg(maneuver, time_s) for time_s in times] == pytest.approx(
        [0.0, 0.0, side * 20.0, side * 40.0, side * 40.0, side * 40.0], abs=1e-12
    )


def test_usual_rate_is_faster_than_iso_7401_asks():
    samples = np.array([angle_deg(step(steer={"rate_degps": None}), time_s) for time_s in np.arange(0.5, 0.6, 0.001)])
    assert np.diff(samples).max() / 0.001 > 200.0


def test_speed_is_held_and_the_brake_is_released():
    setpoint = step().setpoint(1.0)
    assert setpoint.speed_demand_mps == pytest.approx(80.0 / 3.6)
    assert setpoint.hold_speed
    assert setpoint.brake_pedal == 0.0


def test_car_settles_straight_ahead_even_if_the_step_comes_at_once():
    maneuver = step(steer={"start_s": 0.0})
    assert maneuver.settling_setpoint().steering_wheel_demand_rad == 0.0
    assert maneuver.settling_setpoint().speed_demand_mps == maneuver.speed_mps


def test_amplitude_found_by_a_search_keeps_the_aim_on_record():
    aimed = step(steer={"steering_wheel_deg": None, "lateral_acceleration_g": 0.4})
    assert angle_deg(aimed, 2.0) == 0.0
    known = aimed.with_amplitude(0.6)
    assert known.setpoint(2.0).steering_wheel_demand_rad == 0.6
    assert known.steer.lateral_acceleration_mps2 == pytest.approx(0.4 * 9.81)


def test_step_without_amplitude_and_aim_is_answered():
    with raises(ManeuverError, file="mine.toml", key="steer"):
        step(steer={"steering_wheel_deg": None})


def test_step_after_the_end_is_answered():
    with raises(ManeuverError, file="mine.toml", key="steer.start_s", value=3.0):
        step(steer={"start_s": 3.0})


@pytest.mark.parametrize("speed_kmh", [-20, 5])
def test_a_search_for_the_amplitude_needs_a_speed_and_a_given_amplitude_does_not(speed_kmh):
    asked = {"steering_wheel_deg": None, "lateral_acceleration_g": 0.4}
    with raises(ManeuverError, key="speed_kmh"):
        step(speed_kmh=speed_kmh, steer=asked)
    assert step(speed_kmh=speed_kmh).speed_mps == pytest.approx(speed_kmh / 3.6)

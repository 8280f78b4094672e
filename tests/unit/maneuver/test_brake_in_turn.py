"""Setpoints of braking in a turn."""

from __future__ import annotations

import math
from typing import Any

import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.braking import BrakeInTurn
from activesteer.maneuver.steering_tests import StepSteer
from tests.raising import raises
from tests.unit.maneuver.made import made


def maneuver(**keys: Any) -> BrakeInTurn:
    table = {
        "kind": "brake_in_turn",
        "speed_kmh": 80,
        "duration_s": 9.5,
        "turn": {"start_s": 0.5, "rate_degps": 60, "steering_wheel_deg": 48},
        "brake": {"start_s": 6.0, "rise_s": 0.2, "pedal": 0.4},
    }
    return made(BrakeInTurn, table | keys)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_wheel_is_turned_and_held_and_then_the_brake_is_pressed(side):
    asked = maneuver(turn={"rate_degps": 60, "steering_wheel_deg": side * 48})
    wheel = [math.degrees(asked.setpoint(t).steering_wheel_demand_rad) for t in (0.0, 0.5, 0.9, 1.3, 6.5, 9.5)]
    assert wheel == pytest.approx([0.0, 0.0, side * 24.0, side * 48.0, side * 48.0, side * 48.0], abs=1e-9)
    pedal = [asked.setpoint(t).brake_pedal for t in (0.0, 5.999, 6.1, 6.2, 9.5)]
    assert pedal == pytest.approx([0.0, 0.0, 0.2, 0.4, 0.4])


def test_throttle_is_released_with_the_brake():
    assert maneuver().setpoint(5.999).hold_speed
    assert not maneuver().setpoint(6.0).hold_speed
    assert maneuver().settling_setpoint().steering_wheel_demand_rad == 0.0


def test_aim_asks_for_the_search_of_the_step_steer():
    assert maneuver().search is None
    asked = maneuver(turn={"lateral_acceleration_mps2": 5.0}, road={"mu": 0.8})
    search = asked.search
    assert search is not None
    assert isinstance(search.probe, StepSteer)
    assert search.lateral_acceleration_mps2 == 5.0
    assert search.probe.road == asked.road
    assert search.probe.speed_mps == asked.speed_mps
    found = search.accept(0.8)
    assert isinstance(found, BrakeInTurn)
    assert found.search is None
    assert found.setpoint(5.0).steering_wheel_demand_rad == pytest.approx(0.8)
    assert found.turn.lateral_acceleration_mps2 == 5.0


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"turn": {}}, "turn"),
        ({"brake": {"pedal": 1.5}}, "brake.pedal"),
        ({"brake": {"pedal": 0.5, "start_s": 0.2}}, "brake.start_s"),
        ({"brake": {"pedal": 0.5, "start_s": 9.4}}, "brake.start_s"),
        ({"speed_kmh": -20, "turn": {"lateral_acceleration_mps2": 5.0}}, "speed_kmh"),
    ],
)
def test_wrong_values_are_answered_with_what_is_allowed(keys, key):
    with raises(ManeuverError, file="mine.toml", key=key):
        maneuver(**keys)


def test_a_search_for_an_acceleration_begins_at_30_km_h():
    aim = {"lateral_acceleration_mps2": 5.0}
    with raises(ManeuverError, key="speed_kmh", value=pytest.approx(29.0)) as refused:
        maneuver(turn=aim, speed_kmh=29.0)
    assert refused.value.allowed.low == pytest.approx(30.0)
    assert maneuver(turn=aim, speed_kmh=30.0).search is not None

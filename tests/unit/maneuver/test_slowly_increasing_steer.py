"""Slowly increasing steer: a ramp of the steering wheel."""

from __future__ import annotations

import math
from typing import Any

import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.steering_tests import SlowlyIncreasingSteer
from tests.raising import raises
from tests.unit.maneuver.made import made


def ramp(**steer: Any) -> SlowlyIncreasingSteer:
    table = {"kind": "slowly_increasing_steer", "speed_kmh": 80, "duration_s": 20.0, "steer": steer}
    return made(SlowlyIncreasingSteer, table)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_steering_wheel_turns_at_the_rate_to_its_end(side):
    maneuver = ramp(start_s=1.0, rate_degps=side * 5.0, end_deg=40.0)
    for time_s, angle_deg in {0.0: 0.0, 1.0: 0.0, 3.0: 10.0, 9.0: 40.0, 15.0: 40.0}.items():
        assert math.degrees(maneuver.setpoint(time_s).steering_wheel_demand_rad) == pytest.approx(
            side * angle_deg, abs=1e-9
        )
    assert maneuver.setpoint(15.0).speed_demand_mps == pytest.approx(80 / 3.6)
    assert maneuver.setpoint(15.0).hold_speed


@pytest.mark.parametrize(
    ("steer", "key"), [({"start_s": 20.0}, "steer.start_s"), ({"rate_degps": 0.0}, "steer"), ({"end_deg": 0}, "steer")]
)
def test_ramp_that_does_not_turn_is_an_error(steer, key):
    with raises(ManeuverError, file="mine.toml", key=key):
        ramp(**steer)

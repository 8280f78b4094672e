"""Setpoints of the sine with dwell."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from activesteer.core.signals import Setpoint
from activesteer.errors import ManeuverError
from activesteer.maneuver.steering_tests import SineWithDwell, SlowlyIncreasingSteer
from tests.raising import raises
from tests.unit.maneuver.made import made


def dwell(**keys: Any) -> SineWithDwell:
    steer = {"steering_wheel_deg": 100.0} | keys.pop("steer", {})
    steer = {key: value for key, value in steer.items() if value is not None}
    table = {"kind": "sine_with_dwell", "speed_kmh": 80, "duration_s": 5.5, "steer": steer}
    return made(SineWithDwell, table | keys)


def angles_deg(maneuver: SineWithDwell, times_s: Any) -> list[float]:
    return [math.degrees(maneuver.setpoint(float(time_s)).steering_wheel_demand_rad) for time_s in times_s]


@pytest.mark.parametrize(("direction", "sign"), [("left", 1.0), ("right", -1.0)])
def test_sine_waits_at_its_second_peak(direction, sign):
    maneuver = dwell(steer={"direction": direction, "start_s": 0.5})
    quarter = 0.25 / 0.7
    times = [0.0, 0.5, 0.5 + quarter, 0.5 + 2 * quarter, 0.5 + 3 * quarter, 1.0 + 3 * quarter, 1.0 + 4 * quarter, 5.0]
    assert angles_deg(maneuver, times) == pytest.approx([sign * a for a in (0, 0, 100, 0, -100, -100, 0, 0)], abs=1e-6)
    waiting = np.linspace(0.5 + 3 * quarter, 1.0 + 3 * quarter, 50)
    assert angles_deg(maneuver, waiting) == pytest.approx(50 * [-100.0 * sign])


def test_steering_ends_after_period_and_dwell():
    steer = dwell(steer={"start_s": 0.5, "frequency_Hz": 0.7, "dwell_s": 0.5}).steer
    assert steer.completion_s == pytest.approx(0.5 + 1.0 / 0.7 + 0.5)
    assert dwell(steer={"dwell_s": 0.0}).steer.completion_s == pytest.approx(0.5 + 1.0 / 0.7)


def test_without_dwell_it_is_a_sine():
    times = np.linspace(0.5, 0.5 + 1.0 / 0.7, 101)
    expected = 100.0 * np.sin(2.0 * np.pi * 0.7 * (times - 0.5))
    assert angles_deg(dwell(steer={"dwell_s": 0.0}), times) == pytest.approx(expected, abs=1e-6)


def test_throttle_is_released_when_the_sine_begins():
    assert dwell().setpoint(0.499).hold_speed
    assert not dwell().setpoint(0.5).hold_speed
    assert dwell().settling_setpoint() == Setpoint(0.0, 80.0 / 3.6, 0.0, hold_speed=True)
    assert dwell(drive="hold_speed").setpoint(2.0).hold_speed


def test_amplitude_by_factor_asks_for_the_ramp_of_fmvss_126():
    assert dwell().search is None
    maneuver = dwell(steer={"steering_wheel_deg": None, "amplitude_factor": 5.0}, road={"mu": 0.8})
    search = maneuver.search
    assert search is not None
    assert isinstance(search.probe, SlowlyIncreasingSteer)
    assert search.lateral_acceleration_mps2 == pytest.approx(0.3 * 9.81)
    assert search.probe.steer.rate_radps == pytest.approx(math.radians(13.5))
    assert search.probe.speed_mps == maneuver.speed_mps
    assert search.probe.road == maneuver.road
    found = search.accept(math.radians(28.0))
    assert isinstance(found, SineWithDwell)
    assert found.search is None
    assert found.steer.steering_wheel_rad == pytest.approx(math.radians(140.0))
    assert found.steer.amplitude_factor == 5.0


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"steer": {"steering_wheel_deg": None}}, "steer"),
        ({"steer": {"direction": "up"}}, "steer.direction"),
        ({"steer": {"frequency_Hz": 0.0}}, "steer.frequency_Hz"),
        ({"steer": {"steering_wheel_deg": -100}}, "steer.steering_wheel_deg"),
        ({"drive": "brake"}, "drive"),
        ({"duration_s": 2.0}, "duration_s"),
        ({"speed_kmh": -20, "steer": {"steering_wheel_deg": None, "amplitude_factor": 5}}, "speed_kmh"),
    ],
)
def test_wrong_values_are_answered_with_what_is_allowed(keys, key):
    with raises(ManeuverError, file="mine.toml", key=key):
        dwell(**keys)


def test_least_duration_is_part_of_the_answer():
    with raises(ManeuverError, key="duration_s") as refused:
        dwell(duration_s=2.0)
    assert refused.value.allowed.low == pytest.approx(4.18, abs=0.005)

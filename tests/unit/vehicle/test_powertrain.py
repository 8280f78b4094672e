"""Torque and power of the engine at the wheels, over their speed."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.vehicle.parameters import Powertrain, PowertrainLimits

ENGINE = Powertrain(
    front_fraction=0.3,
    max_torque_Nm=3000.0,
    max_power_W=90e3,
    engine_brake_torque_Nm=300.0,
    max_wheel_speed_radps=240.0,
)
DRIVE = PowertrainLimits(ENGINE)


def high(speed_radps: float) -> float:
    return DRIVE.limits_Nm(speed_radps, 1)[1]


def test_torque_is_constant_up_to_the_corner_speed_and_power_above():
    assert high(0.0) == high(29.9) == 3000.0
    for speed in np.linspace(30.0, 235.0, 20):
        assert high(speed) * speed == pytest.approx(90e3)


def test_rev_limiter_takes_the_torque_away():
    assert high(239.0) < 0.3 * high(234.0)
    assert high(240.0) == high(500.0) == 0.0


def test_drag_is_shortened_by_the_gear_as_the_torque_is_and_ends_where_the_clutch_opens():
    for speed in (6.0, 20.0, 30.0, 60.0, 200.0):
        low, maximum = DRIVE.limits_Nm(speed, 1)
        assert low / maximum == pytest.approx(-0.1)
    assert DRIVE.limits_Nm(3.0, 1)[0] == pytest.approx(-150.0)
    assert DRIVE.limits_Nm(0.0, 1)[0] == 0.0


def test_rolling_back_the_clutch_slips_and_the_engine_pulls():
    assert DRIVE.limits_Nm(-15.0, 1) == (0.0, 3000.0)


def test_reverse_gear_is_the_mirror():
    for speed in (-100.0, -5.0, 0.0, 5.0, 100.0):
        low, maximum = DRIVE.limits_Nm(speed, 1)
        assert DRIVE.limits_Nm(-speed, -1) == (-maximum, -low)


def test_engine_turns_with_the_mean_of_the_wheels_by_their_shares():
    assert DRIVE.speed_radps((10.0, 30.0, 50.0, 60.0)) == pytest.approx(0.3 * 20.0 + 0.7 * 55.0)
    assert sum(ENGINE.wheel_fractions) == pytest.approx(1.0)

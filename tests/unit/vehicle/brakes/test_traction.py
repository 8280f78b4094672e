"""Traction control reduces drive torque and brakes the faster of two driven wheels."""

from __future__ import annotations

from typing import Any

import pytest

from activesteer.vehicle.brakes import Brakes
from activesteer.vehicle.brakes.brake_control_unit import traction
from activesteer.vehicle.brakes.records import NO_LIMIT_NM
from tests.unit.vehicle.brakes.test_hydraulics import of

CAR = Brakes(front_torque_Nm=2200.0, rear_torque_Nm=700.0, tcs=True)
INTERVAL_S = 0.005


def driving(*wheels_mps: float) -> tuple[Any, Any]:
    """Return setup and state of a car with driven front wheels at 20 m/s."""
    setup, state = of(CAR)
    state.wheel_mps[:] = wheels_mps
    return setup, state


def test_wheels_that_roll_are_left_alone() -> None:
    setup, state = driving(21.5, 21.5, 20.0, 20.0)
    traction(setup, state, 1000.0, False)
    assert (state.drive_limit_Nm, state.tcs_active) == (NO_LIMIT_NM, 0.0)


def test_the_drive_torque_follows_the_excess_at_once_and_in_time() -> None:
    """5 % and 0.6 m/s are allowed: 21.6 m/s, so the excess is 1 m/s."""
    setup, state = driving(22.6, 22.6, 20.0, 20.0)
    traction(setup, state, 1000.0, False)
    assert state.tcs_active == 1.0
    assert state.drive_limit_Nm == pytest.approx(1000.0 - 1500.0 * INTERVAL_S - 400.0)
    traction(setup, state, 1000.0, False)
    assert state.drive_limit_Nm == pytest.approx(1000.0 - 2 * 1500.0 * INTERVAL_S - 400.0)


def test_the_limit_ends_when_the_integral_is_back_at_the_torque_that_is_asked_for() -> None:
    setup, state = driving(20.6, 20.6, 20.0, 20.0)
    state.drive_limit_Nm, state.traction_Nm = 500.0, 990.0
    traction(setup, state, 1000.0, False)
    assert state.drive_limit_Nm == pytest.approx(990.0 + 1500.0 * INTERVAL_S + 400.0)
    traction(setup, state, 1000.0, False)
    assert state.drive_limit_Nm == NO_LIMIT_NM


def test_no_torque_is_taken_back_beyond_0() -> None:
    setup, state = driving(60.0, 60.0, 20.0, 20.0)
    traction(setup, state, 1000.0, False)
    assert state.drive_limit_Nm == 0.0


def test_the_faster_driven_wheel_is_braked() -> None:
    setup, state = driving(24.0, 23.0, 20.0, 20.0)
    traction(setup, state, 1000.0, False)
    assert list(state.traction_Pa) == pytest.approx([1.5e6 * (1.0 - 0.6), 0.0, 0.0, 0.0])


def test_the_pressure_has_a_limit() -> None:
    setup, state = driving(23.0, 40.0, 20.0, 20.0)
    traction(setup, state, 1000.0, False)
    assert list(state.traction_Pa) == [0.0, 6e6, 0.0, 0.0]


def test_a_wheel_that_is_not_driven_is_never_braked() -> None:
    """In a turn or on a bump the rear wheels differ too, and braking one would yaw the car."""
    setup, state = driving(24.0, 24.0, 26.0, 20.0)
    traction(setup, state, 1000.0, False)
    assert state.tcs_active == 1.0
    assert not state.traction_Pa.any()


@pytest.mark.parametrize(("torque_Nm", "braked"), [(1000.0, True), (0.0, False), (-200.0, False)])
def test_braking_or_a_released_throttle_ends_the_control(torque_Nm: float, braked: bool) -> None:
    setup, state = driving(26.0, 24.0, 20.0, 20.0)
    traction(setup, state, 1000.0, False)
    assert state.traction_Pa.any()
    traction(setup, state, torque_Nm, braked)
    assert (state.drive_limit_Nm, state.tcs_active) == (NO_LIMIT_NM, 0.0)
    assert not state.traction_Pa.any()

"""Speed estimate of the control unit: from the wheels while they roll, from the acceleration while they slip."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.vehicle.brakes import Brakes
from activesteer.vehicle.brakes.brake_control_unit import follow_car, follow_wheels
from tests.unit.vehicle.brakes.test_hydraulics import of

CAR = Brakes(front_torque_Nm=2200.0, rear_torque_Nm=700.0)


def test_rolling_it_is_the_speed_of_the_wheels_that_are_not_driven() -> None:
    setup, state = of(CAR)
    follow_wheels(setup, state, np.array([90.0, 92.0, 50.0, 54.0]))
    follow_car(setup, state, 0.0, False)
    assert state.reference_mps == pytest.approx(0.3 * 52.0)


@pytest.mark.parametrize("slope_mps2", [0.0, 1.45, -1.45])
def test_with_all_wheels_locked_it_follows_the_deceleration_on_any_slope(slope_mps2: float) -> None:
    """The effect of gravity on a slope was learned before."""
    setup, state = of(CAR)
    for _ in range(1000):
        follow_wheels(setup, state, np.full(4, 20.0 / 0.3))
        follow_car(setup, state, slope_mps2, False)
    for _ in range(200):
        follow_wheels(setup, state, np.zeros(4))
        follow_car(setup, state, -5.0 + slope_mps2, True)
    assert state.reference_mps == pytest.approx(20.0 - 5.0 * 1.0, abs=0.25)


def test_an_instant_of_a_fast_wheel_does_not_carry_it_away() -> None:
    setup, state = of(CAR)
    for spin in (*[60.0] * 5, *[80.0] * 5, *[60.0] * 5):
        follow_wheels(setup, state, np.array([spin, 60.0, 60.0, 60.0]))
        follow_car(setup, state, -1.0, True)
    assert state.reference_mps < 20.1


def test_at_rest_on_a_hill_it_stays_at_rest() -> None:
    setup, state = of(CAR)
    state.reference_mps = 0.0
    for _ in range(1000):
        follow_wheels(setup, state, np.zeros(4))
        follow_car(setup, state, 1.45, True)
    assert state.reference_mps == 0.0

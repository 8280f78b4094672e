"""The complete control unit: activity of its parts, decision instants, limits of its speed estimate."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from activesteer.vehicle.brakes import Brakes
from activesteer.vehicle.brakes.antilock import BUILD, HOLD, OFF, RECOVER, antilock
from activesteer.vehicle.brakes.brake_control_unit import follow_car, follow_wheels, step_brakes
from activesteer.vehicle.brakes.records import NO_LIMIT_NM
from tests.unit.vehicle.brakes.test_hydraulics import of

CAR = Brakes(front_torque_Nm=2200.0, rear_torque_Nm=700.0)
RADIUS_M, INTERVAL_S = 0.3, 0.005
ROLLING_RADPS = np.full(4, 20.0 / RADIUS_M)


def step(
    setup: Any, state: Any, speeds_radps: np.ndarray, pedal: float, drive_Nm: float = 0.0, count: int = 1
) -> float:
    """Return the remaining drive torque after some steps."""
    left_Nm = drive_Nm
    for _ in range(count):
        left_Nm = step_brakes(setup, state, speeds_radps, 0.0, pedal, drive_Nm, np.zeros(4), 0.0)
    return left_Nm


@pytest.mark.parametrize(("with_abs", "phase"), [(True, 1.0), (False, OFF)])
def test_only_a_car_with_the_anti_lock_system_releases_a_wheel_that_locks(with_abs: bool, phase: float) -> None:
    setup, state = of(Brakes(2200.0, 700.0, abs=with_abs))
    step(setup, state, ROLLING_RADPS, 1.0, count=200)
    locked = ROLLING_RADPS * (0.2, 1.0, 1.0, 1.0)
    step(setup, state, locked, 1.0, count=20)
    assert state.phase[0] == phase


@pytest.mark.parametrize(("with_tcs", "limited"), [(True, True), (False, False)])
def test_only_a_car_with_traction_control_takes_back_the_drive_torque(with_tcs: bool, limited: bool) -> None:
    setup, state = of(Brakes(2200.0, 700.0, tcs=with_tcs))
    left_Nm = step(setup, state, ROLLING_RADPS * (1.5, 1.5, 1.0, 1.0), 0.0, 1000.0, 20)
    assert (left_Nm < 1000.0) == limited
    assert (state.drive_limit_Nm < NO_LIMIT_NM) == limited


def test_it_decides_once_in_each_interval() -> None:
    setup, state = of(CAR)
    assert setup.interval_s == pytest.approx(INTERVAL_S)
    steps = round(INTERVAL_S / setup.timestep_s)
    state.wheel_mps[:] = 0.0
    seen = []
    for _ in range(3 * steps):
        before = float(state.wheel_mps2[0])
        step(setup, state, ROLLING_RADPS, 0.0)
        seen.append(float(state.wheel_mps2[0]) != before)
    assert [index for index, decided in enumerate(seen) if decided] == [steps - 1, 2 * steps - 1, 3 * steps - 1]


def test_a_wheel_faster_than_the_estimate_pulls_it_up_slowly() -> None:
    setup, state = of(CAR)
    state.reference_mps = 10.0
    follow_wheels(setup, state, ROLLING_RADPS)
    follow_car(setup, state, 0.0, True)
    # What it loses beside the acceleration, 0.2 m/s2, and what it gains on the wheels, 2 m/s2.
    assert state.reference_mps == pytest.approx(10.0 + (2.0 - 0.2) * INTERVAL_S)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_no_slope_is_learned_that_is_steeper_than_a_road(side: float) -> None:
    setup, state = of(CAR)
    for _ in range(2000):
        follow_wheels(setup, state, ROLLING_RADPS)
        follow_car(setup, state, side * 2.9, False)
    assert state.offset_mps2 == pytest.approx(side * 2.9, rel=1e-3)
    for _ in range(2000):
        follow_wheels(setup, state, ROLLING_RADPS)
        follow_car(setup, state, side * 6.0, False)
    assert state.offset_mps2 == side * 3.0


@pytest.mark.parametrize("controlled", [0, 1])
def test_either_front_wheel_holds_back_the_other(controlled: int) -> None:
    setup, state = of(CAR)
    state.demand_Pa[:], state.limit_Pa[:] = 5e6, 9e6
    state.phase[controlled], state.borne_Nm[controlled], state.side_Pa = BUILD, 440.0, 1e6
    state.wheel_mps[:] = 20.0
    antilock(setup, state, 0.0, 0.0, setup.full_pedal_pressure_Pa)
    grown_Pa = 1e6 + setup.side_difference_rise_Paps * INTERVAL_S
    assert state.side_Pa == pytest.approx(grown_Pa)
    assert state.allowed_Pa[1 - controlled] == pytest.approx(440.0 / (2200.0 / 10e6) + grown_Pa)
    assert state.allowed_Pa[2] == state.limit_Pa[2]


def test_the_anti_lock_system_controls_then_rolls_and_holds_then_hands_over_as_the_car_gets_slow() -> None:
    for speed_mps, first, after_1s in (
        (5.1, BUILD, BUILD),
        (4.9, RECOVER, HOLD),
        (0.6, RECOVER, HOLD),
        (0.4, OFF, OFF),
    ):
        setup, state = of(CAR)
        state.demand_Pa[:], state.limit_Pa[:], state.phase[0], state.borne_Nm[0] = 5e6, 4e6, BUILD, 440.0
        state.reference_mps = speed_mps
        state.wheel_mps[:] = speed_mps
        antilock(setup, state, 0.0, 0.0, setup.full_pedal_pressure_Pa)
        assert state.phase[0] == first
        for _ in range(round(1.0 / INTERVAL_S)):
            antilock(setup, state, 0.0, 0.0, setup.full_pedal_pressure_Pa)
        assert state.phase[0] == after_1s

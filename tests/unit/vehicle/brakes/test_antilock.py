"""Phases of a wheel under anti-lock control, and the limits between the wheels."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from activesteer.vehicle.brakes import Brakes
from activesteer.vehicle.brakes.antilock import BUILD, HOLD, OFF, RECOVER, RELEASE, antilock
from activesteer.vehicle.brakes.records import Antilock
from tests.unit.vehicle.brakes.test_hydraulics import of

CAR = Brakes(front_torque_Nm=2200.0, rear_torque_Nm=700.0)
INTERVAL_S = 0.005
PER_PRESSURE = 2200.0 / 10e6
FULL_PA = 10e6
BORNE_NM = 1000.0


def braking(brakes: Brakes = CAR, *, phase: float = OFF, slip: float = 0.0, gain_mps2: float = 0.0) -> tuple[Any, Any]:
    """Return setup and state of a car at 20 m/s whose front left wheel is in a phase; the other wheels roll freely."""
    setup, state = of(brakes)
    state.demand_Pa[:] = 5e6
    state.phase[0], state.borne_Nm[0], state.friction_Nm[0] = phase, BORNE_NM, BORNE_NM
    state.limit_Pa[0] = 4e6 if phase != OFF else FULL_PA
    state.wheel_mps[0], state.wheel_mps2[0] = 20.0 * (1.0 - slip), gain_mps2
    return setup, state


def step(setup: Any, state: Any, count: int = 1) -> list[float]:
    """Return the limits of the front left wheel [Pa]."""
    limits = []
    for _ in range(count):
        antilock(setup, state, 0.0, 0.0, FULL_PA)
        limits.append(float(state.limit_Pa[0]))
    return limits


def test_building_up_becomes_faster_with_time() -> None:
    """The first rate applies within each 0.25 s, as on a road with rising friction."""
    setup, state = braking(phase=BUILD)
    limits = step(setup, state, 100)
    rises = [(later - sooner) / INTERVAL_S for sooner, later in pairwise(limits)]
    first_Paps = 0.5 * BORNE_NM / PER_PRESSURE
    assert rises[0] == pytest.approx(first_Paps * (1.0 + 0.010 / 0.25), rel=1e-9)
    assert rises[48] == pytest.approx(2.0 * first_Paps, rel=1e-9)
    assert rises[98] == pytest.approx(3.0 * first_Paps, rel=1e-9)


def test_building_up_ends_at_the_full_pressure() -> None:
    setup, state = braking(phase=BUILD)
    state.limit_Pa[0] = FULL_PA - 1e3
    assert step(setup, state) == [FULL_PA]
    assert state.phase[0] == OFF


@pytest.mark.parametrize(
    ("slip", "gain_mps2", "phase"),
    [(0.10, -25.0, RELEASE), (0.10, -15.0, OFF), (0.06, -25.0, OFF), (0.35, 0.0, RELEASE), (0.35, 4.0, OFF)],
)
def test_a_wheel_is_released_by_deceleration_and_slip(slip: float, gain_mps2: float, phase: float) -> None:
    setup, state = braking(slip=slip, gain_mps2=gain_mps2)
    step(setup, state)
    assert state.phase[0] == phase


def test_while_pressure_builds_up_less_releases_a_wheel() -> None:
    setup, state = braking(phase=BUILD, slip=0.06, gain_mps2=-8.0)
    state.phase_s[0] = 0.2
    step(setup, state)
    assert state.phase[0] == RELEASE


def test_a_build_up_that_has_just_begun_needs_twice_the_slip() -> None:
    setup, state = braking(phase=BUILD, slip=0.035, gain_mps2=-8.0)
    step(setup, state)
    assert state.phase[0] == BUILD
    state.phase_s[0] = 0.2
    step(setup, state)
    assert state.phase[0] == RELEASE


@pytest.mark.parametrize(("friction_Nm", "left_Nm"), [(1000.0, 900.0), (200.0, 200.0 - 10.0 / 0.3), (20.0, 0.0)])
def test_a_released_wheel_keeps_what_lets_it_speed_up(friction_Nm: float, left_Nm: float) -> None:
    """0.9 of the friction torque, or less if 10 m/s2 of 1 kg m2 at 0.3 m need more."""
    setup, state = braking(slip=0.2, gain_mps2=-30.0)
    state.friction_Nm[0] = friction_Nm
    assert step(setup, state) == [pytest.approx(left_Nm / PER_PRESSURE)]


def test_a_wheel_that_is_released_again_soon_is_trusted_nearly_as_before() -> None:
    setup, state = braking(phase=BUILD, slip=0.4, gain_mps2=-30.0)
    state.friction_Nm[0] = 100.0
    step(setup, state)
    assert state.borne_Nm[0] == pytest.approx(0.9 * BORNE_NM)


def test_a_released_wheel_that_does_not_gain_speed_is_released_further() -> None:
    setup, state = braking(phase=RELEASE, slip=0.2)
    limits = step(setup, state, 20)
    assert limits[4] == 4e6, "it has 0.03 s"
    assert limits[7] - limits[8] == pytest.approx(100e6 * INTERVAL_S)
    assert limits[-1] == 0.0


def test_a_wheel_recovers_and_builds_up_below_what_it_bore() -> None:
    setup, state = braking(phase=RELEASE, slip=0.2, gain_mps2=20.0)
    step(setup, state)
    assert state.phase[0] == RECOVER
    state.friction_Nm[0], state.wheel_mps2[0] = 1200.0, 11.0
    step(setup, state)
    assert state.phase[0] == RECOVER, "it still gains more than half of 20 m/s2"
    state.wheel_mps2[0] = 9.0
    assert step(setup, state) == [pytest.approx(0.97 * 1200.0 / PER_PRESSURE)]
    assert state.phase[0] == BUILD


def test_a_wheel_that_locks_again_in_its_recovery_is_released() -> None:
    setup, state = braking(phase=RECOVER, slip=0.5, gain_mps2=-5.0)
    state.wheel_mps2[0] = -1.0
    state.regained_mps2[0] = 4.0
    antilock(setup, state, -30.0, 0.0, FULL_PA)
    assert state.phase[0] == RELEASE


def test_a_wheel_that_stands_does_not_regain_speed_because_the_car_brakes() -> None:
    setup, state = braking(phase=RELEASE, slip=1.0)
    antilock(setup, state, -9.0, 0.0, FULL_PA)
    assert state.phase[0] == RELEASE


def test_a_slow_car_is_handed_over_to_the_driver() -> None:
    setup, state = braking(phase=RELEASE)
    state.reference_mps, state.allowed_Pa[0] = 0.9 * setup.lowest_speed_mps, 3e6
    assert step(setup, state, 2) == [pytest.approx(3e6 + 4e6 * INTERVAL_S), pytest.approx(3e6 + 8e6 * INTERVAL_S)]
    assert state.phase[0] == OFF


def test_a_slow_car_holds_what_the_road_has_borne_and_a_swinging_wheel_does_not_release_it() -> None:
    """It first rolls at less, until its tyre has followed: beyond the peak of the friction it would lock. The
    deceleration would release it at speed; then only a slip far beyond the limit does."""
    setup, state = braking(phase=BUILD, slip=0.0, gain_mps2=-30.0)
    state.reference_mps, state.mean_Nm[0] = 3.0, 800.0
    state.wheel_mps[0] = 2.6
    rolls = round(0.5 / 3.0 / INTERVAL_S) + 1
    assert step(setup, state, rolls) == pytest.approx([0.9 * 800.0 / PER_PRESSURE] * rolls)
    limits = step(setup, state, 100)
    assert limits[0] == pytest.approx(800.0 / PER_PRESSURE, rel=1e-3)
    assert 1.0 < limits[-1] / limits[0] < 1.02
    assert state.phase[0] == HOLD
    state.wheel_mps[0] = 0.3
    step(setup, state)
    assert state.phase[0] == RELEASE
    assert state.mean_Nm[0] == pytest.approx(0.95 * 800.0)


def test_a_released_pedal_ends_the_control() -> None:
    setup, state = braking(phase=RELEASE)
    state.demand_Pa[:] = 0.0
    assert step(setup, state) == [FULL_PA]
    assert state.phase[0] == OFF


@pytest.mark.parametrize(("select_low", "right_Pa"), [(True, 2e6), (False, FULL_PA)])
def test_the_rear_wheels_get_the_lower_pressure(select_low: bool, right_Pa: float) -> None:
    setup, state = braking(Brakes(2200.0, 700.0, antilock=Antilock(select_low=select_low)))
    state.phase[2], state.limit_Pa[2] = RELEASE, 2e6
    step(setup, state)
    assert list(state.allowed_Pa[2:]) == [2e6, right_Pa]


def test_the_front_wheels_differ_by_what_a_driver_can_steer_against() -> None:
    setup, state = braking(phase=BUILD)
    state.side_Pa = 0.5e6
    for steered_Pa in (0.0, 1e6):
        antilock(setup, state, 0.0, steered_Pa, FULL_PA)
        assert state.allowed_Pa[1] == pytest.approx(BORNE_NM / PER_PRESSURE + state.side_Pa + steered_Pa)
    assert state.side_Pa == pytest.approx(0.5e6 + 2 * 4e6 * INTERVAL_S)
    state.phase[0] = OFF
    step(setup, state)
    assert state.side_Pa == 0.5e6


@pytest.mark.parametrize(
    ("fed_Pa", "slip", "phase"), [(FULL_PA, 0.35, RELEASE), (0.0, 0.35, OFF), (0.0, 0.55, RELEASE)]
)
def test_a_front_wheel_that_a_controller_brakes_may_slip_more(fed_Pa: float, slip: float, phase: float) -> None:
    setup, state = braking(slip=slip, gain_mps2=-25.0)
    antilock(setup, state, 0.0, 0.0, fed_Pa)
    assert state.phase[0] == phase

"""Torque over pressure, rates of pressure, and the torque of each wheel for a demand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from activesteer.vehicle.brakes import Brakes, Hydraulics
from activesteer.vehicle.brakes.brake_control_unit import ask, flow
from activesteer.vehicle.brakes.records import BRAKE_STATE, brake_setup, reset

BAR = 1e5
NOTHING = np.zeros(4)


def of(brakes: Brakes, timestep_s: float = 0.001) -> tuple[Any, Any]:
    """Return setup and state in the form of compiled code."""
    setup, state = (
        brake_setup(brakes, timestep_s, [0.3] * 4, [0.5, 0.5, 0.0, 0.0], [1.0] * 4, [True, True, False, False]),
        np.zeros(1, BRAKE_STATE),
    )
    reset(state, setup, 20.0)
    return setup.view(np.recarray)[0], state.view(np.recarray)[0]


def pressures(brakes: Brakes, pedal: float, asked_Nm: np.ndarray, steps: int, start_Pa: float = 0.0) -> np.ndarray:
    setup, state = of(brakes)
    state.pressure_Pa[:] = start_Pa
    rows = []
    for _ in range(steps):
        ask(setup, state, pedal, asked_Nm)
        flow(setup, state, pedal)
        rows.append(state.pressure_Pa.copy())
    return np.array(rows)


CAR = Brakes(front_torque_Nm=2200.0, rear_torque_Nm=700.0)


def test_torque_over_pressure_is_that_of_pads_piston_and_disc() -> None:
    """2 mu A r by hand: a piston of 54 mm, pads of 0.4, an effective radius of 0.12 m."""
    setup, _ = of(CAR)
    by_hand = 2.0 * 0.4 * math.pi / 4.0 * 0.054**2 * 0.12
    assert setup.torque_per_pressure_NmpPa[0] == pytest.approx(by_hand, rel=0.01)
    assert setup.torque_per_pressure_NmpPa[2] / setup.torque_per_pressure_NmpPa[0] == pytest.approx(700.0 / 2200.0)


def test_pressure_rises_at_its_fastest_and_then_by_its_lag() -> None:
    rows = pressures(CAR, 1.0, NOTHING, 300)[:, 0]
    assert np.diff(rows).max() == pytest.approx(100.0 * BAR / 0.1 * 0.001, rel=1e-9)
    assert rows[-1] == pytest.approx(100.0 * BAR, rel=1e-6)
    assert np.diff(rows).min() >= 0.0
    slow = Brakes(2200.0, 700.0, hydraulics=Hydraulics(lag_s=0.05, rise_Paps=1e9))
    assert pressures(slow, 0.5, NOTHING, 50)[-1, 0] == pytest.approx(50.0 * BAR * (1.0 - math.exp(-1.0)), rel=1e-9)


def test_the_dead_travel_of_the_pedal_builds_up_no_pressure() -> None:
    car = Brakes(2200.0, 700.0, hydraulics=Hydraulics(dead_travel=0.2))
    assert pressures(car, 0.2, NOTHING, 300)[-1, 0] == 0.0
    assert pressures(car, 0.6, NOTHING, 300)[-1, 0] == pytest.approx(50.0 * BAR, rel=1e-6)
    assert pressures(car, 1.0, NOTHING, 300)[-1, 0] == pytest.approx(100.0 * BAR, rel=1e-6)


def test_pressure_falls_no_faster_than_the_valve_lets_it() -> None:
    rows = pressures(CAR, 0.0, NOTHING, 300, start_Pa=100.0 * BAR)[:, 3]
    assert np.diff(rows).min() == pytest.approx(-100.0 * BAR / 0.1 * 0.001, rel=1e-9)
    assert 0.0 <= rows[-1] < 1e-3 * BAR


def test_what_the_pedal_does_not_feed_is_pumped_more_slowly() -> None:
    rows = pressures(CAR, 0.0, np.array([1100.0, 0.0, 0.0, 0.0]), 400)
    assert np.diff(rows[:, 0]).max() == pytest.approx(30e6 * 0.001, rel=1e-9)
    assert rows[-1, 0] == pytest.approx(50.0 * BAR, rel=1e-4)
    assert not rows[:, 1:].any()


@pytest.mark.parametrize(("asked_Nm", "bar"), [(-2000.0, 0.0), (-275.0, 12.5), (0.0, 25.0), (9000.0, 100.0)])
def test_what_is_asked_adds_to_the_pedal_between_nothing_and_all(asked_Nm: float, bar: float) -> None:
    rows = pressures(CAR, 0.25, np.array([0.0, asked_Nm, 0.0, 0.0]), 600)
    assert rows[-1, 1] == pytest.approx(bar * BAR, abs=0.01 * BAR)
    assert rows[-1, 0] == pytest.approx(25.0 * BAR, rel=1e-4)


def test_a_brake_without_torque_gets_no_pressure_that_is_no_number() -> None:
    rows = pressures(Brakes(2200.0, 0.0), 0.5, np.array([0.0, 0.0, 100.0, 0.0]), 50)
    assert np.isfinite(rows).all()

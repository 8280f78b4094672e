"""The driver on a circle, with a car that needs more than the Ackermann angle."""

from __future__ import annotations

import pytest

from activesteer.core.signals import Measurement, Motion, Setpoint
from activesteer.driver import ConstantRadiusDriver, OpenLoopDriver, SpeedHold
from tests.unit.driver.drives import DRIVE, parameters

RATIO, WHEELBASE_M, LOCK_RAD, SPEED_MPS, STEP_S = 16.0, 2.6, 8.0, 15.0, 0.001
MOTION = Motion(0.0, 0.0, 0.0, SPEED_MPS, 0.0, 0.0)
UNDERSTEER = 1.4
"""Steer angle over Ackermann angle of the synthetic car."""


def driver() -> ConstantRadiusDriver:
    hold = SpeedHold(parameters(), DRIVE, 1430.0, 0.31, STEP_S)
    return ConstantRadiusDriver(OpenLoopDriver(hold, RATIO, LOCK_RAD), WHEELBASE_M, STEP_S)


def turning(curvature_1pm: float, speed_mps: float = SPEED_MPS) -> Measurement:
    return Measurement(0.0, speed_mps, curvature_1pm * speed_mps, 0.0, 0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0))


def asked(curvature_1pm: float | None) -> Setpoint:
    return Setpoint(0.5, SPEED_MPS, 0.0, True, curvature_1pm)


@pytest.mark.parametrize("curvature_1pm", [0.01, -0.02])
def test_first_angle_is_that_of_ackermann(curvature_1pm):
    command = driver().step(asked(curvature_1pm), turning(0.0), MOTION)
    assert command.steering_wheel_demand_rad == pytest.approx(RATIO * WHEELBASE_M * curvature_1pm)


@pytest.mark.parametrize("curvature_1pm", [0.01, -0.02])
def test_understeer_is_steered_away(curvature_1pm):
    block, driven = driver(), 0.0
    for _ in range(6000):
        angle = block.step(asked(curvature_1pm), turning(driven), MOTION).steering_wheel_demand_rad
        driven += (angle / RATIO / WHEELBASE_M / UNDERSTEER - driven) * STEP_S / 0.1
    assert driven == pytest.approx(curvature_1pm, rel=1e-3)


def test_nothing_is_integrated_at_the_stop_of_the_steering_wheel():
    block = driver()
    for _ in range(5000):
        block.step(asked(0.5), turning(0.0), MOTION)
    assert block.step(asked(0.01), turning(0.01), MOTION).steering_wheel_demand_rad < 0.2 * LOCK_RAD


def test_car_at_rest_gives_no_correction():
    block = driver()
    for _ in range(5000):
        block.step(asked(0.01), turning(0.0, speed_mps=0.0), MOTION)
    command = block.step(asked(0.01), turning(0.0, speed_mps=0.0), MOTION)
    assert command.steering_wheel_demand_rad == pytest.approx(RATIO * WHEELBASE_M * 0.01)


def test_without_a_curvature_the_angle_asked_for_is_turned():
    assert driver().step(asked(None), turning(0.0), MOTION).steering_wheel_demand_rad == 0.5

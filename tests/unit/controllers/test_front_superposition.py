"""Active front steering by superposition, and the car without control."""

from __future__ import annotations

import math

import pytest

from activesteer.controllers import ControllerParameters, FrontSuperposition, NoControl, RearSteer
from activesteer.controllers.parameters import CorrectorParameters, FrontSuperpositionParameters, RearSteerParameters
from activesteer.core.signals import ActuatorCommand
from activesteer.theory.tolerance import tolerance
from tests.unit.controllers.cars import held, measured, setup, steering

LIMIT_RAD = math.radians(3.0)


def gains(**corrector: float) -> ControllerParameters:
    parameters = CorrectorParameters(**corrector)
    return ControllerParameters(
        ars=RearSteerParameters(parameters, prediction_gain=0.0), afs=FrontSuperpositionParameters(parameters)
    )


def controller(**corrector: float) -> FrontSuperposition:
    return FrontSuperposition(setup(gains=gains(**corrector)))


@pytest.mark.parametrize(
    ("front", "yaw_rate", "sign"),
    [
        (0.0, 0.3, -1),  # left turn, oversteer: against the turn
        (0.1, 0.05, 1),  # left turn, understeer: into it
        (0.0, -0.3, 1),  # right turn, oversteer
        (-0.1, -0.05, -1),  # right turn, understeer
    ],
)
def test_superposition_turns_the_front_wheels_by_the_decision_table(front, yaw_rate, sign):
    block = controller(proportional_gain_s=0.05)
    steer = held(block, steering(front), measured(yaw_rate))
    assert math.copysign(1, steer.superposition_demand_rad) == sign
    assert steer.rear_steer_demand_rad == steer.prediction_rad == 0.0


def test_superposed_angle_is_gain_times_tolerated_error():
    block = controller(proportional_gain_s=0.1, deadband_start_radps=0.01, deadband_end_radps=0.06)
    for count in range(200):
        steer = block.step(steering(0.01 * math.sin(0.02 * count)), measured(0.03))
        error = steer.yaw_rate_desired_radps - 0.03
        assert steer.superposition_demand_rad == pytest.approx(0.1 * error * tolerance(error, 0.01, 0.06), rel=1e-12)
        assert steer.correction_rad == steer.superposition_demand_rad


def test_front_and_rear_answer_the_same_error_with_opposite_angles(rng):
    made = setup(gains=gains(integral_gain=0.2, derivative_gain_s2=0.001))
    front, rear = FrontSuperposition(made), RearSteer(made)
    saturated = 0
    for angle, yaw_rate in 0.1 * rng.standard_normal((500, 2)):
        ahead = front.step(steering(angle), measured(yaw_rate))
        behind = rear.step(steering(angle), measured(yaw_rate))
        assert ahead.superposition_demand_rad == -behind.rear_steer_demand_rad
        assert ahead.saturated == behind.saturated
        saturated += ahead.saturated
    assert 0 < saturated < 500


@pytest.mark.parametrize("side", [1, -1])
def test_angle_stops_at_the_limit_and_says_so(side):
    block = controller(proportional_gain_s=1.0)
    steer = block.step(steering(0.0), measured(side * 0.5))
    assert steer.superposition_demand_rad == -side * LIMIT_RAD
    assert steer.saturated is True
    assert block.step(steering(0.0), measured(side * 0.04)).saturated is False


@pytest.mark.parametrize("side", [1, -1])
def test_integral_does_not_wind_up_while_the_limit_is_active(side):
    block = controller(proportional_gain_s=0.0, integral_gain=1.0)
    steer = held(block, steering(0.0), measured(side * 0.3), steps=5000)
    assert steer.saturated
    assert abs(steer.correction_rad) < LIMIT_RAD + 0.3 * 0.001 + 1e-12
    steer = held(block, steering(0.0), measured(-side * 0.3), steps=2)
    assert not steer.saturated


def test_superposition_rests_below_three_metres_per_second():
    block = controller(proportional_gain_s=1.0)
    for speed_mps in (2.9, 0.0, -5.0):
        steer = block.step(steering(0.3), measured(0.5, speed_mps))
        assert steer.superposition_demand_rad == steer.correction_rad == 0.0
        assert not steer.saturated
    assert block.step(steering(0.3), measured(0.5, 3.1)).superposition_demand_rad != 0.0


def test_no_control_turns_nothing_and_tells_the_same_desired_yaw_rate():
    made = setup(gains=gains())
    none, front, rear = (kind(made) for kind in (NoControl, FrontSuperposition, RearSteer))
    told = set()
    for count in range(300):
        message = steering(0.02 * math.sin(0.05 * count)), measured(0.2)
        steer = none.step(*message)
        assert steer == ActuatorCommand(yaw_rate_desired_radps=steer.yaw_rate_desired_radps)
        assert steer.yaw_rate_desired_radps == front.step(*message).yaw_rate_desired_radps
        assert steer.yaw_rate_desired_radps == rear.step(*message).yaw_rate_desired_radps
        told.add(steer.yaw_rate_desired_radps)
    assert len(told) > 100

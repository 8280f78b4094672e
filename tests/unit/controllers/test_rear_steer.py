"""Active rear steering: the prediction in time, the signs, the limits (Dorsch 2012, eq. 5, Fig. 8, Table I)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest

from activesteer.controllers import ControllerParameters, RearSteer, SingleTrack
from activesteer.controllers.parameters import CorrectorParameters, RearSteerParameters
from activesteer.controllers.rear_steer import RearPrediction
from activesteer.theory.tolerance import tolerance
from tests.unit.controllers.cars import CAR, NO_PREDICTION_MPS, held, measured, setup, steering

MODEL = SingleTrack(CAR)
LIMIT_RAD = math.radians(3.0)


def controller(prediction_gain: float = 0.0, limit_rad: float = LIMIT_RAD, **corrector: float) -> RearSteer:
    gains = ControllerParameters(
        ars=RearSteerParameters(CorrectorParameters(**corrector), prediction_gain=prediction_gain, limit_rad=limit_rad)
    )
    return RearSteer(setup(gains=gains))


@pytest.mark.parametrize("speed_mps", [5.0, NO_PREDICTION_MPS, 22.22, 40.0])
def test_prediction_in_time_is_the_transfer_function(speed_mps, rng):
    gain, lead_s, lag_s = MODEL.rear_prediction(speed_mps)
    discrete = control.sample_system(control.tf([lead_s, gain], [lag_s, 1.0]), 0.001, "zoh")
    front_rad: Any = 0.05 * np.cumsum(rng.standard_normal(400)) / 20.0
    expected = control.forced_response(discrete, inputs=front_rad).outputs
    prediction = RearPrediction(MODEL, 0.001)
    assert [prediction.step(angle, speed_mps) for angle in front_rad] == pytest.approx(expected, rel=1e-9, abs=1e-14)


def test_prediction_of_a_ramp_is_the_continuous_response():
    """Compare with the continuous system: inputs held over a step are half a step late."""
    gain, lead_s, lag_s = MODEL.rear_prediction(22.22)
    time_s = np.arange(0.0, 0.5, 0.001)
    front_rad: Any = np.minimum(0.4 * time_s, 0.03)
    expected = control.forced_response(control.tf([lead_s, gain], [lag_s, 1.0]), time_s, front_rad).outputs
    prediction = RearPrediction(MODEL, 0.001)
    result = np.array([prediction.step(angle, 22.22) for angle in front_rad])
    # Half a step of the ramp, times the variation of the step response: down by C_V/C_H, then up to K_H.
    assert np.abs(result - np.asarray(expected)).max() < 0.5 * 0.001 * 0.4 * (0.75 + 0.75 + gain)
    assert result[-1] == pytest.approx(gain * 0.03, rel=1e-3)


def test_prediction_answers_a_step_against_the_front_wheels_and_settles_at_its_gain():
    prediction = RearPrediction(MODEL, 0.001)
    angles = [prediction.step(0.02, 30.0) for _ in range(2000)]
    assert angles[0] == pytest.approx(-0.75 * 0.02, rel=1e-12)
    assert angles[-1] == pytest.approx(MODEL.rear_prediction(30.0)[0] * 0.02, rel=1e-9)
    assert angles[-1] > 0.0


def test_single_track_car_with_prediction_does_not_slip_sideways():
    """The whole chain in time: the model, steered by the block, at constant speed."""
    speed_mps, timestep_s = 25.0, 1e-4
    plant = control.sample_system(MODEL.state_space(speed_mps), timestep_s, "zoh")
    system, inputs = np.asarray(plant.A), np.asarray(plant.B)
    prediction = RearPrediction(MODEL, timestep_s)
    state, without = np.zeros(2), np.zeros(2)
    largest = largest_without = 0.0
    for count in range(5000):
        front = 0.02 * math.sin(2.0 * math.pi * count * timestep_s)
        state = system @ state + inputs @ (front, prediction.step(front, speed_mps))
        without = system @ without + inputs @ (front, 0.0)
        largest, largest_without = max(largest, abs(state[1])), max(largest_without, abs(without[1]))
    assert largest < 1e-3 * largest_without


@pytest.mark.parametrize(
    ("front", "yaw_rate", "sign"),
    [
        (0.0, 0.3, 1),  # left turn, oversteer: with the turn
        (0.1, 0.05, -1),  # left turn, understeer: against it
        (0.0, -0.3, -1),  # right turn, oversteer
        (-0.1, -0.05, 1),  # right turn, understeer
    ],
)
def test_correction_turns_the_rear_wheels_by_the_decision_table(front, yaw_rate, sign):
    block = controller(proportional_gain_s=0.05)
    steer = held(block, steering(front), measured(yaw_rate))
    assert math.copysign(1, steer.rear_steer_demand_rad) == sign
    assert steer.superposition_demand_rad == 0.0
    assert not steer.saturated


def test_rear_angle_is_prediction_less_gain_times_tolerated_error():
    block = controller(prediction_gain=0.6, proportional_gain_s=0.1, deadband_start_radps=0.01, deadband_end_radps=0.06)
    prediction = RearPrediction(MODEL, 0.001)
    for count in range(200):
        front = 0.01 * math.sin(0.02 * count)
        steer = block.step(steering(front), measured(0.03))
        error = steer.yaw_rate_desired_radps - 0.03
        expected = 0.6 * prediction.step(front, 25.0)
        assert steer.prediction_rad == pytest.approx(expected, rel=1e-12)
        assert steer.correction_rad == pytest.approx(-0.1 * error * tolerance(error, 0.01, 0.06), rel=1e-12)
        assert steer.rear_steer_demand_rad == pytest.approx(steer.prediction_rad + steer.correction_rad, rel=1e-12)


@pytest.mark.parametrize("side", [1, -1])
def test_angle_stops_at_the_limit_and_says_so(side):
    block = controller(proportional_gain_s=1.0)
    steer = block.step(steering(0.0), measured(side * 0.5))
    assert steer.rear_steer_demand_rad == side * LIMIT_RAD
    assert steer.saturated is True
    assert steer.correction_rad == pytest.approx(side * 0.5, rel=1e-12)
    steer = block.step(steering(0.0), measured(side * 0.04))
    assert abs(steer.rear_steer_demand_rad) < LIMIT_RAD
    assert steer.saturated is False


@pytest.mark.parametrize("side", [1, -1])
def test_integral_does_not_wind_up_while_the_limit_is_active(side):
    block = controller(proportional_gain_s=0.0, integral_gain=1.0)
    steer = held(block, steering(0.0), measured(side * 0.3), steps=5000)
    assert steer.saturated
    assert abs(steer.correction_rad) < LIMIT_RAD + 0.3 * 0.001 + 1e-12
    steer = held(block, steering(0.0), measured(-side * 0.3), steps=2)
    assert not steer.saturated


def test_integral_can_leave_a_limit_that_the_prediction_holds():
    """The prediction alone exceeds the limit; the corrector must be able to pull the angle back."""
    block = controller(prediction_gain=1.0, proportional_gain_s=0.0, integral_gain=1.0)
    # Slow car, left: the prediction is far to the right, the car yaws too much, so the corrector turns left.
    steer = held(block, steering(0.1), measured(0.5, speed_mps=5.0), steps=3000)
    assert steer.prediction_rad < -LIMIT_RAD
    assert steer.correction_rad > 0.1
    assert steer.rear_steer_demand_rad > -LIMIT_RAD


def test_rear_steering_rests_below_three_metres_per_second():
    block = controller(prediction_gain=1.0, proportional_gain_s=1.0)
    for speed_mps in (2.9, 0.0, -5.0):
        steer = block.step(steering(0.3), measured(0.5, speed_mps))
        assert steer.rear_steer_demand_rad == steer.prediction_rad == steer.correction_rad == 0.0
        assert not steer.saturated
    assert block.step(steering(0.3), measured(0.5, 3.1)).rear_steer_demand_rad != 0.0


def test_rest_clears_the_integral():
    block = controller(proportional_gain_s=0.0, integral_gain=1.0)
    used = held(block, steering(0.0), measured(0.3), steps=100)
    block.step(steering(0.0), measured(0.3, 1.0))
    assert block.step(steering(0.0), measured(0.3)).rear_steer_demand_rad == pytest.approx(
        used.rear_steer_demand_rad / 100, rel=1e-9
    )


def test_left_and_right_are_mirrored_to_the_bit(rng):
    left, right = (controller(1.0, integral_gain=0.2, derivative_gain_s2=0.001) for _ in range(2))
    for front, yaw_rate in 0.1 * rng.standard_normal((300, 2)):
        one, other = (
            left.step(steering(front), measured(yaw_rate)),
            right.step(steering(-front), measured(-yaw_rate)),
        )
        assert one[:5] == tuple(-value for value in other[:5])
        assert one.saturated == other.saturated


def test_car_that_does_as_asked_is_left_alone():
    block = controller(prediction_gain=0.0)
    wanted = 0.01 * MODEL.yaw_rate_gain(25.0)
    steer = held(block, steering(0.01), measured(wanted))
    assert steer.rear_steer_demand_rad == 0.0


def test_gains_of_the_vehicle_file_are_used():
    gains = ControllerParameters()
    stronger = replace(
        gains, ars=replace(gains.ars, prediction_gain=0.0, corrector=CorrectorParameters(proportional_gain_s=0.02))
    )
    steer = RearSteer(setup(gains=stronger)).step(steering(0.0), measured(0.4))
    assert steer.rear_steer_demand_rad == pytest.approx(0.02 * 0.4, rel=1e-12)

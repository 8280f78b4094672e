"""The linear form of a controller answers small signals as the controller itself does."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from activesteer.controllers import load_controller
from activesteer.controllers.linear_form import linear_controller, pulse_responses, response_of
from activesteer.core.signals import ActuatorCommand
from activesteer.errors import ControllerError
from activesteer.scenario import resolve
from tests.raising import raises
from tests.unit.controllers.cars import measured, setup, steering

STEP_S, SPEED_MPS, CALLS = 1e-3, 25.0, 400
ALL_PARTS = {
    "deadband_start_degps": 0.0, "deadband_end_degps": 0.0, "integral_gain": 0.7, "derivative_gain_s2": 0.003,
}  # fmt: skip


@pytest.mark.parametrize("name", ["none", "ars", "afs"])
def test_linear_form_answers_driver_and_yaw_rate_as_the_controller_does(name, rng):
    changed = {f"controllers.{name}.corrector.{key}": value for key, value in ALL_PARTS.items() if name != "none"}
    known = resolve("straight_line", overrides=changed).controller_setup(STEP_S)
    made, form = load_controller(name, known), linear_controller(name, known, SPEED_MPS)
    # Steps of both inputs, far below the limits of the angles. The first call only sets the filter of the derivative.
    inputs = np.repeat(rng.normal(0.0, 1e-3, (CALLS // 40, 2)), 40, axis=0)
    inputs[0] = 0.0
    state = np.zeros(len(form.a))
    for front_rad, yaw_rate_radps in inputs:
        answer = made.step(steering(front_rad), measured(yaw_rate_radps, SPEED_MPS))
        assert not answer.saturated
        demanded = answer.rear_steer_demand_rad, answer.superposition_demand_rad
        assert demanded == pytest.approx(form.c @ state + form.d @ (front_rad, yaw_rate_radps), abs=1e-12)
        state = form.a @ state + form.b @ (front_rad, yaw_rate_radps)
    assert np.abs(state).max() > 0.0


class FirstOrder:
    """Follows the yaw rate with a lag."""

    def __init__(self, lag_s: float) -> None:
        self.lag_s, self.angle_rad = lag_s, 0.0

    def step(self, _, measurement):
        self.angle_rad += -np.expm1(-STEP_S / self.lag_s) * (measurement.yaw_rate_radps - self.angle_rad)
        return ActuatorCommand(self.angle_rad, 0.01 * measurement.ay_mps2)


class Limited:
    """Answers each measurement in proportion, up to a limit."""

    limits: ClassVar = {"yaw_rate_radps": 2e-4, "ay_mps2": 2e-3, "rear_steer_rad": 2e-5, "superposition_rad": 2e-5}

    def step(self, _, measurement):
        return ActuatorCommand(sum(min(getattr(measurement, name), most) for name, most in self.limits.items()))


def pulses_of(given):
    return pulse_responses(load_controller(given, setup()), measured(0.0, SPEED_MPS), STEP_S)


def test_response_of_a_first_order_lag_is_that_of_a_first_order_lag():
    pulses = pulses_of(FirstOrder(0.05))
    frequencies_radps = np.array([1.0, 20.0, 100.0])
    found = response_of(pulses, STEP_S)(frequencies_radps)
    lag = 1.0 / (1.0 + 0.05j * frequencies_radps)
    # Sampled: ahead of the continuous lag by half a step, 5 % of a radian at 100 rad/s.
    assert found[:, 0, 0] == pytest.approx(lag, rel=0.06)
    assert found[:, 1, 1] == pytest.approx(0.01, rel=1e-9)
    assert not found[:, 0, 1:].any()


def test_controller_that_still_answers_in_the_last_tenth_of_8_s_has_no_response():
    # After 7.2 s an answer with a lag of 1.95 s is at exp(-7.2 / 1.95) = 2.5 %, one with a lag of 1.7 s at 1.4 %.
    with raises(ControllerError, value="yaw_rate_radps"):
        pulses_of(FirstOrder(1.95))
    assert pulses_of(FirstOrder(1.7)).any()


def test_pulses_stay_a_hundred_times_below_what_sensors_resolve():
    # Gyro 0.01 rad/s, accelerometer 0.1 m/s2, angles 0.1 deg: none of these limits is a fiftieth of that.
    assert pulses_of(Limited())[0, 0] == pytest.approx(np.ones(4))

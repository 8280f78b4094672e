"""Front superposition by a motor and a gear, its lock, and the torque at the hands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer import ActuatorCommand, Recording
from activesteer.config.faults import fault_table
from activesteer.errors import ParameterError
from activesteer.scenario import load_car
from activesteer.vehicle.electric_actuators import SuperpositionActuator, presets_of
from tests.raising import raises

GEARED = {"superposition_actuator.preset": "strain_wave"}
STRAIGHT: dict[str, Any] = {"duration_s": 0.8, "settle_s": 0.5, "speed_kmh": 60.0}
AT = 100
"""Step at which 2 deg are asked for."""


class Asks:
    """A controller that demands 2 deg at the front wheels from 0.1 s on."""

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        asks = measurement.time_s >= 1e-3 * (AT - 1) - 1e-9
        return ActuatorCommand(superposition_demand_rad=math.radians(2.0) if asks else 0.0)


class Sways:
    """A controller that demands a sine of 1 deg at 1 Hz."""

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        phase = 2.0 * math.pi * max(measurement.time_s, 0.0)
        return ActuatorCommand(superposition_demand_rad=math.radians(1.0) * math.sin(phase))


def asked(overrides: dict[str, Any] | None = None) -> Recording:
    return activesteer.simulate("straight_line", Asks, overrides={**STRAIGHT, **(overrides or {})})


@pytest.fixture(scope="module")
def geared() -> Recording:
    return asked(GEARED)


def test_it_gets_there_at_the_speed_of_its_motor(geared: Recording) -> None:
    assert geared["superposition_rad"][-1] == pytest.approx(math.radians(2.0), rel=0.01)
    ratio = load_car("compact").config.steering.ratio
    preset = presets_of(SuperpositionActuator)["strain_wave"]
    slew = preset["speed_limit_radps"] / preset["gear"] / ratio
    # 400 rad/s through 50 : 1 and the steering ratio of 15.8.
    assert math.degrees(slew) == pytest.approx(29.0, abs=0.1)
    # The mean: the light gear rings on its stiffness from step to step.
    rate = (geared["superposition_rad"][AT + 50] - geared["superposition_rad"][AT + 30]) / 0.02
    assert rate == pytest.approx(slew, rel=0.02)
    assert geared["superposition_saturated"][AT + 30]
    assert not geared["superposition_saturated"][-1]


def test_its_reaction_reaches_the_hands(geared: Recording) -> None:
    """With the steering wheel held, the hands carry the column torque minus the share of the assist."""
    hand = geared["hand_torque_Nm"]
    assert abs(hand[AT - 1]) < 0.05
    # The rack is pushed to the left by 2 deg of superposition; to hold the wheel against it the hands push left too.
    assert hand[-1] > 1.0
    without = asked({**GEARED, "steering.assist_fraction": 0.0})
    np.testing.assert_allclose(without["hand_torque_Nm"] * 0.65, hand, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(without["yaw_rate_radps"], geared["yaw_rate_radps"])


def test_hands_that_hold_no_more_than_a_torque_are_turned_against_the_superposition(geared: Recording) -> None:
    weak = asked({**GEARED, "driver.steering_torque_limit_Nm": 2.0})
    # The column also speeds the steering wheel up, 0.04 kgm2, against 0.2 Nms/rad of its bearings; the rest holds it.
    rate = np.gradient(weak["steering_wheel_rad"], 1e-3)
    held = weak["hand_torque_Nm"] + 0.65 * (0.04 * np.gradient(rate, 1e-3) + 0.2 * rate)
    # All that they can once the motor's first jerk is over; the difference of angles is what is not exact.
    np.testing.assert_allclose(held[AT + 80 :], 2.0, rtol=0.06)
    assert geared["hand_torque_Nm"][-200:].min() > 2.0
    assert weak["steering_wheel_rad"][-1] < math.radians(-5.0)
    assert abs(geared["steering_wheel_rad"][-1]) < math.radians(0.1)
    assert weak["yaw_rate_radps"][-1] < geared["yaw_rate_radps"][-1]


def test_without_supply_the_lock_holds_the_steering_together() -> None:
    turn = {"steer.steering_wheel_deg": 45.0, "duration_s": 1.5, "settle_s": 0.5}
    locked, servo = (
        activesteer.simulate("step_steer", overrides={**turn, **overrides})
        for overrides in ({**GEARED, "superposition_actuator.supply_voltage_V": 0.0}, {})
    )
    assert not locked["superposition_motor_speed_radps"].any()
    np.testing.assert_allclose(locked["yaw_rate_radps"][-1], servo["yaw_rate_radps"][-1], rtol=1e-3)
    # Without the lock the gear, which does not lock itself, lets the hands turn it and not the rack.
    open_ = activesteer.simulate(
        "step_steer",
        overrides={
            **turn, **GEARED, "superposition_actuator.supply_voltage_V": 0.0,
            "superposition_actuator.lock_torque_Nm": 0.0, "superposition_actuator.friction_torque_Nm": 0.0,
        },
    )  # fmt: skip
    assert open_["yaw_rate_radps"][-1] < 0.8 * locked["yaw_rate_radps"][-1]


def test_stuck_adds_nothing_more() -> None:
    stuck = asked({**GEARED, "fault": [fault_table("superposition:stuck@0.13")]})
    assert not stuck["superposition_motor_speed_radps"][132:].any()
    assert np.ptp(stuck["superposition_rad"][180:]) < math.radians(0.02)
    assert math.radians(0.3) < stuck["superposition_rad"][-1] < math.radians(1.5)


def test_what_only_a_motor_has_is_an_error_at_the_servo() -> None:
    with raises(ParameterError, key="superposition_actuator.lock_torque_Nm", value=1.0):
        load_car("compact", {"superposition_actuator.lock_torque_Nm": 1.0})


@pytest.mark.parametrize("vehicle", ["compact", "sedan"])
def test_the_hands_feel_no_steps_of_the_simulation_while_the_superposition_moves(vehicle: str) -> None:
    """A demand of 1 Hz; any other torque at the hands would come from the engine's step on stiff parts."""
    straight = {**STRAIGHT, "duration_s": 1.2}
    hand = activesteer.simulate("straight_line", Sways, vehicle, straight)["hand_torque_Nm"][100:]
    smooth = np.convolve(hand, np.full(21, 1.0 / 21.0), "valid")
    assert np.ptp(smooth) > 2.0
    assert np.abs(hand[10:-10] - smooth).max() < 0.01 * np.ptp(smooth)

"""The control unit: rate, bus, and the information for a controller."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, Motion
from activesteer.errors import ParameterError
from activesteer.recording import Recording
from activesteer.scenario import resolve
from activesteer.simulation.closed_loop import ClosedLoop
from tests.physics.runs import STEP_DEG, assert_goes_on_from_its_state
from tests.raising import raises

STEP = {"steer.steering_wheel_deg": STEP_DEG, "settle_s": 0.2, "duration_s": 3.0}


class Counting:
    """A controller that demands the number of its calls, times 1e-4 rad."""

    def __init__(self, setup: Any = None) -> None:
        self.calls = 0
        self.setup = setup
        self.seen: list[Any] = []

    def step(self, *seen: Any) -> ActuatorCommand:
        self.calls += 1
        self.seen = [*seen]
        return ActuatorCommand(rear_steer_demand_rad=1e-4 * self.calls)


class Sees:
    """A controller that keeps what it is told."""

    def __init__(self) -> None:
        self.seen: list[Any] = []

    def step(self, *seen: Any) -> ActuatorCommand:
        self.seen.append(seen)
        return ActuatorCommand()


def driven(controller: Any, steps: int, **overrides: Any) -> tuple[ClosedLoop, Any]:
    """Return a loop after some steps without settling, and its controller."""
    loop = ClosedLoop(resolve("step_steer", overrides={**STEP, "settle_s": 0.0, **overrides}), controller)
    loop.advance(steps)
    return loop, loop.controller.inner


@pytest.mark.parametrize(
    ("every", "delay", "asked"),
    [
        (1, 0, [1, 2, 3, 4, 5, 6, 7]),
        (3, 0, [1, 1, 1, 2, 2, 2, 3]),
        (1, 2, [0, 0, 1, 2, 3, 4, 5]),
        (3, 2, [0, 0, 1, 1, 1, 2, 2]),
    ],
)
def test_command_is_held_between_calls_and_comes_out_behind_the_bus(every: int, delay: int, asked: list[int]) -> None:
    unit = {"controllers.interval_s": 0.001 * every, "controllers.bus_delay_s": 0.001 * delay}
    loop, _ = driven(Counting, 0, **unit)
    found = []
    for _ in asked:
        loop.advance(1)
        found.append(round(1e4 * loop.commands[1].rear_steer_demand_rad))
    assert found == asked


def test_driver_s_demand_is_known_through_the_steering_angle_sensor() -> None:
    noisy = {"sensors.steering_wheel.delay_s": 0.01}
    loop, controller = driven(Sees, 600, **noisy)
    command, measurement = controller.seen[-1]
    ratio = loop.vehicle.parameters.steering.ratio
    assert command.steering_wheel_demand_rad == measurement.steering_wheel_rad != 0.0
    assert command.front_steer_demand_rad == measurement.steering_wheel_rad / ratio
    assert loop.commands[0].steering_wheel_demand_rad != command.steering_wheel_demand_rad


def test_a_controller_that_asks_for_it_gets_the_truth() -> None:
    class Knows(Sees):
        uses_truth = True

    _, controller = driven(Knows, 600, **{"sensors.preset": "production"})
    command, measurement, motion = controller.seen[-1]
    assert isinstance(motion, Motion)
    assert measurement.yaw_rate_radps == motion.yaw_rate_radps
    assert command.steering_wheel_demand_rad == pytest.approx(np.radians(STEP_DEG))


class SlowCounting(Counting):
    interval_s = 0.005


def _rear(recording: Recording) -> np.ndarray:
    return np.flatnonzero(np.diff(recording["rear_steer_demand_rad"]))


def test_rate_is_the_class_s_own_or_the_vehicle_file_s_and_the_controller_knows_it() -> None:
    own = activesteer.simulate("step_steer", SlowCounting, overrides=STEP)
    assert set(np.diff(_rear(own))) == {5}
    assert own.metadata["controller_interval_s"] == pytest.approx(0.005)
    given = activesteer.simulate("step_steer", SlowCounting, overrides=STEP | {"controllers.interval_s": 0.01})
    assert set(np.diff(_rear(given))) == {10}
    loop = ClosedLoop(resolve("step_steer", overrides=STEP | {"controllers.interval_s": 0.01}), "ars")
    assert loop.controller_setup.timestep_s == pytest.approx(0.01)


def test_bus_delays_the_same_commands() -> None:
    # Of the open loop's driver, whom the commands do not reach: these are the same, only later.
    at_once, later = (
        activesteer.simulate("step_steer", SlowCounting, overrides=STEP | {"controllers.bus_delay_s": delay_s})
        for delay_s in (0.0, 0.003)
    )
    np.testing.assert_array_equal(later["rear_steer_demand_rad"][3:], at_once["rear_steer_demand_rad"][:-3])


def test_state_is_restored_bit_identically() -> None:
    overrides = STEP | {"controllers.interval_s": 0.005, "controllers.bus_delay_s": 0.003}
    simulation = ClosedLoop(resolve("step_steer", overrides=overrides), "ars")
    simulation.advance(903)
    assert_goes_on_from_its_state(simulation, 300)


def test_a_slower_controller_behind_a_bus_still_steers_but_later() -> None:
    quick = activesteer.simulate("step_steer", "ars", overrides=STEP)
    slow = activesteer.simulate(
        "step_steer", "ars", overrides=STEP | {"controllers.interval_s": 0.01, "controllers.bus_delay_s": 0.01}
    )
    assert slow.metrics["yaw_rate_overshoot"] > quick.metrics["yaw_rate_overshoot"]
    np.testing.assert_allclose(
        slow.metrics["yaw_rate_steady_state_radps"], quick.metrics["yaw_rate_steady_state_radps"], rtol=0.01
    )


@pytest.mark.parametrize(("key", "value"), [("controllers.interval_s", 0.0015), ("controllers.bus_delay_s", 0.0005)])
def test_what_is_no_whole_number_of_steps_is_refused(key: str, value: float) -> None:
    with raises(ParameterError, key=key, value=value):
        activesteer.simulate("step_steer", "ars", overrides=STEP | {key: value})


class Omniscient:
    uses_truth = True

    def step(self, command: DriverCommand, measurement: Measurement, motion: Motion) -> ActuatorCommand:
        assert measurement.yaw_rate_radps == motion.yaw_rate_radps
        return ActuatorCommand(rear_steer_demand_rad=-0.2 * motion.lateral_speed_mps / max(motion.speed_mps, 3.0))


def test_use_of_the_truth_is_said_wherever_results_are_shown() -> None:
    recording = activesteer.simulate("step_steer", Omniscient, overrides=STEP | {"sensors.preset": "production"})
    assert recording.metadata["controller_uses_truth"] is True
    assert activesteer.controllers.controller_spec(Omniscient).label == "Omniscient+truth"
    assert np.abs(recording["rear_steer_demand_rad"]).max() > 1e-4
    assert "controller_uses_truth" not in activesteer.simulate("step_steer", "ars", overrides=STEP).metadata

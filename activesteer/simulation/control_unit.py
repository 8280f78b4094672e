"""The control unit around a controller: sampling rate, delay of the bus, source of the driver's demand."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from activesteer.controllers import Controller, ControllerParameters, ControllerSetup, find_controller
from activesteer.errors import ParameterError
from activesteer.plugins import Plugin
from activesteer.scenario import Scenario
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, Motion, new_message
from activesteer.vehicle import Vehicle
from activesteer.vehicle.steering_rates import steering_rates

_SLOWER: Final = 0.95
"""Ratio of rates below which an actuator counts as slower: loads and geometry change the rate by some percent."""
_STEERING_WHEEL: Final = DriverCommand._fields.index("steering_wheel_demand_rad")
_FRONT_STEER: Final = DriverCommand._fields.index("front_steer_demand_rad")


class ControlUnit:
    """A controller that is called at its own rate, and whose held command arrives after the delay of the bus."""

    def __init__(
        self,
        inner: Any,
        every: int,
        delay: int,
        *,
        steering_ratio: float | None = None,
        truth: Callable[[], tuple[Measurement, Motion]] | None = None,
    ) -> None:
        """Connect a controller to its bus.

        Args:
            inner: The controller.
            every: Steps of the simulation between two calls.
            delay: Steps that a command takes to arrive.
            steering_ratio: If given, the controller reads the driver's demand from the steering angle sensor; this
                overall ratio converts it to the road wheels.
            truth: If given, the controller gets this true measurement instead of the sensors' signals, and the motion
                as a third argument.
        """
        self.inner = inner
        self._every, self._steps = every, 0
        self._steering_ratio = steering_ratio
        self._truth = truth
        self._held = ActuatorCommand()
        self._on_bus: deque[ActuatorCommand] = deque([self._held] * delay, maxlen=delay + 1)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the command that reaches the actuators now."""
        if self._steps % self._every == 0:
            if self._truth is not None:
                self._held = self.inner.step(command, *self._truth())
            else:
                self._held = self.inner.step(self._seen(command, measurement), measurement)
        self._steps += 1
        self._on_bus.append(self._held)
        return self._on_bus[0]

    def memory(self) -> tuple[int, int, float, ActuatorCommand, list[ActuatorCommand]]:
        """Return steps between two calls, steps so far, steering ratio or 0, held command, commands on the bus."""
        return self._every, self._steps, self._steering_ratio or 0.0, self._held, list(self._on_bus)

    def put_memory(self, steps: int, held: ActuatorCommand, on_bus: list[ActuatorCommand]) -> None:
        """Take over steps so far, the held command and the commands on the bus; see `memory`."""
        self._steps, self._held = steps, held
        self._on_bus.clear()
        self._on_bus.extend(on_bus)

    @property
    def uses_truth(self) -> bool:
        """Flag of a controller that gets the truth instead of the sensors' signals."""
        return self._truth is not None

    def read_truth_of(self, vehicle: Vehicle) -> None:
        """Read the truth, if the controller uses it, from this car."""
        if self._truth is not None:
            self._truth = vehicle.truth

    def __getstate__(self) -> dict[str, Any]:
        """The state without the car; a copy gets its car by `read_truth_of`."""
        return {**self.__dict__, "_truth": None if self._truth is None else _no_truth}

    def _seen(self, command: DriverCommand, measurement: Measurement) -> DriverCommand:
        if self._steering_ratio is None:
            return command
        # `_replace` would cost more than all else here.
        seen: list[Any] = [*command]
        seen[_STEERING_WHEEL] = angle = measurement.steering_wheel_rad
        seen[_FRONT_STEER] = angle / self._steering_ratio
        return new_message(DriverCommand, seen)


def _no_truth() -> tuple[Measurement, Motion]:
    raise AssertionError("a copied control unit has no car yet")


def interval_s(plugin: Plugin, parameters: ControllerParameters, timestep_s: float) -> float:
    """Time between two calls of a controller [s].

    It is `controllers.interval_s` of the vehicle file, else the controller's attribute `interval_s`, else the step.

    Args:
        plugin: The controller.
        parameters: The table [controllers] of the vehicle file.
        timestep_s: Step of the simulation [s].

    Raises:
        ParameterError: the interval is not a whole number of steps.
    """
    given = parameters.interval_s
    own = getattr(plugin.origin, "interval_s", None)
    if given is None and own is None:
        return timestep_s
    return _steps("controllers.interval_s", given if given is not None else own, timestep_s, 1) * timestep_s


def control_unit(controller: Any, scenario: Scenario, vehicle: Vehicle) -> tuple[ControllerSetup, Controller]:
    """Create a controller as the loop calls it in every step.

    Args:
        controller: The controller; see `activesteer.plugins.find`.
        scenario: Manoeuvre and car.
        vehicle: The car in the engine.

    Returns:
        The properties of the car that the controller may know; and the controller. It is inside a control unit unless
        it works in every step, without delay, and on the driver's own demand.

    Raises:
        ParameterError: its interval or the delay of the bus is not a whole number of steps.
        ControllerError: there is no such controller, or it cannot be created.
    """
    plugin, car, timestep_s = find_controller(controller), scenario.car.config, vehicle.timestep_s
    setup = _with_rates(scenario.controller_setup(interval_s(plugin, car.controllers, timestep_s)), scenario, vehicle)
    every = round(setup.timestep_s / timestep_s)
    delay = _steps("controllers.bus_delay_s", car.controllers.bus_delay_s, timestep_s, 0)
    ratio = None if car.sensors.steering_wheel.is_ideal else car.steering.ratio
    block = plugin.make(setup)
    if every == 1 and delay == 0 and ratio is None and not plugin.uses_truth:
        return setup, block
    truth = vehicle.truth if plugin.uses_truth else None
    return setup, ControlUnit(block, every, delay, steering_ratio=ratio, truth=truth)


def _with_rates(setup: ControllerSetup, scenario: Scenario, vehicle: Vehicle) -> ControllerSetup:
    """Tell the controller the rates of slower actuators than those in its table, unless an override sets them."""
    rates, servos, gains = steering_rates(vehicle.model, scenario.car.config), setup.gains.servos, setup.gains
    slower = {
        name: rate_radps
        for name, rate_radps in (("rear_rate_radps", rates.rear), ("superposition_rate_radps", rates.superposition))
        if f"servos.{name}" not in setup.overridden and rate_radps < _SLOWER * getattr(servos, name)
    }
    return replace(setup, gains=replace(gains, servos=replace(servos, **slower))) if slower else setup


def slow_actuators(plugin: Plugin, scenario: Scenario, vehicle: Vehicle) -> str:
    """Describe the actuators that are slower than the controller needs by its `rates_radps`; empty if none."""
    needed = getattr(plugin.origin, "rates_radps", {})
    rates = steering_rates(vehicle.model, scenario.car.config)._asdict() if needed else {}
    return "; ".join(
        f"{name.replace('rear', 'rear steering')} turns the wheels at {math.degrees(rates[name]):.0f} deg/s, "
        f"{plugin.label} needs {math.degrees(need_radps):.0f} deg/s"
        for name, need_radps in needed.items()
        if rates[name] < _SLOWER * need_radps
    )


def told_by_sensor(controller: Any, steering_ratio: float) -> ControlUnit:
    """Wrap a controller so that it reads the driver's demand from the steering angle sensor.

    Args:
        controller: As `control_unit` returns it; it keeps its memory.
        steering_ratio: Overall steering ratio.
    """
    by_truth = isinstance(controller, ControlUnit) and controller.uses_truth
    return ControlUnit(controller, 1, 0, steering_ratio=None if by_truth else steering_ratio)


def about(plugin: Plugin, parameters: ControllerParameters, timestep_s: float) -> dict[str, Any]:
    """Metadata of a controller in a recording: whether it uses the truth, and its own interval."""
    uses_truth = {"controller_uses_truth": True} if plugin.uses_truth else {}
    own_s = interval_s(plugin, parameters, timestep_s)
    return uses_truth | ({"controller_interval_s": own_s} if own_s != timestep_s else {})


def _steps(key: str, value: Any, timestep_s: float, minimum: int) -> int:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    steps = round(value / timestep_s) if number and 0.0 <= value <= 0.1 else -1
    if steps < minimum or abs(steps * timestep_s - value) > 1e-9:
        raise ParameterError(
            f"is {value!r} s; a whole number of steps ({timestep_s:g} s), 0.1 s at most, is needed",
            key=key,
            value=value,
        )
    return steps

"""The control unit around a controller: its own rate, the bus behind it, and what it is told of the driver."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Callable
from typing import Any, Final

from activesteer.controllers import Controller, ControllerParameters, ControllerSetup, find_controller
from activesteer.errors import ParameterError
from activesteer.plugins import Plugin
from activesteer.scenario import Scenario
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, Motion, made
from activesteer.vehicle import Vehicle

_STEERING_WHEEL: Final = DriverCommand._fields.index("steering_wheel_demand_rad")
_FRONT_STEER: Final = DriverCommand._fields.index("front_steer_demand_rad")


class ControlUnit:
    """Calls a controller at its own rate; its command is held in between and comes out behind the delay of the bus.

    Attributes:
        inner: The controller.
    """

    def __init__(
        self,
        inner: Any,
        every: int,
        delay: int,
        *,
        steering_ratio: float | None = None,
        truth: Callable[[], tuple[Measurement, Motion]] | None = None,
    ) -> None:
        """Puts a controller on its rate and its bus.

        Args:
            inner: The controller.
            every: Steps of the simulation between two calls.
            delay: Steps that a command takes.
            steering_ratio: Where given, the driver's demand is what the steering angle sensor says; by this ratio at
                the road wheels.
            truth: Where given, the controller gets what this says in place of the measurement, and the motion as a
                third argument.
        """
        self.inner = inner
        self._every, self._steps = every, 0
        self._steering_ratio = steering_ratio
        self._truth = truth
        self._held = ActuatorCommand()
        self._on_bus: deque[ActuatorCommand] = deque([self._held] * delay, maxlen=delay + 1)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """What reaches the actuators now.

        Args:
            command: What the driver does.
            measurement: What the sensors say.
        """
        if self._steps % self._every == 0:
            if self._truth is not None:
                self._held = self.inner.step(command, *self._truth())
            else:
                self._held = self.inner.step(self._seen(command, measurement), measurement)
        self._steps += 1
        self._on_bus.append(self._held)
        return self._on_bus[0]

    @property
    def uses_truth(self) -> bool:
        """Whether the controller gets the truth in place of what sensors say."""
        return self._truth is not None

    def _seen(self, command: DriverCommand, measurement: Measurement) -> DriverCommand:
        if self._steering_ratio is None:
            return command
        # `_replace` would cost more than all else here.
        seen: list[Any] = [*command]
        seen[_STEERING_WHEEL] = angle = measurement.steering_wheel_rad
        seen[_FRONT_STEER] = angle / self._steering_ratio
        return made(DriverCommand, seen)

    def __deepcopy__(self, memo: dict[int, Any]) -> ControlUnit:
        # The truth is the car's, which is no part of it.
        other = copy.copy(self)
        other.inner, other._on_bus = copy.deepcopy(self.inner, memo), self._on_bus.copy()
        return other


def interval_s(plugin: Plugin, parameters: ControllerParameters, timestep_s: float) -> float:
    """Time between two calls of a controller: `controllers.interval_s`, else what it says itself, else the step [s].

    Args:
        plugin: The controller, which may have an attribute `interval_s`.
        parameters: What the vehicle file says.
        timestep_s: Step of the simulation [s].

    Raises:
        ParameterError: it is no whole number of steps.
    """
    given = parameters.interval_s
    own = getattr(plugin.origin, "interval_s", None)
    if given is None and own is None:
        return timestep_s
    return _steps("controllers.interval_s", given if given is not None else own, timestep_s, 1) * timestep_s


def control_unit(controller: Any, scenario: Scenario, vehicle: Vehicle) -> tuple[ControllerSetup, Controller]:
    """A controller as the loop calls it, every step.

    Args:
        controller: The controller; see `activesteer.plugins.find`.
        scenario: Manoeuvre and car.
        vehicle: The car in the engine.

    Returns:
        What the controller may know of the car; and the controller, inside a control unit where it does not work in
        every step, at once, and on the driver's own demand.

    Raises:
        ParameterError: its interval or the delay of the bus is no whole number of steps.
        ControllerError: there is no such controller, or it cannot be made.
    """
    plugin, car, timestep_s = find_controller(controller), scenario.car.config, vehicle.timestep_s
    setup = scenario.controller_setup(interval_s(plugin, car.controllers, timestep_s))
    every = round(setup.timestep_s / timestep_s)
    delay = _steps("controllers.bus_delay_s", car.controllers.bus_delay_s, timestep_s, 0)
    ratio = None if car.sensors.steering_wheel.is_ideal else car.steering.ratio
    made = plugin.make(setup)
    if every == 1 and delay == 0 and ratio is None and not plugin.uses_truth:
        return setup, made
    truth = vehicle.truth if plugin.uses_truth else None
    return setup, ControlUnit(made, every, delay, steering_ratio=ratio, truth=truth)


def told_by_sensor(controller: Any, steering_ratio: float) -> ControlUnit:
    """A controller that knows the driver's demand through the steering angle sensor, whatever it did before.

    Args:
        controller: As `control_unit` returns it; what it remembers stays in it.
        steering_ratio: Overall steering ratio.
    """
    by_truth = isinstance(controller, ControlUnit) and controller.uses_truth
    return ControlUnit(controller, 1, 0, steering_ratio=None if by_truth else steering_ratio)


def about(plugin: Plugin, parameters: ControllerParameters, timestep_s: float) -> dict[str, Any]:
    """What a recording says of a controller beside its name: whether it uses the truth, and its own rate."""
    found: dict[str, Any] = {"controller_uses_truth": True} if plugin.uses_truth else {}
    own_s = interval_s(plugin, parameters, timestep_s)
    return found | ({"controller_interval_s": own_s} if own_s != timestep_s else {})


def _steps(key: str, value: Any, timestep_s: float, minimum: int) -> int:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    steps = round(value / timestep_s) if number and 0.0 <= value <= 0.1 else -1
    if steps < minimum or abs(steps * timestep_s - value) > 1e-9:
        raise ParameterError(
            f"is {value!r} s; 0.1 s at most, and whole steps of the simulation ({timestep_s:g} s), are needed",
            key=key,
            value=value,
        )
    return steps

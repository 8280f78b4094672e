"""The control unit around a controller: sampling rate, delay of the bus, source of the driver's demand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final, NamedTuple

from activesteer.controllers import Controller, ControllerParameters, ControllerSetup
from activesteer.errors import ParameterError
from activesteer.plugins import Plugin
from activesteer.scenario import Scenario
from activesteer.vehicle import Vehicle
from activesteer.vehicle.step_bindings import steering_rates

_SLOWER: Final = 0.95
"""Ratio of rates below which an actuator counts as slower: loads and geometry change the rate by some percent."""


class ControlUnit(NamedTuple):
    """How the loop calls a controller.

    Attributes:
        every: Steps of the simulation between two calls.
        delay: Steps that a command takes to arrive.
        steering_ratio: Overall ratio by which the controller converts the angle of the steering angle sensor into the
            driver's demand; 0 if it is told the demand itself.
        uses_truth: Whether the controller gets the true measurement instead of the sensors' signals, and the motion as
            a third argument.
    """

    every: int
    delay: int
    steering_ratio: float
    uses_truth: bool


def interval_s(plugin: Plugin, parameters: ControllerParameters, timestep_s: float) -> float:
    """Time between two calls of a controller [s].

    It is `controllers.interval_s` of the vehicle file, else the controller's attribute `interval_s`, else the step.
    """
    given = parameters.interval_s
    own = getattr(plugin.origin, "interval_s", None)
    if given is None and own is None:
        return timestep_s
    return _steps("controllers.interval_s", given if given is not None else own, timestep_s, 1) * timestep_s


def control_unit(
    plugin: Plugin, scenario: Scenario, vehicle: Vehicle
) -> tuple[ControllerSetup, ControlUnit, Controller]:
    """Create a controller and its control unit."""
    car, timestep_s = scenario.car.config, vehicle.timestep_s
    setup = _with_rates(scenario.controller_setup(interval_s(plugin, car.controllers, timestep_s)), scenario, vehicle)
    unit = ControlUnit(
        round(setup.timestep_s / timestep_s),
        _steps("controllers.bus_delay_s", car.controllers.bus_delay_s, timestep_s, 0),
        0.0 if car.sensors.steering_wheel.is_ideal or plugin.uses_truth else car.steering.ratio,
        plugin.uses_truth,
    )
    return setup, unit, plugin.make(setup)


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
    """Describe the actuators that are slower than the controller needs by its `rates_radps`, or empty if none."""
    needed = getattr(plugin.origin, "rates_radps", {})
    rates = steering_rates(vehicle.model, scenario.car.config)._asdict() if needed else {}
    return "; ".join(
        f"{name.replace('rear', 'rear steering')} turns the wheels at {math.degrees(rates[name]):.0f} deg/s, "
        f"{plugin.label} needs {math.degrees(need_radps):.0f} deg/s"
        for name, need_radps in needed.items()
        if rates[name] < _SLOWER * need_radps
    )


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

"""The control unit around a controller: sampling, bus delay, and source of the driver's demand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final, NamedTuple

from activesteer.controllers import Controller, ControllerSetup
from activesteer.controllers.find import interval_s, steps_in
from activesteer.plugins import Plugin
from activesteer.scenario import Scenario
from activesteer.vehicle import Vehicle
from activesteer.vehicle.step_bindings import steering_rates

_SLOWER: Final = 0.95
"""Ratio of rates below which an actuator counts as slower: loads and geometry change the rate by some percent."""


class ControlUnit(NamedTuple):
    """Timing and inputs of a controller in the loop."""

    every: int  # steps of the simulation between two calls
    delay: int  # steps that a command takes to arrive
    # overall ratio by which the controller converts the angle of the steering angle sensor into the driver's
    # demand; 0 if it is told the demand itself
    steering_ratio: float
    # whether the controller gets the true measurement instead of the sensors' signals, and the motion as a third
    # argument
    uses_truth: bool


def control_unit(
    plugin: Plugin, scenario: Scenario, vehicle: Vehicle
) -> tuple[ControllerSetup, ControlUnit, Controller]:
    """Create a controller and its control unit."""
    car, timestep_s = scenario.car.config, vehicle.timestep_s
    setup = _with_rates(scenario.controller_setup(interval_s(plugin, car.controllers, timestep_s)), scenario, vehicle)
    unit = ControlUnit(
        round(setup.timestep_s / timestep_s),
        steps_in("controllers.bus_delay_s", car.controllers.bus_delay_s, timestep_s, 0),
        0.0 if car.sensors.steering_wheel.is_ideal or plugin.uses_truth else car.steering.ratio,
        plugin.uses_truth,
    )
    return setup, unit, plugin.make(setup)


def _with_rates(setup: ControllerSetup, scenario: Scenario, vehicle: Vehicle) -> ControllerSetup:
    """Tell the controller the rates of slower actuators, unless an override sets these rates."""
    rates, servos, gains = steering_rates(vehicle.model, scenario.car.config), setup.gains.servos, setup.gains
    slower = {
        name: rate_radps
        for name, rate_radps in (("rear_rate_radps", rates.rear), ("superposition_rate_radps", rates.superposition))
        if f"servos.{name}" not in setup.overridden and rate_radps < _SLOWER * getattr(servos, name)
    }
    return replace(setup, gains=replace(gains, servos=replace(servos, **slower))) if slower else setup


def slow_actuators(plugin: Plugin, scenario: Scenario, vehicle: Vehicle) -> str:
    """Return a description of the actuators that are slower than the controller needs, or an empty string."""
    needed = getattr(plugin.origin, "rates_radps", {})
    rates = steering_rates(vehicle.model, scenario.car.config)._asdict() if needed else {}
    return "; ".join(
        f"{name.replace('rear', 'rear steering')} turns the wheels at {math.degrees(rates[name]):.0f} deg/s, "
        f"but {plugin.label} needs {math.degrees(need_radps):.0f} deg/s"
        for name, need_radps in needed.items()
        if rates[name] < _SLOWER * need_radps
    )

"""Parts of a scenario beside the car: driver, electric drive and estimator."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from activesteer.config import build, to_table
from activesteer.controllers.parameters import SplitAxle
from activesteer.conventions import GRAVITY_MPS2
from activesteer.driver import DriverParameters, driver_spec, is_driver_file
from activesteer.errors import DriverError
from activesteer.estimation import EstimatorSetup, KnownTyre
from activesteer.estimation.setup import GRID
from activesteer.plugins import Plugin
from activesteer.resources import DEFAULT_DRIVER, find_driver_file
from activesteer.scenario.car import CarSpec, read_table
from activesteer.scenario.overrides import Override, applied
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle.electric_drive import AXLES, Battery, Motors


@dataclass(frozen=True)
class ChosenDriver:
    """The driver of a scenario.

    Attributes:
        plugin: Plugin that creates the driver.
        parameters: The driver file; for a user's code the file of the default driver, which the code can read.
        files: Name -> content of all files, to be kept with a recording.
        user_parameters: Overrides of the parameters of a user's code: class -> name -> value.
    """

    plugin: Plugin
    parameters: DriverParameters
    files: Mapping[str, bytes]
    user_parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def to_table(self) -> dict[str, Any]:
        """Return the table that is recorded: the driver file, or the parameters of a user's code."""
        table = to_table(self.parameters)
        if self.plugin.is_builtin:
            return table
        return {
            "name": self.plugin.name,
            "parameters": self.plugin.parameters_with(self.user_parameters),
            "setup": table,
        }

    def for_searches(self) -> ChosenDriver:
        """Return the driver of searches before a run: the package's code, which follows the setpoint."""
        table = {"name": self.parameters.name}
        return replace(self, plugin=driver_spec(table))


def driver_with(given: Any, overrides: list[Override]) -> ChosenDriver:
    """Read a driver, or a user's code, with overrides of the driver file only."""
    plugin, is_file = driver_spec(given), is_driver_file(given)
    table, source, _, files = read_table(given if is_file else DEFAULT_DRIVER, "driver", find_driver_file, DriverError)
    of_code = {} if is_file else {one.path[1:]: one for one in overrides if one.path[0] == plugin.key and one.path[1:]}
    table, source = applied(DriverParameters, table, source, [one for one in overrides if one not in of_code.values()])
    parameters = build(DriverParameters, table, source)
    if is_file:
        return ChosenDriver(plugin, parameters, files)
    values = plugin.own_values({".".join(path): one.value for path, one in of_code.items()}) if of_code else {}
    return ChosenDriver(plugin, parameters, {**files, **plugin.files}, {plugin.key: values} if values else {})


def split_axles(motors: Motors) -> tuple[SplitAxle, ...]:
    """Return the axles whose left and right torques can differ, front first."""
    found = []
    for place, axle in zip((0, 2), AXLES, strict=True):
        if not motors.splits(axle):
            continue
        motor, *others = motors.on(axle)
        torque_Nm, difference_Nm = motor.wheel_torque_Nm, 2.0 * motor.wheel_torque_Nm
        if not others:
            difference_Nm = motor.split_torque_Nm or 0.0
            torque_Nm = 0.5 * (torque_Nm + difference_Nm)
        found.append(SplitAxle(place, torque_Nm, motor.power_W, motor.regeneration, difference_Nm, motor.efficiency))
    return tuple(found)


def battery_power_W(battery: Battery) -> tuple[float, float]:
    """Return the largest power that a battery takes from motors and gives to them [W]."""
    charge, discharge = (
        math.inf if limit is None else limit for limit in (battery.charge_power_W, battery.discharge_power_W)
    )
    return charge + battery.auxiliary_power_W, max(discharge - battery.auxiliary_power_W, 0.0)


_LARGEST_SLIP_ANGLE_RAD: Final = np.radians(20.0)
"""Largest slip angle of the grid. Beyond it the force stays constant [rad]."""
_LARGEST_LOAD: Final = 3.0
"""Largest load of the grid over the static load. Beyond it the force stays constant."""
_SPEED_MPS: Final = 20.0
"""Speed at which the tyres are evaluated [m/s]."""


def estimator_setup(car: CarSpec) -> EstimatorSetup | None:
    """Return the properties that estimators may know, or None if the vehicle file has no table [two_track]."""
    config, body = car.config, car.config.single_track
    if config.two_track is None:
        return None
    per_metre = 0.5 * body.mass_kg * GRAVITY_MPS2 / body.wheelbase_m
    loads_N = per_metre * body.cg_to_rear_m, per_metre * body.cg_to_front_m
    front, rear = (_known(*pair) for pair in zip(car.new_tyres, loads_N, strict=True))
    pressure_Pa = config.brakes.hydraulics.full_pedal_pressure_Pa
    fl, fr, rl, rr = (torque_Nm / pressure_Pa for torque_Nm in config.brakes.torques_Nm)
    air = config.aerodynamics
    return EstimatorSetup(
        body, config.two_track, config.steering.ratio, (front, rear), config.powertrain.wheel_fractions,
        (fl, fr, rl, rr), 0.5 * air.air_density_kgpm3 * air.drag_area_m2, config.sensors,
    )  # fmt: skip


def _known(parameters: TyreParameters, load_N: float) -> KnownTyre:
    """Evaluate a tyre with this static load."""
    tyre = MagicFormula(parameters)
    loads_N, angles_rad = map(np.linspace, (0.0, 0.0), (_LARGEST_LOAD * load_N, _LARGEST_SLIP_ANGLE_RAD), GRID)
    left, right = (
        tyre.evaluate(loads_N[:, np.newaxis], 0.0, sign * angles_rad, vx_mps=_SPEED_MPS).fy_N for sign in (-1.0, 1.0)
    )
    force_N = tuple(map(tuple, (0.5 * (left - right)).tolist()))
    standing = tyre.evaluate(load_N, 0.0, 0.0, vx_mps=_SPEED_MPS)
    return KnownTyre(
        float(angles_rad[1]), float(loads_N[1]), force_N, float(standing.relaxation_length_y_m),
        float(standing.slip_stiffness_N) / load_N, float(standing.effective_radius_m),
    )  # fmt: skip

"""Find a driver by name, or a user's own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

from activesteer.config import Range
from activesteer.driver.base import DriverParameters, DriverSetup
from activesteer.driver.human import HumanDriver
from activesteer.errors import DriverError, shown
from activesteer.plugins import Kind, Plugin, find
from activesteer.resources import list_drivers
from activesteer.signals import DriverCommand, WheelTorques, new_message

_MAX_ANGLE_RAD: Final = 50.0
"""Largest angle of a command. A larger one is taken for a mistake, such as degrees [rad]."""
_FRONT_STEER: Final = DriverCommand._fields.index("front_steer_demand_rad")
_GEARS: Final = (-1, 0, 1)
_MAX_TORQUE_NM: Final = 1e6
"""Largest torque of a command: more than any car has [N m]."""


@dataclass(frozen=True)
class _DriverKind(Kind):
    """Drivers, whose command is completed by the angle at the road wheel."""

    def completed(self, command: Any, name: str, setup: DriverSetup, said: str) -> DriverCommand:
        """Return a command with the angle at the road wheel (see the base class)."""
        torques, front = command.wheel_torques, command.front_steer_demand_rad
        if torques is not None and not _are_torques(torques):
            needed = "an activesteer.signals.WheelTorques of finite numbers is needed"
            raise self.fail(name, f"{said} wheel_torques = {shown(torques)}; {needed}", torques)
        if command.gear not in _GEARS:
            raise self.fail(name, f"{said} gear = {shown(command.gear)}; -1, 0 or 1 is needed", command.gear, _GEARS)
        angle = command.steering_wheel_demand_rad / setup.steering_ratio
        if math.isnan(front):
            return new_message(DriverCommand, (*command[:_FRONT_STEER], angle, *command[_FRONT_STEER + 1 :]))
        if not math.isclose(front, angle, rel_tol=1e-9, abs_tol=1e-12):
            what = f"the steering wheel angle over the steering ratio is {angle:g}; leave it out"
            raise self.fail(name, f"{said} front_steer_demand_rad = {front:g}, but {what}", front)
        return command


DRIVER: Final = _DriverKind(
    word="driver",
    table="driver",
    example="my_file.py:MyDriver",
    inputs="setpoint, measurement, motion",
    built_in={},
    result=DriverCommand,
    ranges={
        "steering_wheel_demand_rad": Range(-_MAX_ANGLE_RAD, _MAX_ANGLE_RAD),
        "drive_torque_demand_Nm": Range(-_MAX_TORQUE_NM, _MAX_TORQUE_NM),
        "brake_pedal": Range(0.0, 1.0),
        "parking_brake": Range(0.0, 1.0),
        "gear": Range(-1, 1),
    },
    error=DriverError,
    unchecked=("wheel_torques",),
    data=list_drivers,
    reserved=tuple(field.name for field in fields(DriverParameters)),
    filled=("front_steer_demand_rad",),
)
"""Rules that all drivers follow."""


def driver_spec(given: Any) -> Plugin:
    """Find a driver (see `activesteer.plugins.find`).

    Args:
        given: A name from `list_drivers`, a driver file or its table; or a user's own code:
            `path/to/file.py:ClassName`, a class, an object, a factory.

    Raises:
        DriverError: there is no such driver.
    """
    if not is_driver_file(given):
        return find(given, DRIVER)
    name = str(given.get("name", "driver")) if isinstance(given, Mapping) else Path(given).stem
    return Plugin(DRIVER, name, name, HumanDriver, {}, {}, is_builtin=True)


def is_driver_file(given: Any) -> bool:
    """Return whether a driver is given as data, by name, file or table, and not as code."""
    return isinstance(given, Mapping) or DRIVER.is_data(given)


def _are_torques(torques: Any) -> bool:
    try:
        return (
            isinstance(torques, WheelTorques)
            and len(torques) == len(WheelTorques._fields)
            and all(len(values) == 4 and all(abs(value) <= _MAX_TORQUE_NM for value in values) for values in torques)
        )
    except TypeError:
        return False

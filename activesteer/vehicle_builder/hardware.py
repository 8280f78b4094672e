"""Actuators, motors and sensors of a table: tables of a vehicle file, copied unchanged."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from activesteer.config import to_table
from activesteer.sensors.parameters import Sensors
from activesteer.vehicle.electric_actuators import RearActuator, SuperpositionActuator
from activesteer.vehicle.electric_drive import Battery, Motors

_DIGITS: Final = 7


class Hardware(Protocol):
    """Source of actuators, motors and sensors: a table of a car, or a vehicle file."""

    @property
    def rear_actuator(self) -> RearActuator | None:
        """Actuator of the rear wheels."""
        ...

    @property
    def superposition_actuator(self) -> SuperpositionActuator | None:
        """Actuator of the superposition."""
        ...

    @property
    def motors(self) -> Motors | None:
        """Electric motors."""
        ...

    @property
    def battery(self) -> Battery | None:
        """Battery of the motors."""
        ...

    @property
    def sensors(self) -> Sensors | None:
        """Sensors of the controllers."""
        ...


def hardware_tables(part: Hardware) -> dict[str, Any]:
    """Return the tables of actuators, motors, battery and sensors that are not empty.

    Returns:
        Name to table, without the values of its preset, angles in degrees.
    """
    tables = {
        "rear_actuator": to_table(part.rear_actuator or RearActuator(), defaults=False),
        "superposition_actuator": to_table(part.superposition_actuator or SuperpositionActuator(), defaults=False),
        "motors": to_table(part.motors or Motors(), defaults=False),
        "battery": to_table(part.battery or Battery(), defaults=False),
        "sensors": _sensors(part.sensors or Sensors()),
    }
    return {name: in_degrees(table) for name, table in tables.items() if table}


def in_degrees(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table with angles in degrees, rounded for readers."""
    result = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            result[key] = in_degrees(value)
        elif key.endswith("_rad"):
            result[key.removesuffix("_rad") + "_deg"] = _each(value, math.degrees)
        else:
            result[key] = _each(value, lambda one: one)
    return result


def _each(value: Any, change: Callable[[float], float]) -> Any:
    if isinstance(value, (list, tuple)):
        return [_each(one, change) for one in value]
    return float(f"{change(value):.{_DIGITS}g}") if isinstance(value, float) else value


def _sensors(sensors: Sensors) -> dict[str, Any]:
    """Return the values that differ from the preset, which fills in all others."""
    table, filled = (to_table(one, defaults=False) for one in (sensors, Sensors(preset=sensors.preset)))
    given = {"preset": sensors.preset} if sensors.preset != Sensors.preset else {}
    for key, value in table.items():
        preset = filled.get(key)
        if isinstance(value, Mapping):
            differing = {name: one for name, one in value.items() if one != (preset or {}).get(name)}
            given |= {key: differing} if differing else {}
        elif value != preset:
            given[key] = value
    return given

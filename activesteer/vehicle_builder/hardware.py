"""What a table says of actuators and sensors: the tables of a vehicle file, which go over as they are written."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from activesteer.config import to_table
from activesteer.sensors.parameters import Sensors
from activesteer.vehicle.rear_actuator import RearActuator
from activesteer.vehicle.superposition_actuator import SuperpositionActuator

_DIGITS: Final = 7


class Hardware(Protocol):
    """What has actuators and sensors: a table of a car, or a vehicle file."""

    @property
    def rear_actuator(self) -> RearActuator | None:
        """What steers the rear wheels."""
        ...

    @property
    def superposition_actuator(self) -> SuperpositionActuator | None:
        """What adds to the steering wheel angle."""
        ...

    @property
    def sensors(self) -> Sensors | None:
        """What controllers see."""
        ...


def hardware_tables(part: Hardware) -> dict[str, Any]:
    """The tables [rear_actuator], [superposition_actuator] and [sensors], each where it says something.

    Args:
        part: A table of a car, or a vehicle file.

    Returns:
        Name -> table, with what its preset does not say, angles in degrees.
    """
    tables = {
        "rear_actuator": to_table(part.rear_actuator or RearActuator(), defaults=False),
        "superposition_actuator": to_table(part.superposition_actuator or SuperpositionActuator(), defaults=False),
        "sensors": _sensors(part.sensors or Sensors()),
    }
    return {name: in_degrees(table) for name, table in tables.items() if table}


def in_degrees(table: Mapping[str, Any]) -> dict[str, Any]:
    """The same table with angles in degrees, and no more digits than anyone reads."""
    found = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            found[key] = in_degrees(value)
        elif key.endswith("_rad"):
            found[key.removesuffix("_rad") + "_deg"] = _each(value, math.degrees)
        else:
            found[key] = _each(value, lambda one: one)
    return found


def _each(value: Any, change: Callable[[float], float]) -> Any:
    if isinstance(value, (list, tuple)):
        return [_each(one, change) for one in value]
    return float(f"{change(value):.{_DIGITS}g}") if isinstance(value, float) else value


def _sensors(sensors: Sensors) -> dict[str, Any]:
    """A preset fills in all that is not given: only what differs from it was."""
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

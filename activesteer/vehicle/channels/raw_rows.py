"""What is taken from the engine in each step, and how a channel is made of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple, TypeAlias

from activesteer.conventions import Array
from activesteer.signals import Channel
from activesteer.vehicle.channels.native_channels import Actuator, AxialForce


class RawRows(NamedTuple):
    """Copies of the engine's arrays and the commands, one row a step, all of the same instant."""

    sensordata: Array
    userdata: Array
    ten_length: Array
    ten_velocity: Array
    act: Array
    actuator_force: Array
    ctrl: Array
    commands: Array
    """What driver and controller asked for, as `write_commands` leaves it."""
    measured: Array
    """What the sensors said when driver and controller decided; empty with ideal sensors."""
    brakes: Array
    """A `BRAKE_STATE`."""
    estimate: Array
    """The members of an `Estimate`; empty where no controller makes one."""


ENGINE_ARRAYS: Final = RawRows._fields[: RawRows._fields.index("commands")]
"""Those of the engine, which calls them so too."""


class Column(NamedTuple):
    """A column of one of the arrays of `RawRows`, recorded as it is."""

    array: str
    column: int


Values: TypeAlias = Column | AxialForce | Actuator | Callable[[RawRows], Array]
"""How to get a channel from raw rows: by compiled code, or block by block."""


class Signal(NamedTuple):
    """A channel, and how to get it."""

    channel: Channel
    values: Values


def signal(group: str, name: str, unit: str, meaning: str, values: Values) -> Signal:
    """A signal of a channel that 32 bit are enough for; see `Channel`."""
    return Signal(Channel(name, unit, meaning, group), values)

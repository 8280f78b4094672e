"""What is taken from the engine in each step, and how a channel is made of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple, TypeAlias

import mujoco

from activesteer.conventions import Array
from activesteer.signals import Channel
from activesteer.vehicle.named_parts import sensor_columns


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


class AxialForce(NamedTuple):
    """The law of a tendon with a stiffness of its own, tension positive."""

    tendon: int
    stiffness_Npm: float
    """First coefficient of the polynomial in the elongation; so the next two [N/m2], [N/m3]."""
    second_Npm2: float
    third_Npm3: float
    damping_Nspm: float
    low_m: float
    """Length below which it is compressed, and above the next one stretched; between them it is slack."""
    high_m: float


class Actuator(NamedTuple):
    """The limits of an actuator that follows a command with a lag."""

    control: int
    """Its place among the commands and the forces."""
    activation: int
    """Its place among the activations."""
    lag_s: float
    rate_radps: float
    low_rad: float
    high_rad: float
    low_Nm: float
    """Its forces; without limits, those of a float."""
    high_Nm: float


class Computed(NamedTuple):
    """What is worked out from columns by numpy, for many rows at once."""

    law: Callable[..., Array]
    """Takes the columns one by one."""
    columns: tuple[Column, ...]


Values: TypeAlias = Column | AxialForce | Actuator | Computed
"""How to get a channel from raw rows."""


def sensor(model: mujoco.MjModel, name: str) -> tuple[Column, ...]:
    """Columns of a sensor of the engine.

    Raises:
        ModelError: there is none of this name.
    """
    place = sensor_columns(model, name)
    return tuple(Column("sensordata", column) for column in range(place.start, place.stop))


class Signal(NamedTuple):
    """A channel, and how to get it."""

    channel: Channel
    values: Values


def signal(group: str, name: str, unit: str, meaning: str, values: Values) -> Signal:
    """A signal of a channel that 32 bit are enough for; see `Channel`."""
    return Signal(Channel(name, unit, meaning, group), values)

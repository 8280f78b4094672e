"""Raw rows of the engine, and the rules that turn them into channels."""

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
    """Commands of driver and controller, as `write_commands` leaves them."""
    measured: Array
    """Measurement on which driver and controller based their commands; empty with ideal sensors."""
    brakes: Array
    """A `BRAKE_STATE`."""
    electric: Array
    """State of an `ElectricDrive`; empty without motors."""
    estimate: Array
    """Fields of an `Estimate`; empty without an estimator."""


ENGINE_ARRAYS: Final = RawRows._fields[: RawRows._fields.index("commands")]
"""The arrays of the engine, by their names in the engine."""


class Column(NamedTuple):
    """A column of one of the arrays of `RawRows`, recorded as it is."""

    array: str
    column: int


class AxialForce(NamedTuple):
    """Axial force of a tendon with a stiffness, tension positive.

    The spring force is a polynomial in the elongation, with the coefficients [N/m], [N/m2] and [N/m3]. The tendon is
    compressed below the length `low_m`, stretched above `high_m`, and slack in between.
    """

    tendon: int
    stiffness_Npm: float
    second_Npm2: float
    third_Npm3: float
    damping_Nspm: float
    low_m: float
    high_m: float


class Actuator(NamedTuple):
    """Limits of an actuator that follows a command with a lag.

    Attributes:
        control: Place of the actuator among the commands and the forces.
        activation: Place of the actuator among the activations.
        lag_s: Time constant [s].
        rate_radps: Largest rate.
        low_rad: Lower limit of the angle; `high_rad` is the upper one.
        low_Nm: Lower limit of the torque; `high_Nm` is the upper one. Infinite if there is no limit.
    """

    control: int
    activation: int
    lag_s: float
    rate_radps: float
    low_rad: float
    high_rad: float
    low_Nm: float
    high_Nm: float


class Computed(NamedTuple):
    """A channel that numpy computes from columns, which are the arguments of `law`."""

    law: Callable[..., Array]
    columns: tuple[Column, ...]


Values: TypeAlias = Column | AxialForce | Actuator | Computed
"""Rule that gives a channel from raw rows."""


def sensor(model: mujoco.MjModel, name: str) -> tuple[Column, ...]:
    """Return the columns of a sensor of the engine."""
    place = sensor_columns(model, name)
    return tuple(Column("sensordata", column) for column in range(place.start, place.stop))


class Signal(NamedTuple):
    """A channel, and the rule that gives its values."""

    channel: Channel
    values: Values


def signal(group: str, name: str, unit: str, meaning: str, values: Values) -> Signal:
    """Return a signal of a channel that is stored with 32 bits; see `Channel`."""
    return Signal(Channel(name, unit, meaning, group), values)

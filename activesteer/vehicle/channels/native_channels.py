"""Channels computed from raw rows in compiled code.

The code works on a few rows at a time. Raw rows are contiguous, and so are channels. The data that the processor
fetches for one channel is therefore still in its cache for the next.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple, TypeAlias, get_type_hints

import mujoco
import numpy as np
from numba import from_dtype, types

from activesteer.core.conventions import Array
from activesteer.core.signals import Channel
from activesteer.core.units import unit_of
from activesteer.native.compilation import compiled_call, inlined
from activesteer.native.memory import f64_pointer
from activesteer.vehicle.force_block import sensor_columns


class RawRows(NamedTuple):
    """Copies of the engine's arrays and the commands, one row per step."""

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
    """Measurement on which driver and controller based their commands, or empty with ideal sensors."""
    brakes: Array
    """State of an `ElectricDrive`, or empty without motors."""
    electric: Array
    """State of an `ElectricDrive`, or empty without motors."""
    estimate: Array
    """Fields of an `Estimate`, or empty without an estimator."""


ENGINE_ARRAYS: Final = RawRows._fields[: RawRows._fields.index("commands")]
"""The arrays of the engine, by their names in the engine."""


class Column(NamedTuple):
    """A column of one of the arrays of `RawRows`, copied unchanged."""

    array: str
    column: int


class AxialForce(NamedTuple):
    """Axial force of a tendon, tension positive: a polynomial in the elongation, and zero between two lengths."""

    tendon: int
    stiffness_Npm: float
    second_Npm2: float
    third_Npm3: float
    damping_Nspm: float
    low_m: float  # compressed below
    high_m: float  # stretched above


class Actuator(NamedTuple):
    """Limits of an actuator that follows a command with a lag; torques are infinite without a limit."""

    control: int  # place among the commands and the forces
    activation: int  # place among the activations
    lag_s: float
    rate_radps: float
    low_rad: float
    high_rad: float
    low_Nm: float
    high_Nm: float


class Computed(NamedTuple):
    """A channel that NumPy computes with `law` from columns."""

    law: Callable[..., Array]
    columns: tuple[Column, ...]


Values: TypeAlias = Column | AxialForce | Actuator | Computed
"""Rule that gives a channel from raw rows."""


def sensor(model: mujoco.MjModel, name: str) -> tuple[Column, ...]:
    """Return the columns of a sensor of the engine."""
    place = sensor_columns(model, name)
    return tuple(Column("sensordata", column) for column in range(place.start, place.stop))


class Signal(NamedTuple):
    """A channel with the rule for its values."""

    channel: Channel
    values: Values


def signal(group: str, name: str, meaning: str, values: Values) -> Signal:
    """Return the signal of a channel with 32 bits, in the unit at the end of its name."""
    return Signal(Channel(name, unit_of(name), meaning, group), values)


_ROWS_AT_ONCE: Final = 8
"""Number of float64 in a cache line."""


def record_of(law: type[AxialForce | Actuator]) -> np.dtype:
    """Return the record of a law for compiled code."""
    return np.dtype([(name, np.intp if kind is int else np.float64) for name, kind in get_type_hints(law).items()])


_ARRAY: Final = types.Array(types.float64, 2, "A")
_ROWS: Final = types.UniTuple(_ARRAY, len(RawRows._fields))
_PLACES: Final = types.Array(types.intp, 1, "C")
_COPIES: Final = types.UniTuple(_PLACES, 3)
_FORCES, _ACTUATORS = (
    types.Tuple([types.Array(from_dtype(record_of(law)), 1, "C"), _PLACES]) for law in (AxialForce, Actuator)
)
_LENGTH, _VELOCITY, _CTRL, _ACT, _FORCE = (
    RawRows._fields.index(name) for name in ("ten_length", "ten_velocity", "ctrl", "act", "actuator_force")
)


@inlined
def _place(array, row, column):
    """Return a pointer to a number, which avoids numba's check for negative indices."""
    return f64_pointer(array.ctypes.data + row * array.strides[0] + column * array.strides[1])


@inlined
def _copy_columns(rows, start, count, copies, out, largest):
    ends, columns, places = copies
    good, first = True, 0
    for array in range(len(ends)):
        source, step = _place(rows[array], start, 0), rows[array].strides[0] // 8
        last = ends[array]
        for index in range(first, last):
            column, target = columns[index], _place(out, start, places[index])
            for row in range(count):
                value = source[row * step + column]
                target[row] = value
                # NaN compares as false.
                good &= abs(value) <= largest
        first = last
    return good


@inlined
def axial_force(length, velocity, low, high, first, second, third, damping):
    """Return the force of a tendon (see `AxialForce`)."""
    x = length - (low if length < low else high if length > high else length)
    spring = x * (first + x * (second + x * third))
    return spring + damping * velocity if damping != 0.0 else spring


@inlined
def is_limited(law, command, activation, force):
    """Return 1 for an actuator at a limit, else 0 (see `Actuator`)."""
    target = min(max(command, law.low_rad), law.high_rad)
    rate = (target - activation) / law.lag_s
    beyond = command < law.low_rad or command > law.high_rad or abs(rate) >= law.rate_radps
    return 1.0 if beyond or force <= law.low_Nm or force >= law.high_Nm else 0.0


@inlined
def _axial_forces(rows, start, count, laws, out, largest):
    forces, places = laws
    lengths_m, velocities_mps = rows[_LENGTH], rows[_VELOCITY]
    length_step, velocity_step = lengths_m.strides[0] // 8, velocities_mps.strides[0] // 8
    good = True
    for index in range(len(forces)):
        law, target = forces[index], _place(out, start, places[index])
        length_m, velocity_mps = _place(lengths_m, start, law.tendon), _place(velocities_mps, start, law.tendon)
        low, high, damping = law.low_m, law.high_m, law.damping_Nspm
        first, second, third = law.stiffness_Npm, law.second_Npm2, law.third_Npm3
        for row in range(count):
            force = axial_force(
                length_m[row * length_step], velocity_mps[row * velocity_step], low, high, first, second, third, damping
            )
            target[row] = force
            good &= abs(force) <= largest
    return good


@inlined
def _saturations(rows, start, count, laws, out):
    actuators, places = laws
    commands, activations, forces = rows[_CTRL], rows[_ACT], rows[_FORCE]
    for index in range(len(actuators)):
        law, place = actuators[index], places[index]
        for row in range(start, start + count):
            command, force = commands[row, law.control], forces[row, law.control]
            out[row, place] = is_limited(law, command, activations[row, law.activation], force)


@inlined
def _take(rows, start, count, copies, input_copies, forces, actuators, out, inputs, largest):
    good = _copy_columns(rows, start, count, copies, out, largest)
    _copy_columns(rows, start, count, input_copies, inputs, largest)
    good &= _axial_forces(rows, start, count, forces, out, largest)
    _saturations(rows, start, count, actuators, out)
    return good


@compiled_call(types.boolean, _ROWS, _COPIES, _COPIES, _FORCES, _ACTUATORS, _ARRAY, _ARRAY, types.float64)
def take_rows(rows, copies, input_copies, forces, actuators, out, inputs, largest):
    """Compute all channels that compiled code provides."""
    good, whole = True, len(out) - len(out) % _ROWS_AT_ONCE
    # The compiler knows this count and keeps these rows of a column in one register.
    for start in range(0, whole, _ROWS_AT_ONCE):
        good &= _take(rows, start, _ROWS_AT_ONCE, copies, input_copies, forces, actuators, out, inputs, largest)
    return good & _take(rows, whole, len(out) - whole, copies, input_copies, forces, actuators, out, inputs, largest)


@compiled_call(types.boolean, _ARRAY, _PLACES, types.float64)
def within(values, columns, largest):
    """Return whether all values in some columns are finite and small enough."""
    good = True
    for index in range(len(columns)):
        column = values[:, columns[index]]
        for row in range(len(column)):
            good &= abs(column[row]) <= largest
    return good

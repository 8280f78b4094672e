"""Channels from the engine's raw rows in compiled code: what is copied, and the forces of links and springs.

Both go through the rows a few at a time: raw rows lie one behind the other, and so do channels; what the processor has
to fetch for one of them is then used before it goes.
"""

from __future__ import annotations

from typing import Final, NamedTuple, get_type_hints

import numpy as np
from numba import from_dtype, types

from activesteer.compilation import compiled_call

_ROWS_AT_ONCE: Final = 8
"""As many float64 as a cache line holds."""


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


def record_of(law: type[AxialForce | Actuator]) -> np.dtype:
    """A law as compiled code reads it."""
    return np.dtype([(name, np.intp if kind is int else np.float64) for name, kind in get_type_hints(law).items()])


_ARRAY: Final = types.Array(types.float64, 2, "A")
_PLACES: Final = types.Array(types.intp, 1, "C")
_FORCES, _ACTUATORS = (types.Array(from_dtype(record_of(law)), 1, "C") for law in (AxialForce, Actuator))


@compiled_call(types.void, _ARRAY, _PLACES, _ARRAY, _PLACES)
def copy_columns(rows, columns, out, places):
    """Copies some columns.

    Args:
        rows: Raw rows, shape (n, m).
        columns: Which columns of them.
        out: Where they go, shape (n, k).
        places: Which columns of it they become.
    """
    for start in range(0, len(rows), _ROWS_AT_ONCE):
        end = min(start + _ROWS_AT_ONCE, len(rows))
        for index in range(len(columns)):
            column, place = columns[index], places[index]
            for row in range(start, end):
                out[row, place] = rows[row, column]


@compiled_call(types.void, _ARRAY, _ARRAY, _FORCES, _ARRAY, _PLACES)
def axial_forces(length_m, velocity_mps, forces, out, places):
    """Forces of springs, stops and links.

    Args:
        length_m: Lengths of all tendons [m], shape (n, number of tendons).
        velocity_mps: How fast they grow [m/s], of the same shape.
        forces: Laws of those that are wanted.
        out: Where the forces go [N], shape (n, k).
        places: Which columns of it they become.
    """
    for start in range(0, len(length_m), _ROWS_AT_ONCE):
        end = min(start + _ROWS_AT_ONCE, len(length_m))
        for index in range(len(forces)):
            law, place = forces[index], places[index]
            tendon, low, high, damping = law.tendon, law.low_m, law.high_m, law.damping_Nspm
            first, second, third = law.stiffness_Npm, law.second_Npm2, law.third_Npm3
            for row in range(start, end):
                length = length_m[row, tendon]
                x = length - (low if length < low else high if length > high else length)
                spring = x * (first + x * (second + x * third))
                out[row, place] = spring + damping * velocity_mps[row, tendon] if damping != 0.0 else spring


@compiled_call(types.void, _ARRAY, _ARRAY, _ARRAY, _ACTUATORS, _ARRAY, _PLACES)
def saturations(commands, activations, forces, actuators, out, places):
    """Where actuators are at a limit of angle, rate or force: 1, elsewhere 0.

    Args:
        commands: Commands of all actuators, shape (n, number of actuators).
        activations: All activations, shape (n, number of activations).
        forces: Forces of all actuators, shape (n, number of actuators).
        actuators: Limits of those that are wanted.
        out: Where the flags go, shape (n, k).
        places: Which columns of it they become.
    """
    for index in range(len(actuators)):
        law, place = actuators[index], places[index]
        for row in range(len(commands)):
            command, force = commands[row, law.control], forces[row, law.control]
            target = min(max(command, law.low_rad), law.high_rad)
            rate = (target - activations[row, law.activation]) / law.lag_s
            beyond = command < law.low_rad or command > law.high_rad or abs(rate) >= law.rate_radps
            out[row, place] = 1.0 if beyond or force <= law.low_Nm or force >= law.high_Nm else 0.0

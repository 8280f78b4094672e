"""Controllers of many cars: arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numba import types

from activesteer.controllers.find import controller_spec
from activesteer.controllers.parameters import ControllerSetup
from activesteer.core.conventions import Array
from activesteer.core.signals import (
    ActuatorCommand,
    DriverCommand,
    Measurement,
    arrays_of,
    message_of,
    numbers_in,
    numbers_of,
)
from activesteer.native.compilation import compiled_call
from activesteer.native.memory import N_COMMAND, N_HELD, call_law, law_address
from activesteer.native.records import record_type, values

_ROWS: Final = types.Array(types.float64, 2, "C")


class Vectorised:
    """A controller of many cars, each with its own gains and memory.

    The laws of `none`, `ars`, `afs` and `lqr` run in compiled code, and are those of the scalar controllers. Every
    other controller is called car by car.

    Attributes:
        n: Number of cars.
    """

    def __init__(self, controller: Any, setups: Sequence[ControllerSetup]) -> None:
        """Make the controllers.

        Args:
            controller: Name of a controller, or your own; see `controller_spec`.
            setups: Inputs of the controllers, with the time between two calls.

        Raises:
            ControllerError: there is no such controller, or it cannot be made.
        """
        self.n, plugin = len(setups), controller_spec(controller)
        self._blocks = [plugin.make(setup) for setup in setups]
        self._law, self._held = law_address(self._blocks[0]), np.zeros((self.n, N_HELD))
        if self._law:
            kind = record_type(type(self._blocks[0]))
            self._records = np.array([values(block) for block in self._blocks], kind)

    def step(self, command: DriverCommand, measurement: Measurement) -> Any:
        """Return the commands of all cars: an `ActuatorCommand` of arrays, without estimates.

        Args:
            command: Commands of the drivers; each field has shape (n,).
            measurement: Measurements; each field has shape (n,), for the wheels (n, 4).
        """
        rows, seen = np.zeros((self.n, len(numbers_of(ActuatorCommand)))), rows_of(measurement)
        said = rows_of(command)
        if self._law:
            records = self._records
            _carry_out(self._law, records.ctypes.data, records.strides[0], said, seen, self._held)
            rows[:] = self._held[:, :N_COMMAND]
        else:
            for row, block, one, other in zip(rows, self._blocks, said.tolist(), seen.tolist(), strict=True):
                row[:] = numbers_in(block.step(message_of(DriverCommand, one), message_of(Measurement, other)))
        return arrays_of(ActuatorCommand, rows)


def rows_of(message: tuple[Any, ...]) -> Array:
    """Return the numbers of a message of arrays, shape (n, numbers); see `arrays_of`."""
    return np.column_stack([part for part in message if part is not None])


@compiled_call(types.void, types.intp, types.intp, types.intp, _ROWS, _ROWS, _ROWS)
def _carry_out(law, blocks, distance, commands, measurements, held):
    """Carry out a law for each car; the blocks have a distance in bytes."""
    for car in range(len(held)):
        command, measurement = commands[car].ctypes.data, measurements[car].ctypes.data
        call_law(law, (blocks + distance * car, command, measurement, held[car].ctypes.data))

"""Controllers of many cars: arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numba import from_dtype, types

from activesteer.compilation import compiled_call
from activesteer.controllers.find import find_controller
from activesteer.controllers.law_interface import N_HELD, N_STEERING
from activesteer.controllers.native_laws import LAWS, UNIT, decide, put
from activesteer.controllers.parameters import ControllerSetup
from activesteer.conventions import Array
from activesteer.signals import (
    ActuatorCommand,
    DriverCommand,
    Measurement,
    arrays_of,
    message_of,
    numbers_in,
    numbers_of,
)

_UNIT: Final = np.dtype((np.record, UNIT))
_ROW, _ROWS = types.Array(types.float64, 1, "A"), types.Array(types.float64, 2, "C")


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
            controller: Name of a controller, or your own; see `find_controller`.
            setups: Inputs of the controllers, with the time between two calls.

        Raises:
            ControllerError: there is no such controller, or it cannot be made.
        """
        self.n, plugin = len(setups), find_controller(controller)
        self._blocks = [plugin.make(setup) for setup in setups]
        self._law = LAWS.index(type(self._blocks[0])) if type(self._blocks[0]) in LAWS else 0
        self._units, self._held = np.zeros(self.n, _UNIT), np.zeros((self.n, N_HELD))
        if self._law:
            self._called = [put(self._units, car, self._law, block) for car, block in enumerate(self._blocks)]

    def step(self, command: DriverCommand, measurement: Measurement) -> Any:
        """Return the commands of all cars: an `ActuatorCommand` of arrays, without estimates.

        Args:
            command: Commands of the drivers; each field has shape (n,).
            measurement: Measurements; each field has shape (n,), for the wheels (n, 4).
        """
        rows, seen = np.zeros((self.n, len(numbers_of(ActuatorCommand)))), rows_of(measurement)
        if self._law:
            drivers: list[Any] = [command.front_steer_demand_rad, command.brake_pedal]
            _carry_out(self._law, self._units, seen, *drivers, self._held)
            rows[:, :N_STEERING] = self._held[:, :N_STEERING]
        else:
            said = rows_of(command)
            for row, block, one, other in zip(rows, self._blocks, said.tolist(), seen.tolist(), strict=True):
                row[:] = numbers_in(block.step(message_of(DriverCommand, one), message_of(Measurement, other)))
        return arrays_of(ActuatorCommand, rows)


def rows_of(message: tuple[Any, ...]) -> Array:
    """Return the numbers of a message of arrays, shape (n, numbers); see `arrays_of`."""
    return np.column_stack([part for part in message if part is not None])


@compiled_call(types.void, types.intp, types.Array(from_dtype(_UNIT), 1, "C"), _ROWS, _ROW, _ROW, _ROWS)
def _carry_out(law, units, measurements, front_rad, brake_pedal, held):
    """Carry out a law of `LAWS` for each car."""
    for car in range(len(units)):
        decide(units[car], law, measurements[car].ctypes.data, front_rad[car], brake_pedal[car], held[car].ctypes.data)

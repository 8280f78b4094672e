"""Controllers of many cars: arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numba import from_dtype, types

from activesteer.compilation import compiled_call
from activesteer.controllers.find import find_controller
from activesteer.controllers.front_superposition import FrontSuperposition, front_superposition
from activesteer.controllers.no_control import NoControl, no_control
from activesteer.controllers.parameters import ControllerSetup
from activesteer.controllers.rear_steer import RearSteer, rear_steer
from activesteer.conventions import Array
from activesteer.native_blocks import record_type, values
from activesteer.signals import (
    ActuatorCommand,
    DriverCommand,
    Measurement,
    arrays_of,
    message_of,
    numbers_in,
    numbers_of,
)

LAWS: Final[tuple[type[Any] | None, ...]] = (None, NoControl, RearSteer, FrontSuperposition)
"""Controllers whose law compiled code can carry out, by their number; 0 is no such controller."""
_RECORDS: Final = tuple(record_type(kind) for kind in (NoControl, RearSteer, FrontSuperposition))
_ROW, _ROWS = types.Array(types.float64, 1, "A"), types.Array(types.float64, 2, "C")


class Vectorised:
    """A controller of many cars, each with its own gains and memory.

    The laws of `none`, `ars` and `afs` run in compiled code, and are those of the scalar controllers. Every other
    controller is called car by car.

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
        blocks = [plugin.make(setup) for setup in setups]
        self._law = LAWS.index(type(blocks[0])) if type(blocks[0]) in LAWS else 0
        self._blocks = [] if self._law else blocks
        self._records = [
            np.array([values(block) for block in blocks] if number == self._law else [], record)
            for number, record in enumerate(_RECORDS, 1)
        ]

    def step(self, command: DriverCommand, measurement: Measurement) -> Any:
        """Return the commands of all cars: an `ActuatorCommand` of arrays, without estimates.

        Args:
            command: Commands of the drivers; each field has shape (n,).
            measurement: Measurements; each field has shape (n,), for the wheels (n, 4).
        """
        rows = np.zeros((self.n, len(numbers_of(ActuatorCommand))))
        if self._law:
            inputs: list[Any] = [command.front_steer_demand_rad, measurement.speed_mps, measurement.yaw_rate_radps]
            _carry_out(self._law, *self._records, *inputs, rows)
        else:
            said, seen = rows_of(command), rows_of(measurement)
            for row, block, one, other in zip(rows, self._blocks, said.tolist(), seen.tolist(), strict=True):
                row[:] = numbers_in(block.step(message_of(DriverCommand, one), message_of(Measurement, other)))
        return arrays_of(ActuatorCommand, rows)


def rows_of(message: tuple[Any, ...]) -> Array:
    """Return the numbers of a message of arrays, shape (n, numbers); see `arrays_of`."""
    return np.column_stack([part for part in message if part is not None])


@compiled_call(
    types.void, types.intp, *(types.Array(from_dtype(record), 1, "C") for record in _RECORDS), _ROW, _ROW, _ROW, _ROWS
)
def _carry_out(law, none, ars, afs, front_steer_rad, speed_mps, yaw_rate_radps, rows):
    """Carry out a law of `LAWS` on its records, for each car."""
    for car in range(len(rows)):
        front, speed, yaw_rate = front_steer_rad[car], speed_mps[car], yaw_rate_radps[car]
        if law == 1:
            answer = no_control(none[car], front, speed, yaw_rate)
        elif law == 2:
            answer = rear_steer(ars[car], front, speed, yaw_rate)
        else:
            answer = front_superposition(afs[car], front, speed, yaw_rate)
        row = rows[car]
        row[0], row[1], row[2], row[3], row[4] = answer[:5]
        row[5] = 1.0 if answer[5] else 0.0

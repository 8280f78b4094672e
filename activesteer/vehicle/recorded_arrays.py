"""The arrays that a recorded row is copied from."""

from __future__ import annotations

import mujoco
import numpy as np

from activesteer.conventions import Array
from activesteer.signals import ActuatorCommand, DriverCommand
from activesteer.vehicle.channels.raw_rows import ENGINE_ARRAYS, RawRows
from activesteer.vehicle.command_row import COMMANDS, write_commands_at


def engine_arrays(data: mujoco.MjData) -> dict[str, Array]:
    """Those of the engine, by the names that they have there and in `RawRows`."""
    return {name: getattr(data, name) for name in ENGINE_ARRAYS}


class RecordedArrays:
    """The engine's arrays, the last commands, what the sensors say, the brakes, and what is estimated.

    Attributes:
        commands: What driver and controller last asked for, as `write_commands` leaves it.
        estimate: The members of an `Estimate`; empty where none is recorded.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, measured: Array, brakes: Array) -> None:
        """Takes the arrays of a car.

        Args:
            model: The car.
            data: Its state.
            measured: What the sensors say; empty with ideal sensors.
            brakes: A `BRAKE_STATE` as numbers.
        """
        self._model, self._data = model, data
        self._measured, self._brakes = measured, brakes
        self.commands: Array = np.zeros(len(COMMANDS))
        self.estimate: Array = np.empty(0)

    def live(self) -> RawRows:
        """The arrays themselves, in the order in which a row holds them."""
        return self._of(self._data, self.commands)

    def empty(self, count: int) -> RawRows:
        """Empty rows for `count` steps: `live`, one behind the other in one block, as `Vehicle.step` fills them."""
        live = self.live()
        ends = np.cumsum([array.size for array in live])
        block = np.empty((count, ends[-1]))
        return RawRows(*(block[:, end - array.size : end] for array, end in zip(live, ends, strict=True)))

    def present(self, command: DriverCommand, asked: ActuatorCommand) -> RawRows:
        """One row as a step fills it, of the present instant with the inputs that are in force; nothing is changed.

        Args:
            command: What the driver last did.
            asked: What the controller last asked for.
        """
        now, commands = mujoco.MjData(self._model), np.empty_like(self.commands)
        mujoco.mj_copyData(now, self._model, self._data)
        mujoco.mj_forward(self._model, now)
        write_commands_at(commands.ctypes.data, command, asked)
        return RawRows(*(array[np.newaxis] for array in self._of(now, commands)))

    def _of(self, data: mujoco.MjData, commands: Array) -> RawRows:
        return RawRows(
            **engine_arrays(data),
            commands=commands,
            measured=self._measured,
            brakes=self._brakes,
            estimate=self.estimate,
        )

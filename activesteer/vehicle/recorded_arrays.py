"""The arrays that a recorded row is copied from."""

from __future__ import annotations

import mujoco
import numpy as np

from activesteer.conventions import Array
from activesteer.signals import ActuatorCommand, DriverCommand
from activesteer.vehicle.channels.raw_rows import ENGINE_ARRAYS, RawRows
from activesteer.vehicle.command_row import COMMANDS, write_commands_at


def engine_arrays(data: mujoco.MjData) -> dict[str, Array]:
    """The engine's arrays, by the names that the engine and `RawRows` share."""
    return {name: getattr(data, name) for name in ENGINE_ARRAYS}


class RecordedArrays:
    """The engine's arrays, the last commands, the measurement, the states of brakes and motors, and the estimate.

    Attributes:
        commands: Last commands of driver and controller, as `write_commands` leaves them.
        estimate: Fields of an `Estimate`; empty if none is recorded.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, measured: Array, brakes: Array, electric: Array
    ) -> None:
        """Collect the arrays of a car.

        Args:
            model: The car.
            data: Its state.
            measured: Outputs of the sensors; empty with ideal sensors.
            brakes: A `BRAKE_STATE` as numbers.
            electric: State of an `ElectricDrive`.
        """
        self._model, self._data = model, data
        self._measured, self._brakes, self._electric = measured, brakes, electric
        self.commands: Array = np.zeros(len(COMMANDS))
        self.estimate: Array = np.empty(0)

    def live(self) -> RawRows:
        """Return the arrays themselves, in the order of a row."""
        return self._of(self._data, self.commands)

    def empty(self, count: int) -> RawRows:
        """Allocate rows for `count` steps in one block, as `Vehicle.step` fills them."""
        live = self.live()
        ends = np.cumsum([array.size for array in live])
        block = np.empty((count, ends[-1]))
        return RawRows(*(block[:, end - array.size : end] for array, end in zip(live, ends, strict=True)))

    def present(self, driver_command: DriverCommand, actuator_command: ActuatorCommand) -> RawRows:
        """Return one row as a step fills it, for the present instant and the present inputs; change nothing."""
        now, commands = mujoco.MjData(self._model), np.empty_like(self.commands)
        mujoco.mj_copyData(now, self._model, self._data)
        mujoco.mj_forward(self._model, now)
        write_commands_at(commands.ctypes.data, driver_command, actuator_command)
        return RawRows(*(array[np.newaxis] for array in self._of(now, commands)))

    def _of(self, data: mujoco.MjData, commands: Array) -> RawRows:
        return RawRows(
            **engine_arrays(data),
            commands=commands,
            measured=self._measured,
            brakes=self._brakes,
            electric=self._electric,
            estimate=self.estimate,
        )

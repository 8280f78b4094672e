"""The rows of numbers that a step leaves behind: commands, estimate, and the arrays that a row is copied from."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

import mujoco
import numpy as np
from numba import types

from activesteer.compilation import compiled_call, inlined
from activesteer.conventions import Array
from activesteer.errors import ParameterError, shown
from activesteer.native_messages import native_type, store_numbers
from activesteer.signals import ActuatorCommand, Channel, DriverCommand, Estimate, Number, numbers_of
from activesteer.units import ESTIMATED
from activesteer.vehicle.channels.raw_rows import ENGINE_ARRAYS, RawRows


def command_numbers(messages: Mapping[str, type[Any]]) -> dict[str, Number]:
    """Numbers of a row, in the order in which `write_commands` stores them."""
    count = Counter(field for message in messages.values() for field in message._fields)
    return {
        f"{sender}_{number.name}" if count[number.field] > 1 else number.name: number
        for sender, message in messages.items()
        for number in numbers_of(message)
    }


def command_channels(numbers: Mapping[str, Number]) -> dict[Channel, int]:
    """Channels of the numbers that are recorded -> their places in a row."""
    return {
        Channel(name, number.recorded.unit, number.recorded.meaning, "control"): place
        for place, (name, number) in enumerate(numbers.items())
        if number.recorded is not None
    }


_NUMBERS: Final = command_numbers({"driver": DriverCommand, "controller": ActuatorCommand})
COMMANDS: Final = tuple(_NUMBERS)
"""Names of the numbers of a row."""
COMMAND_ROW: Final = np.dtype([(name, np.float64) for name in COMMANDS])
"""A row as compiled code reads it."""
COMMAND_CHANNELS: Final = command_channels(_NUMBERS)
"""Channel -> its place in a row."""
CARRIED_OUT: Final = tuple(name for name, number in _NUMBERS.items() if number.recorded is None or number.recorded.acts)
"""Names of the numbers that the car acts on; the others are for the recording only."""
BRAKES: Final = COMMANDS.index("fl_brake_torque_demand_Nm")
"""Place of the brake torque of the first wheel in a row."""
TORQUES: Final = COMMANDS.index("fl_wheel_torque_demand_Nm")
"""Place of the additional drive torque of the first wheel in a row."""
DRIVER_COMMAND, ACTUATOR_COMMAND = native_type(DriverCommand), native_type(ActuatorCommand)
"""The commands as compiled code takes them from Python."""
ESTIMATE_CHANNELS: Final = tuple(
    Channel(f"{ESTIMATED}_{number.name}", about.unit, f"{about.meaning}, estimated by the controller", "control")
    for number in numbers_of(Estimate)
    if (about := number.recorded) is not None
)
"""Channels of the fields of an `Estimate`, in their order."""
write_estimate: Final = struct.Struct(f"{len(Estimate._fields)}d").pack_into
"""`write_estimate(row, 0, *estimate)` writes a row into the memory of an array; the arguments must be numbers."""
_SIZE_DRIVER: Final = 8 * len(numbers_of(DriverCommand))
"""Bytes of a row that hold the driver's command."""


@inlined
def write_commands(address, driver_command, actuator_command):
    """Write a row."""
    store_numbers(address, driver_command)
    store_numbers(address + _SIZE_DRIVER, actuator_command)


@compiled_call(types.void, types.intp, DRIVER_COMMAND, others_run=False)
def _write_driver_command(address, command):
    store_numbers(address, command)


@compiled_call(types.void, types.intp, ACTUATOR_COMMAND, others_run=False)
def _write_actuator_command(address, command):
    store_numbers(address, command)


_WRITERS: Final[dict[type[Any], tuple[Any, str, int]]] = {
    DriverCommand: (_write_driver_command, "driver_command", len(DriverCommand._fields)),
    ActuatorCommand: (_write_actuator_command, "actuator_command", len(ActuatorCommand._fields)),
}


def write_command(kind: type[Any], address: int, command: Any) -> None:
    """Write the numbers of a command that comes from Python."""
    write, key, count = _WRITERS[kind]
    # Native code reads a fixed number of fields; an incomplete message would end the process.
    if type(command) is not kind or len(command) != count:
        raise ParameterError(f"is {shown(command)}; a complete {kind.__name__} is needed", key=key, value=command)
    try:
        write(address, command)
    except Exception as reason:
        raise ParameterError(f"cannot carry out {shown(command)}: {reason}", key=key, value=command) from reason


@compiled_call(types.void, types.intp, DRIVER_COMMAND, ACTUATOR_COMMAND)
def write_commands_at(address, driver_command, actuator_command):
    """Write a row, called from Python; see `write_commands`."""
    write_commands(address, driver_command, actuator_command)


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
        """Collect the arrays of a car."""
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

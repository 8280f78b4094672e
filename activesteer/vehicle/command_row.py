"""Commands and estimate of a step as rows of numbers, which the native step carries out and the recorder keeps."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numba import types

from activesteer.compilation import compiled_call, inlined
from activesteer.errors import ParameterError, shown
from activesteer.native_messages import native_type, store_numbers
from activesteer.signals import ActuatorCommand, Channel, DriverCommand, Estimate, Number, numbers_of
from activesteer.units import ESTIMATED


def command_numbers(messages: Mapping[str, type[Any]]) -> dict[str, Number]:
    """Numbers of a row, in the order in which `write_commands` stores them.

    Args:
        messages: Sender -> message class. Its name precedes the names of fields that several messages have
            (`driver_saturated`).

    Returns:
        Name of each number -> its description.
    """
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
    """Write a row.

    Args:
        address: Address of `len(COMMANDS)` float64.
        driver_command: A `DriverCommand`.
        actuator_command: An `ActuatorCommand`.
    """
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
    """Write the numbers of a command that comes from Python.

    Args:
        kind: `DriverCommand` or `ActuatorCommand`.
        address: Address of the numbers.
        command: The command.

    Raises:
        ParameterError: it is not exactly such a message, or holds something that is not a number.
    """
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

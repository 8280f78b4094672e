"""The commands of a step as one row of numbers, which the native step carries out and the recorder keeps."""

from __future__ import annotations

from typing import Final

import numpy as np
from numba import types

from activesteer.compilation import compiled_call, inlined
from activesteer.signals import Channel
from activesteer.vehicle.native_memory import f64_pointer

_NUMBERS: Final[dict[str, tuple[str, str] | None]] = {
    "steering_wheel_demand_rad": None,  # recorded where it arrives, among the inputs of the engine
    "drive_torque_demand_Nm": ("Nm", "drive torque demanded, all wheels together"),
    "brake_pedal": ("", "brake pedal position, 0 to 1"),
    "parking_brake": ("", "parking brake, 0 to 1"),
    "driver_saturated": ("", "1 where the steering is at its lock or the engine at its limit"),
    "gear": None,
    "front_steer_demand_rad": ("rad", "the driver's demand at the road wheel"),
    "rear_steer_demand_rad": ("rad", "rear angle that the controller demands"),
    "superposition_demand_rad": ("rad", "angle that the controller adds at the front wheels"),
    "yaw_rate_desired_radps": ("rad/s", "yaw rate that the controller steers for"),
    "prediction_rad": ("rad", "feed-forward part of the controller's angle"),
    "correction_rad": ("rad", "feedback part of the controller's angle"),
    "controller_saturated": ("", "1 where a limit of the controller is active"),
    "fl_brake_torque_demand_Nm": ("Nm", "brake torque that the controller adds, front left"),
    "fr_brake_torque_demand_Nm": ("Nm", "brake torque that the controller adds, front right"),
    "rl_brake_torque_demand_Nm": ("Nm", "brake torque that the controller adds, rear left"),
    "rr_brake_torque_demand_Nm": ("Nm", "brake torque that the controller adds, rear right"),
    "drive_torque_change_Nm": ("Nm", "change of the drive torque that the controller asks for"),
    "side_difference_Pa": ("Pa", "brake pressure by which the sides may differ, as the controller steers against it"),
}
"""What a row holds, in the order in which `write_commands` fills it, and what the channel means if there is one."""

COMMANDS: Final = tuple(_NUMBERS)
"""Names of the numbers of a row."""
COMMAND_ROW: Final = np.dtype([(name, np.float64) for name in COMMANDS])
"""A row as compiled code reads it."""
BRAKES: Final = COMMANDS.index("fl_brake_torque_demand_Nm")
"""Where in a row the brake torques of the wheels begin."""
COMMAND_CHANNELS: Final = {
    Channel(name, *about, "control"): place for place, (name, about) in enumerate(_NUMBERS.items()) if about
}
"""Channel -> its place in a row."""
CARRIED_OUT: Final = (
    "steering_wheel_demand_rad", "drive_torque_demand_Nm", "brake_pedal", "parking_brake", "rear_steer_demand_rad",
    "superposition_demand_rad", *COMMANDS[BRAKES : BRAKES + 4], "drive_torque_change_Nm",
    "side_difference_Pa",
)  # fmt: skip
"""What reaches the engine; the rest is for the recording."""

_NOT_LOOKED_AT: Final = types.none
"""A member of a message that is no number; it may be anything."""
_NUMBER: Final = types.float64
DRIVER_COMMAND: Final = types.Tuple([_NUMBER] * 4 + [_NOT_LOOKED_AT] + [_NUMBER] * 3)
"""A `DriverCommand` as compiled code takes it from Python."""
ACTUATOR_COMMAND: Final = types.Tuple([*[_NUMBER] * 6, types.UniTuple(_NUMBER, 4), _NUMBER, _NOT_LOOKED_AT, _NUMBER])
"""An `ActuatorCommand`, likewise."""


@inlined
def write_commands(address, command, asked):
    """Writes a row.

    Args:
        address: Where to: of `len(COMMANDS)` float64.
        command: What the driver does.
        asked: What the controller asks for.
    """
    steering_wheel, drive, pedal, at_limit, _, gear, front, parking = command
    rear, added, desired, prediction, correction, limited, (fl, fr, rl, rr), change, _, sides = asked
    numbers = (
        steering_wheel, drive, pedal, parking, at_limit, gear, front, rear, added, desired, prediction,
        correction, limited, fl, fr, rl, rr, change, sides,
    )  # fmt: skip
    row = f64_pointer(address)
    for place in range(len(numbers)):
        row[place] = numbers[place]


@compiled_call(types.void, types.intp, DRIVER_COMMAND, ACTUATOR_COMMAND)
def write_commands_at(address, command, asked):
    """The same, called from Python."""
    write_commands(address, command, asked)

"""The car in MuJoCo: it turns MJCF, parameters and commands into measurements and raw rows.

In: MJCF, a vehicle file, the driver's and controller's commands.
Out: measurements, raw rows of channels, and states that can be restored.
"""

from activesteer.vehicle.car import Vehicle
from activesteer.vehicle.channels import MAX_VALUE, ChannelMap, RawRows
from activesteer.vehicle.native_forces import engine_warnings_held
from activesteer.vehicle.parameters import VehicleParameters
from activesteer.vehicle.step_bindings import Tape

__all__ = [
    "MAX_VALUE",
    "ChannelMap",
    "RawRows",
    "Tape",
    "Vehicle",
    "VehicleParameters",
    "engine_warnings_held",
]

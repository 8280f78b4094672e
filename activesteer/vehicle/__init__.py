"""The car in MuJoCo: MJCF and parameters in, commands in, measurements and raw rows out."""

from activesteer.vehicle.car import Vehicle, engine_warnings_held
from activesteer.vehicle.channels import ChannelMap, RawRows
from activesteer.vehicle.native_step import TAPE
from activesteer.vehicle.parameters import VehicleParameters

__all__ = ["TAPE", "ChannelMap", "RawRows", "Vehicle", "VehicleParameters", "engine_warnings_held"]

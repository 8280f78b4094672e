"""The car in MuJoCo: MJCF and parameters in, commands in, measurements and raw rows out."""

from activesteer.vehicle.car import Vehicle
from activesteer.vehicle.channels import ChannelMap, RawRows
from activesteer.vehicle.parameters import Road, VehicleParameters

__all__ = ["ChannelMap", "RawRows", "Road", "Vehicle", "VehicleParameters"]

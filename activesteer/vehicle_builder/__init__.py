"""A user's own car: made from a table of hardpoints, and checked before it is driven."""

from activesteer.vehicle_builder.build import NewVehicle, new_vehicle
from activesteer.vehicle_builder.check import CheckReport, Finding, check_vehicle

__all__ = ["CheckReport", "Finding", "NewVehicle", "check_vehicle", "new_vehicle"]

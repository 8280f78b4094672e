"""A user's own car: built from a table of hardpoints, and checked before the first run.

In: a table of hardpoints or of K&C curves.
Out: a vehicle folder, and findings about it.
"""

from activesteer.vehicle_builder.build import NewVehicle, new_vehicle
from activesteer.vehicle_builder.check import CheckReport, Finding, check_vehicle

__all__ = ["CheckReport", "Finding", "NewVehicle", "check_vehicle", "new_vehicle"]

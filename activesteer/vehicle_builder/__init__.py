"""A car of one's own: made from a table of hardpoints, and checked before anyone drives it."""

from activesteer.vehicle_builder.build import NewVehicle, new_vehicle

__all__ = ["NewVehicle", "new_vehicle"]

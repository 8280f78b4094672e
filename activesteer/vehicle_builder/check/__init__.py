"""Missing and implausible parts of a car, found before it is driven."""

from activesteer.vehicle_builder.check.examination import check_vehicle
from activesteer.vehicle_builder.check.findings import CheckReport, Finding

__all__ = ["CheckReport", "Finding", "check_vehicle"]

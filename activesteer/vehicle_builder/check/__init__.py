"""What is missing or implausible in a car, before anyone drives it."""

from activesteer.vehicle_builder.check.examination import check_vehicle
from activesteer.vehicle_builder.check.findings import CheckReport, Finding

__all__ = ["CheckReport", "Finding", "check_vehicle"]

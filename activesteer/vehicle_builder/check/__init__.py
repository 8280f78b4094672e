"""Missing and implausible parts of a car, found before it is driven.

In: a vehicle.
Out: findings with value, usual range and advice.
"""

from activesteer.vehicle_builder.check.examination import check_vehicle
from activesteer.vehicle_builder.check.findings import CheckReport, Finding

__all__ = ["CheckReport", "Finding", "check_vehicle"]

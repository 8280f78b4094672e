"""Scenarios: manoeuvre, car and driver with their overrides.

In: names, paths, tables and overrides.
Out: a checked `Scenario`, from which a run can be repeated.
"""

from activesteer.scenario.car import CarSpec, FileOrTable, VehicleConfig, load_car
from activesteer.scenario.overrides import check_gains, read_by, unread_gains
from activesteer.scenario.scenario import Scenario, check_parts, describe, holders_of, resolve, value_of

__all__ = [
    "CarSpec", "FileOrTable", "Scenario", "VehicleConfig", "check_gains", "check_parts", "describe", "holders_of",
    "load_car", "read_by", "resolve", "unread_gains", "value_of",
]  # fmt: skip

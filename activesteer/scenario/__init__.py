"""What is driven, by which car."""

from activesteer.scenario.car import Car, FileOrTable, VehicleConfig, load_car
from activesteer.scenario.scenario import Scenario, check_parts, describe, resolve, value_of

__all__ = [
    "Car", "FileOrTable", "Scenario", "VehicleConfig", "check_parts", "describe", "load_car", "resolve", "value_of",
]  # fmt: skip

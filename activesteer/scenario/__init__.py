"""What is driven, by which car."""

from activesteer.scenario.car import Car, FileOrTable, VehicleConfig, load_car
from activesteer.scenario.scenario import Scenario, describe, resolve, value_of

__all__ = ["Car", "FileOrTable", "Scenario", "VehicleConfig", "describe", "load_car", "resolve", "value_of"]

"""What is driven, by which car."""

from activesteer.scenario.scenario import CarFile, FileOrTable, Scenario, describe, resolve

__all__ = ["CarFile", "FileOrTable", "Scenario", "describe", "resolve"]

"""Coupling with other tools: FMUs as controllers and drivers, the car as an FMU or a C library."""

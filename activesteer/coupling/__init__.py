"""Coupling with other tools: FMUs as controllers and drivers, and the car as an FMU or a C library.

In: FMUs, and datagrams of other programs.
Out: blocks for the loop, exported cars, and commands for a `Simulation`.
"""

"""The `[UNITS]` section of a .tir file: factors that turn its numbers into SI.

A file states base units; the unit of every other quantity follows from them, so that a stiffness in a file with
millimetres is in newton per millimetre. Magic Formula coefficients are pure numbers in every system of units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

_LENGTH = {
    "meter": 1.0, "metre": 1.0, "meters": 1.0, "m": 1.0, "millimeter": 1e-3, "millimetre": 1e-3, "mm": 1e-3,
    "centimeter": 1e-2, "centimetre": 1e-2, "cm": 1e-2, "kilometer": 1e3, "km": 1e3, "inch": 0.0254, "in": 0.0254,
    "foot": 0.3048, "ft": 0.3048,
}  # fmt: skip
_FORCE = {
    "newton": 1.0, "newtons": 1.0, "n": 1.0, "kilonewton": 1e3, "knewton": 1e3, "kn": 1e3,
    "pound_force": 4.4482216152605, "pound": 4.4482216152605, "lbf": 4.4482216152605,
    "kilogram_force": 9.80665, "kg_force": 9.80665, "kgf": 9.80665,
}  # fmt: skip
_ANGLE = {
    "radian": 1.0, "radians": 1.0, "rad": 1.0, "degree": math.pi / 180, "degrees": math.pi / 180, "deg": math.pi / 180,
}  # fmt: skip
_MASS = {
    "kilogram": 1.0, "kilograms": 1.0, "kg": 1.0, "gram": 1e-3, "g": 1e-3, "tonne": 1e3, "pound_mass": 0.45359237,
    "pound": 0.45359237, "lbm": 0.45359237, "lb": 0.45359237, "slug": 14.593902937206,
}  # fmt: skip
_TIME = {
    "second": 1.0, "seconds": 1.0, "sec": 1.0, "s": 1.0, "millisecond": 1e-3, "ms": 1e-3, "minute": 60.0, "min": 60.0,
    "hour": 3600.0,
}  # fmt: skip
_PRESSURE = {"pascal": 1.0, "pa": 1.0, "kilopascal": 1e3, "kpa": 1e3, "bar": 1e5, "psi": 6894.757293168}

BASE_UNITS: dict[str, dict[str, float]] = {
    "LENGTH": _LENGTH,
    "FORCE": _FORCE,
    "ANGLE": _ANGLE,
    "MASS": _MASS,
    "TIME": _TIME,
    "PRESSURE": _PRESSURE,
}
"""Keys of `[UNITS]`, the unit names that each accepts (in lower case), and the size of the unit in SI."""

DIMENSIONS: dict[str, dict[str, int]] = {
    "1": {},
    "length": {"LENGTH": 1},
    "speed": {"LENGTH": 1, "TIME": -1},
    "acceleration": {"LENGTH": 1, "TIME": -2},
    "mass": {"MASS": 1},
    "inertia": {"MASS": 1, "LENGTH": 2},
    "force": {"FORCE": 1},
    "pressure": {"FORCE": 1, "LENGTH": -2},
    "stiffness": {"FORCE": 1, "LENGTH": -1},
    "damping": {"FORCE": 1, "LENGTH": -1, "TIME": 1},
    "angular_stiffness": {"FORCE": 1, "LENGTH": 1, "ANGLE": -1},
    "angle": {"ANGLE": 1},
}
"""Quantities of the coefficient table as powers of the base units."""


def si_factor(quantity: str, units: Mapping[str, float]) -> float:
    """Return the factor from a file's number to SI."""
    if quantity == "pressure" and "PRESSURE" in units:
        return units["PRESSURE"]
    return math.prod(units.get(base, 1.0) ** power for base, power in DIMENSIONS[quantity].items())

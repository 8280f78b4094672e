"""Conversion between the units that an FMU declares and ours."""

from __future__ import annotations

import math
import re
from typing import Any, Final, NamedTuple

_BASES: Final = ("kg", "m", "s", "rad")
"""Base units of ours; their exponents describe a unit."""


class Unit(NamedTuple):
    """A unit: value in SI = factor times value + offset.

    Attributes:
        factor: Factor to SI.
        offset: Offset in SI.
        dimension: Exponents of kg, m and s. Angles count as numbers.
    """

    factor: float
    offset: float
    dimension: tuple[int, int, int]


_NUMBER, _LENGTH, _TIME = (0, 0, 0), (0, 1, 0), (0, 0, 1)
_SPEED, _ACCELERATION, _RATE = (0, 1, -1), (0, 1, -2), (0, 0, -1)
_TORQUE, _PRESSURE, _FORCE = (1, 2, -2), (1, -1, -2), (1, 1, -2)
_TURN, _DEG, _G = 2.0 * math.pi, math.radians(1.0), 9.80665
_KNOWN: Final[dict[str, Unit]] = {
    name: Unit(factor, 0.0, dimension)
    for names, factor, dimension in (
        ("1 - rad rad/rad m/m", 1.0, _NUMBER), ("%", 0.01, _NUMBER), ("deg degree degrees °", _DEG, _NUMBER),
        ("m", 1.0, _LENGTH), ("mm", 1e-3, _LENGTH), ("km", 1e3, _LENGTH),
        ("s", 1.0, _TIME), ("ms", 1e-3, _TIME),
        ("m/s", 1.0, _SPEED), ("km/h kmh", 1.0 / 3.6, _SPEED),
        ("m/s2 m/s^2 m/s/s", 1.0, _ACCELERATION), ("g gn", _G, _ACCELERATION),
        ("rad/s 1/s", 1.0, _RATE), ("deg/s °/s", _DEG, _RATE), ("rpm r/min rev/min 1/min", _TURN / 60.0, _RATE),
        ("Hz rev/s", _TURN, _RATE),
        ("N", 1.0, _FORCE), ("kN", 1e3, _FORCE), ("Nm N.m N*m", 1.0, _TORQUE), ("kNm", 1e3, _TORQUE),
        ("Pa N/m2", 1.0, _PRESSURE), ("kPa", 1e3, _PRESSURE), ("MPa", 1e6, _PRESSURE), ("bar", 1e5, _PRESSURE),
        ("1/m rad/m", 1.0, (0, -1, 0)),
    )
    for name in names.split()
}  # fmt: skip
"""Units whose base unit an FMU may leave out, and those of a map."""
_SUFFIXES: Final = {
    "rad": "rad", "radps": "rad/s", "mps": "m/s", "mps2": "m/s2", "m": "m", "s": "s", "Nm": "Nm", "Pa": "Pa",
    "1pm": "1/m", "N": "N",
}  # fmt: skip
"""Ending of the name of a signal -> its unit."""
_HERTZ: Final = re.compile(r"k?Hz|rev.*|r/.*|rpm")


def unit_of_signal(name: str) -> str:
    """Return the unit of one of our signals, from the end of its name; `1` for a pure number."""
    return _SUFFIXES.get(name.rpartition("_")[2], "1")


def stem_of_signal(name: str) -> str:
    """Return the name of a signal without its unit."""
    stem, _, ending = name.rpartition("_")
    return stem if stem and ending in _SUFFIXES else name


def declared_unit(name: str | None, base: Any) -> Unit | None:
    """Return a unit as an FMU declares it.

    Args:
        name: Name of the unit; None if the variable has none.
        base: Its base unit as FMPy reads it; None if the FMU does not define it.

    Returns:
        The unit; None if the variable has none, or if nobody knows the unit.
    """
    if name is None or base is None:
        return _KNOWN.get(name or "")
    others = any(getattr(base, other) for other in ("A", "K", "mol", "cd"))
    if others or not (math.isfinite(base.factor) and base.factor and math.isfinite(base.offset)):
        return Unit(math.nan, 0.0, (99, 99, 99))
    # Tools declare frequencies by the base unit 1/s, which as an angular speed is one radian per second.
    turn = _TURN if _HERTZ.fullmatch(name) and base.rad == 0 and base.s == -1 else 1.0
    return Unit(turn * base.factor, base.offset, (base.kg, base.m, base.s))


def known_units() -> list[str]:
    """Return the names of the units that need no definition."""
    return list(_KNOWN)


def named_unit(name: str) -> Unit | None:
    """Return a unit by its name; None if there is none."""
    return _KNOWN.get(name)

"""Units of a result's columns, from the endings of their names."""

from __future__ import annotations

from typing import Final

_UNITS: Final = {
    "_radpmps2": "rad/(m/s2)", "_mps2prad": "(m/s2)/rad", "_radprad": "rad/rad", "_Nspm": "N s/m", "_kgm2": "kg m2",
    "_Npm": "N/m", "_Npmm": "N/mm", "_radps": "rad/s", "_degps": "deg/s", "_mps2": "m/s2", "_srad": "s rad",
    "_1ps": "1/s", "_mps": "m/s", "_kmh": "km/h", "_Nm": "N m", "_Hz": "Hz", "_kg": "kg", "_rad": "rad", "_deg": "deg",
    "_mm": "mm", "_m": "m", "_s": "s", "_N": "N", "_g": "g",
}  # fmt: skip


def unit_of(name: str) -> str:
    """The unit that a name ends in.

    Args:
        name: Name of a metric or key of a factor.

    Returns:
        The unit; empty for a pure number and for what is none.
    """
    last = name.rpartition(".")[2]
    return next((unit for ending, unit in _UNITS.items() if last.endswith(ending)), "")

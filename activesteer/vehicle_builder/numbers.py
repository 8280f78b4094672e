"""Numbers as they are written into files for people: short, and the same on both sides of the car."""

from __future__ import annotations

from collections.abc import Iterable


def num(value: float, digits: int = 6) -> str:
    """A number with so many decimals at most, without zeros at its end."""
    text = f"{float(value):.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def sig(value: float, digits: int = 6) -> str:
    """A number with so many significant digits."""
    return f"{float(value):.{digits}g}".replace("e+0", "e").replace("e+", "e")


def vec(values: Iterable[float], digits: int = 6) -> str:
    """Numbers with so many decimals at most, with blanks between, as MJCF takes them."""
    return " ".join(num(value, digits) for value in values)

"""Numbers in files for people: short, and equal on both sides of the car."""

from __future__ import annotations

from collections.abc import Iterable


def num(value: float, digits: int = 6) -> str:
    """Return a number with at most `digits` decimals, without trailing zeros."""
    text = f"{float(value):.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def sig(value: float, digits: int = 6) -> str:
    """Return a number with `digits` significant digits."""
    return f"{float(value):.{digits}g}".replace("e+0", "e").replace("e+", "e")


def vec(values: Iterable[float], digits: int = 6) -> str:
    """Return numbers with at most `digits` decimals, separated by blanks as in MJCF."""
    return " ".join(num(value, digits) for value in values)

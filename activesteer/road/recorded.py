"""Values from the metadata of a recording, checked for type and range, since a file may be damaged or edited."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer import limits
from activesteer.errors import RecordingError, shown

LIMIT_M: Final = 1e6
"""Largest distance of a place from 0, and largest size, on a road [m]."""


def fail(key: str, problem: str) -> RecordingError:
    """Return an error that names the place in the metadata."""
    return RecordingError(problem, file="the metadata", key=key)


def table_of(value: object, key: str) -> Mapping[str, Any]:
    """Return the value if it is a table, else raise."""
    if not isinstance(value, Mapping):
        raise fail(key, f"is {shown(value)}, expected a table")
    return value


def sequence(value: object, key: str) -> Sequence[Any]:
    """Return the value if it is a list, else raise."""
    if not isinstance(value, list | tuple):
        raise fail(key, f"is {shown(value)}, expected a list")
    limits.check_count(len(value), limits.MAX_LIST_ELEMENTS, "elements", RecordingError, file="the metadata", key=key)
    return value


def number(value: object, key: str, low: float = -LIMIT_M, high: float = LIMIT_M) -> float:
    """Return the value [m] if it is a number from `low` to `high`, else raise."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise fail(key, f"is {shown(value)}, expected a number from {low:g} to {high:g} m")
    return float(value)


def numbers(
    value: object, key: str, low: float = -LIMIT_M, high: float = LIMIT_M, count: int | None = None
) -> NDArray[np.float64]:
    """Return the value [m] if it is a list of numbers from `low` to `high`, `count` of them if given. Else raise."""
    listed = sequence(value, key)
    if count is not None and len(listed) != count:
        raise fail(key, f"has {len(listed)} values, expected {count}")
    return np.array([number(item, f"{key}.{index}", low, high) for index, item in enumerate(listed)], np.float64)


def text(value: object, key: str) -> str:
    """Return the value if it is a text, else raise."""
    if not isinstance(value, str):
        raise fail(key, f"is {shown(value)}, expected a text")
    return value

"""Values from the metadata of a recording, each checked for type and range: a file may have been damaged or edited."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import RecordingError, shown

LIMIT_M: Final = 1e6
"""No place or size on a road is further from 0 than this [m]."""
_MAX_ELEMENTS: Final = 1_000_000


def fail(key: str, problem: str) -> RecordingError:
    """An error that says where in the metadata the problem is."""
    return RecordingError(problem, file="the metadata", key=key)


def table_of(value: object, key: str) -> Mapping[str, Any]:
    """The value, which must be a table."""
    if not isinstance(value, Mapping):
        raise fail(key, f"is {shown(value)}, expected a table")
    return value


def sequence(value: object, key: str) -> Sequence[Any]:
    """The value, which must be a list."""
    if not isinstance(value, list | tuple):
        raise fail(key, f"is {shown(value)}, expected a list")
    if len(value) > _MAX_ELEMENTS:
        raise fail(key, f"has {len(value)} elements, at most {_MAX_ELEMENTS} are allowed")
    return value


def number(value: object, key: str, low: float = -LIMIT_M, high: float = LIMIT_M) -> float:
    """The value [m], which must be a number from `low` to `high`."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise fail(key, f"is {shown(value)}, expected a number from {low:g} to {high:g} m")
    return float(value)


def numbers(
    value: object, key: str, low: float = -LIMIT_M, high: float = LIMIT_M, count: int | None = None
) -> NDArray[np.float64]:
    """The value [m], which must be a list of numbers from `low` to `high`; `count` of them where that is given."""
    listed = sequence(value, key)
    if count is not None and len(listed) != count:
        raise fail(key, f"has {len(listed)} values, expected {count}")
    return np.array([number(item, f"{key}.{index}", low, high) for index, item in enumerate(listed)], np.float64)


def text(value: object, key: str) -> str:
    """The value, which must be a text."""
    if not isinstance(value, str):
        raise fail(key, f"is {shown(value)}, expected a text")
    return value

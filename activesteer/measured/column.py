"""Column of a file of measured data, in any format."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from activesteer import limits
from activesteer.conventions import Array
from activesteer.errors import RecordingError, shown
from activesteer.files import shown_path


class Column(NamedTuple):
    """Column or signal of a file.

    Attributes:
        name: Name in the file.
        unit: Unit in the file; empty if the file states none.
        read: Function that returns the values, shape (n,), and their own times [s]; None for a shared time column.
    """

    name: str
    unit: str
    read: Callable[[], tuple[Array, Array | None]]


def check_rows(count: int, path: Path) -> None:
    """Refuse a file with too many rows, which its metadata state before the rows are read."""
    limits.check_count(count, limits.MAX_ROWS, "rows", RecordingError, file=path.name)


@contextmanager
def understood(path: Path, what: str) -> Iterator[None]:
    """Context that turns any exception of a file reader, as libraries raise, into a RecordingError of one line."""
    try:
        yield
    except RecordingError:
        raise
    except Exception as reason:
        problem = str(reason) or type(reason).__name__
        raise RecordingError(f"{shown_path(path)} is no readable {what}: {problem}", value=path) from reason


def numbers(values: Any, name: str, path: Path) -> Array:
    """Convert values to numbers, and instants to seconds since the first one."""
    try:
        array = np.asarray(values)
        if array.dtype.kind in "mM":
            return (array - array[0]).astype("timedelta64[ns]").astype(np.float64) * 1e-9
        return np.asarray(array, np.float64)
    except (TypeError, ValueError, IndexError) as reason:
        raise RecordingError(f"column {shown(name)} holds no numbers: {reason}", file=path.name) from None

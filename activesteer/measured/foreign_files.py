"""Files of other programs, and their columns.

A damaged file may crash such a library. `columns.py` therefore runs this file in a child process.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.core import limits
from activesteer.core.conventions import Array
from activesteer.core.files import shown_path
from activesteer.errors import RecordingError, not_installed, shown


class Column(NamedTuple):
    """Column or signal of a file."""

    name: str  # name in the file
    unit: str  # unit in the file; empty if the file states none
    # function that returns the values, shape (n,), and their own times [s]; None for a shared time column
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


def make_answerer() -> Callable[[bytes], bytes]:
    """Return a function that answers the requests of `columns.py`."""
    # A request is JSON: the path of a file that is opened, or the number of a column that is read. An answer is a line
    # of JSON, then values and times of a column as 64-bit floating-point numbers.
    opened: list[Column] = []

    def answer(request: bytes) -> bytes:
        wanted, content = json.loads(request), b""
        try:
            if isinstance(wanted, str):
                path = Path(wanted)
                opened[:] = READERS[path.suffix.lower()](path)
                head: Any = {"columns": [(column.name, column.unit) for column in opened]}
            else:
                values, times = opened[wanted].read()
                content = values.tobytes() + (b"" if times is None else times.tobytes())
                head = {"timed": times is not None}
        except RecordingError as error:
            head = {"refused": (error.problem, {"file": error.file, "value": error.value, "allowed": error.allowed})}
        return json.dumps(head, default=os.fspath).encode() + b"\n" + content

    return answer


def _parquet(path: Path) -> list[Column]:
    import pyarrow as pa  # noqa: PLC0415 - slow to import
    from pyarrow import parquet  # noqa: PLC0415

    with understood(path, "Parquet file"):
        file = parquet.ParquetFile(path)
        check_rows(file.metadata.num_rows, path)
        fields = list(file.schema_arrow)

    def read(name: str, kind: Any) -> tuple[Array, None]:
        kind = kind.value_type if pa.types.is_dictionary(kind) else kind
        # A text or a list may be of any length, so that the number of rows would limit nothing.
        if not (pa.types.is_primitive(kind) or pa.types.is_decimal(kind) or pa.types.is_null(kind)):
            raise RecordingError(f"column {shown(name)} holds no numbers: its type is {kind}", file=path.name)
        with understood(path, "Parquet file"):
            column = file.read(columns=[name]).column(0).to_numpy()
        return numbers(column, name, path), None

    units = [(field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace") for field in fields]
    return [
        Column(field.name, unit, partial(read, field.name, field.type))
        for field, unit in zip(fields, units, strict=True)
    ]


def _mat(path: Path) -> list[Column]:
    from scipy.io import loadmat, whosmat  # noqa: PLC0415 - slow to import

    try:
        with understood(path, "MATLAB file"):
            check_rows(max((max(shape, default=0) for _, shape, _ in whosmat(path)), default=0), path)
            variables = loadmat(path, simplify_cells=True)
    except RecordingError as error:
        if isinstance(error.__cause__, NotImplementedError):
            raise RecordingError(
                f"{shown_path(path)} is a MATLAB file of version 7.3; save it with `save(..., '-v7')`", value=path
            ) from None
        raise

    def read(name: str, values: Any) -> tuple[Array, None]:
        return numbers(values, name, path), None

    units = variables.get("units")
    given = units if isinstance(units, Mapping) else {}
    return [
        Column(name, str(given.get(name, "")), partial(read, name, values))
        for name, values in _flat(variables)
        if not name.startswith(("__", "units.", "metrics.", "meanings."))
    ]


def _flat(table: Mapping[str, Any], start: str = "") -> Iterator[tuple[str, Any]]:
    """Yield vectors of numbers in nested structs by dotted names."""
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{start}{name}.")
        elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.squeeze().ndim == 1:
            yield f"{start}{name}", value.squeeze()


def _mdf(path: Path) -> list[Column]:
    try:
        from asammdf import MDF  # noqa: PLC0415 - an extra, and slow to import
    except ImportError as error:
        raise not_installed(RecordingError, "an MDF file", "asammdf", "mdf") from error
    with understood(path, "MDF file"):
        file = MDF(path)
        check_rows(max((int(group.channel_group.cycles_nr) for group in file.groups), default=0), path)
        places = [
            (channel.name, group, index, str(channel.unit or ""))
            for group, each in enumerate(file.groups)
            for index, channel in enumerate(each.channels)
            if index != file.masters_db.get(group)
        ]

    def read(name: str, group: int, index: int) -> tuple[Array, Array]:
        with understood(path, "MDF file"):
            signal = file.get(name, group=group, index=index)
            times, samples = np.asarray(signal.timestamps, np.float64), signal.samples
        return numbers(samples, name, path), times

    return [Column(name, unit, partial(read, name, group, index)) for name, group, index, unit in places]


READERS: Final[dict[str, Callable[[Path], list[Column]]]] = {
    ".mat": _mat,
    ".parquet": _parquet,
    **dict.fromkeys((".mf4", ".mdf", ".dat"), _mdf),
}

"""Columns of a file of measured data, read when they are asked for: CSV, MAT, Parquet, MDF."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import RecordingError, nearest_names, not_installed, shown
from activesteer.files import is_file, shown_path, why_no_file
from activesteer.measured.column import Column, numbers, understood
from activesteer.measured.csv_columns import csv_columns

_BROKEN: Final = (Exception,)
"""See `column.understood`."""


def read_columns(path: Path) -> list[Column]:
    """The columns of a file.

    Args:
        path: A CSV (`.csv`, `.txt`, `.tsv`, `.asc`), `.mat`, `.parquet` or `.mf4` (`.mdf`, `.dat`).

    Raises:
        RecordingError: it cannot be read, or its ending is none of these.
    """
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise RecordingError(
            f"{shown_path(path)}: files of measured data end in {', '.join(_READERS)}", value=path.suffix
        )
    if not is_file(path):
        raise RecordingError(f"cannot read {shown_path(path)}: it {why_no_file(path)}", value=path)
    return _told_apart(reader(path))


def _told_apart(columns: list[Column]) -> list[Column]:
    """A name that several columns have, as those of an MDF file may, gets a number behind it from the second on."""
    seen: dict[str, int] = {}
    found = []
    for column in columns:
        seen[column.name] = count = seen.get(column.name, 0) + 1
        found.append(column if count == 1 else column._replace(name=f"{column.name} ({count})"))
    return found


def find(columns: list[Column], name: str, path: Path) -> Column:
    """The column of that name.

    Raises:
        RecordingError: there is none.
    """
    found = [column for column in columns if column.name == name]
    if found:
        return found[0]
    nearest = nearest_names(name, {column.name for column in columns})
    raise RecordingError(f"there is no column {shown(name)}; {nearest}", file=path.name, value=name)


def _in_memory(name: str, unit: str, values: Any, path: Path) -> Column:
    def read() -> tuple[Array, None]:
        return numbers(values, name, path), None

    return Column(name, unit, read)


def _parquet(path: Path) -> list[Column]:
    from pyarrow import parquet  # noqa: PLC0415 - slow to import

    with understood(path, "Parquet file"):
        file = parquet.ParquetFile(path)
        fields = list(file.schema_arrow)

    def lazy(name: str) -> Callable[[], tuple[Array, None]]:
        def read() -> tuple[Array, None]:
            with understood(path, "Parquet file"):
                column = file.read(columns=[name]).column(0).to_numpy()
            return numbers(column, name, path), None

        return read

    return [
        Column(field.name, (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace"), lazy(field.name))
        for field in fields
    ]


def _mat(path: Path) -> list[Column]:
    from scipy.io import loadmat  # noqa: PLC0415 - slow to import

    try:
        with understood(path, "MATLAB file"):
            variables = loadmat(path, simplify_cells=True)
    except RecordingError as error:
        if isinstance(error.__cause__, NotImplementedError):
            raise RecordingError(
                f"{shown_path(path)} is a MATLAB file of version 7.3; save it with `save(..., '-v7')`", value=path
            ) from None
        raise
    units = variables.get("units")
    given = units if isinstance(units, Mapping) else {}
    return [
        _in_memory(name, str(given.get(name, "")), values, path)
        for name, values in _flat(variables)
        if not name.startswith(("__", "units.", "metrics.", "meanings."))
    ]


def _flat(table: Mapping[str, Any], start: str = "") -> Iterator[tuple[str, Any]]:
    """Vectors of numbers in structs of structs, by dotted names."""
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
    file: Any = None
    problem = ""
    # Of a broken file asammdf leaves half an object, which complains to the terminal when it is deleted.
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        file = MDF(path)
    except _BROKEN as reason:
        problem = str(reason) or type(reason).__name__
    finally:
        gc.collect()
        sys.unraisablehook = hook
    if problem:
        raise RecordingError(f"{shown_path(path)} is no MDF file that can be read: {problem}", value=path)
    with understood(path, "MDF file"):
        places = [
            (channel.name, group, index, str(channel.unit or ""))
            for group, each in enumerate(file.groups)
            for index, channel in enumerate(each.channels)
            if index != file.masters_db.get(group)
        ]

    def lazy(name: str, group: int, index: int) -> Callable[[], tuple[Array, Array]]:
        def read() -> tuple[Array, Array]:
            with understood(path, "MDF file"):
                signal = file.get(name, group=group, index=index)
                times, samples = np.asarray(signal.timestamps, np.float64), signal.samples
            return numbers(samples, name, path), times

        return read

    return [Column(name, unit, lazy(name, group, index)) for name, group, index, unit in places]


_READERS: Final[dict[str, Callable[[Path], list[Column]]]] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".asc"), csv_columns),
    ".mat": _mat,
    ".parquet": _parquet,
    **dict.fromkeys((".mf4", ".mdf", ".dat"), _mdf),
}

"""Columns of a file of measured data, read when they are asked for: CSV, MAT, Parquet, MDF."""

from __future__ import annotations

import gc
import io
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import RecordingError, nearest_names, shown
from activesteer.files import is_file, read_bytes, shown_path, why_no_file

MAX_BYTES: Final = 2**30
"""Longest file that is read [bytes]."""
_HEAD_LINES: Final = 200
"""Within so many lines a CSV must begin with its numbers."""
_NUMBER: Final = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.IGNORECASE)
_COMMA: Final = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_BROKEN: Final = (Exception,)
"""What bytes of anybody's make the libraries of these formats raise has no bound."""


class Column(NamedTuple):
    """A column or signal of a file.

    Attributes:
        name: Its name there.
        unit: Its unit as the file has it; empty where it does not say.
        read: Its values, shape (n,), and their own times [s]; None where they share a time column of the file.
    """

    name: str
    unit: str
    read: Callable[[], tuple[Array, Array | None]]


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
    return reader(path)


def find(columns: list[Column], name: str, path: Path) -> Column:
    """The column of that name.

    Raises:
        RecordingError: there is none, or there are several.
    """
    found = [column for column in columns if column.name == name]
    if len(found) == 1:
        return found[0]
    if found:
        raise RecordingError(f"{len(found)} columns are called {shown(name)}", file=path.name, value=name)
    nearest = nearest_names(name, {column.name for column in columns})
    raise RecordingError(f"there is no column {shown(name)}; {nearest}", file=path.name, value=name)


@contextmanager
def _understood(path: Path, what: str) -> Iterator[None]:
    try:
        yield
    except RecordingError:
        raise
    except _BROKEN as reason:
        raise RecordingError(f"{shown_path(path)} is no {what} that can be read: {reason}", value=path) from reason


def _in_memory(name: str, unit: str, values: Any, path: Path) -> Column:
    def read() -> tuple[Array, None]:
        return _numbers(values, name, path), None

    return Column(name, unit, read)


def _numbers(values: Any, name: str, path: Path) -> Array:
    try:
        array = np.asarray(values)
        if array.dtype.kind in "mM":
            return (array - array[0]).astype("timedelta64[ns]").astype(np.float64) * 1e-9
        return np.asarray(array, np.float64)
    except (TypeError, ValueError, IndexError) as reason:
        raise RecordingError(f"column {shown(name)} holds no numbers: {reason}", file=path.name) from None


def _csv(path: Path) -> list[Column]:
    import pyarrow as pa  # noqa: PLC0415 - slow to import
    from pyarrow import csv  # noqa: PLC0415

    data = read_bytes(path, RecordingError, MAX_BYTES)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # what exporters on Windows write: a degree sign is one byte
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    head = lines[:_HEAD_LINES]
    first, separator = _first_numbers(head, path)
    cells = _cells(head[first], separator)
    comma = separator != "," and any(_COMMA.fullmatch(cell) for line in lines[first : first + 50]
                                     for cell in _cells(line, separator))  # fmt: skip
    names, units = _header(head[:first], separator, len(cells), path)
    body = "\n".join(line for line in lines[first:] if line.strip())
    if separator == " ":
        body = re.sub(r"^[ \t]+|[ \t]+$", "", re.sub(r"[ \t]+", " ", body), flags=re.MULTILINE)
    places = [f"{place}" for place in range(len(names))]
    with _understood(path, "table"):
        table = csv.read_csv(
            io.BytesIO(body.encode()),
            csv.ReadOptions(column_names=places),
            csv.ParseOptions(delimiter=separator),
            csv.ConvertOptions(
                decimal_point="," if comma else ".",
                null_values=["", "nan", "NaN", "NAN", "-", "n/a", "#N/A"],
                strings_can_be_null=True,
            ),
        )

    def values(place: str) -> Any:
        column = table.column(place)
        if pa.types.is_string(column.type):
            text = next(str(item) for item in column if not _NUMBER.fullmatch(str(item).strip()) and item.is_valid)
            raise ValueError(f"{shown(text)} is no number")
        return column.to_numpy(zero_copy_only=False)

    def lazy(place: str, name: str) -> Callable[[], tuple[Array, None]]:
        def read() -> tuple[Array, None]:
            try:
                return _numbers(values(place), name, path), None
            except (ValueError, StopIteration) as reason:
                raise RecordingError(f"column {shown(name)} holds no numbers: {reason}", file=path.name) from None

        return read

    return [
        Column(name, unit, lazy(place, name)) for place, name, unit in zip(places, names, units, strict=True) if name
    ]


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in (line.split() if separator == " " else line.split(separator))]


def _first_numbers(lines: list[str], path: Path) -> tuple[int, str]:
    """Number of the first line of numbers, and what stands between its cells."""
    for number, line in enumerate(lines):
        for separator in ";\t|, ":
            cells = _cells(line, separator)
            filled = [cell for cell in cells if cell]
            if len(filled) >= 2 and all(_NUMBER.fullmatch(cell) for cell in filled):
                if separator == "," and any(len(_cells(other, ",")) != len(cells) for other in lines[number + 1 : -1]
                                            if other.strip()):  # fmt: skip
                    continue
                return number, separator
    raise RecordingError(
        f"has no line of numbers in its first {len(lines)} lines; a CSV of measured data has columns apart by a comma, "
        "semicolon, tab, bar or blanks",
        file=path.name,
    )


def _header(head: list[str], separator: str, count: int, path: Path) -> tuple[list[str], list[str]]:
    """Names and units: the last line before the numbers has the names, or the units of the names before it."""
    rows = [row for line in head if len(row := _cells(line.lstrip("#"), separator)) >= count]
    rows = [row for row in rows if sum(bool(cell) for cell in row) >= 2]
    if not rows:
        raise RecordingError("has no line with the names of its columns above the numbers", file=path.name, line=1)
    if any(any(row[count:]) for row in rows[-1:]):
        raise RecordingError(
            f"names {len(rows[-1])} columns and has {count}; decimal commas need another separator", file=path.name
        )
    units = [""] * count
    if len(rows) > 1 and all(re.fullmatch(r"[\[(]?[^\s]{0,8}[\])]?", cell) for cell in rows[-1]):
        units = [cell.strip("[]()") for cell in rows.pop()[:count]]
    return rows[-1][:count], units


def _parquet(path: Path) -> list[Column]:
    from pyarrow import parquet  # noqa: PLC0415 - slow to import

    with _understood(path, "Parquet file"):
        file = parquet.ParquetFile(path)
        fields = list(file.schema_arrow)

    def lazy(name: str) -> Callable[[], tuple[Array, None]]:
        def read() -> tuple[Array, None]:
            with _understood(path, "Parquet file"):
                column = file.read(columns=[name]).column(0).to_numpy()
            return _numbers(column, name, path), None

        return read

    return [
        Column(field.name, (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace"), lazy(field.name))
        for field in fields
    ]


def _mat(path: Path) -> list[Column]:
    from scipy.io import loadmat  # noqa: PLC0415 - slow to import

    try:
        with _understood(path, "MATLAB file"):
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
        raise RecordingError("MDF files need asammdf, which is not installed: pip install 'activesteer[mdf]'") from (
            error
        )
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
    with _understood(path, "MDF file"):
        places = [
            (channel.name, group, index, str(channel.unit or ""))
            for group, each in enumerate(file.groups)
            for index, channel in enumerate(each.channels)
            if index != file.masters_db.get(group)
        ]

    def lazy(name: str, group: int, index: int) -> Callable[[], tuple[Array, Array]]:
        def read() -> tuple[Array, Array]:
            with _understood(path, "MDF file"):
                signal = file.get(name, group=group, index=index)
                times, samples = np.asarray(signal.timestamps, np.float64), signal.samples
            return _numbers(samples, name, path), times

        return read

    return [Column(name, unit, lazy(name, group, index)) for name, group, index, unit in places]


_READERS: Final[dict[str, Callable[[Path], list[Column]]]] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".asc"), _csv),
    ".mat": _mat,
    ".parquet": _parquet,
    **dict.fromkeys((".mf4", ".mdf", ".dat"), _mdf),
}

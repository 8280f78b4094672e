"""Columns of measured data files (CSV, MAT, Parquet, MDF), read on demand.

A damaged file may crash the library of another format. A child process, which runs this file, therefore reads them.
"""

from __future__ import annotations

import codecs
import csv
import io
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.config import leaves
from activesteer.core import limits
from activesteer.core.child_process import Child, ChildFault
from activesteer.core.conventions import Array
from activesteer.core.files import is_file, read_bytes, shown_path, why_no_file
from activesteer.errors import RecordingError, nearest_names, not_installed, shown

_HEAD_LINES: Final = 200
"""Number of lines within which the numbers of a CSV must begin."""
_NUMBER: Final = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.IGNORECASE)
_COMMA: Final = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_CLOCK: Final = re.compile(r"(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)")
_DATED: Final = re.compile(r"(\d{4}-\d\d-\d\d[ T])?" + _CLOCK.pattern + "Z?")


class Column(NamedTuple):
    """Column or signal of a file."""

    name: str  # name in the file
    unit: str  # unit in the file; empty if the file states none
    # function that returns the values, shape (n,), and their own times [s]; None for a shared time column
    read: Callable[[], tuple[Array, Array | None]]


def check_rows(count: int, path: Path) -> None:
    """Reject a file that declares too many rows, before the rows are read."""
    limits.check_count(count, limits.MAX_ROWS, "rows", RecordingError, file=path.name)


@contextmanager
def understood(path: Path, what: str) -> Iterator[None]:
    """Context that converts any exception of a file reader into a RecordingError of one line."""
    try:
        yield
    except RecordingError:
        raise
    except Exception as reason:
        problem = str(reason) or type(reason).__name__
        raise RecordingError(f"{shown_path(path)} is not a readable {what}: {problem}", value=path) from reason


def numbers(values: Any, name: str, path: Path) -> Array:
    """Convert values to numbers, and times to seconds since the first time."""
    try:
        array = np.asarray(values)
        if array.dtype.kind in "mM":
            return (array - array[0]).astype("timedelta64[ns]").astype(np.float64) * 1e-9
        return np.asarray(array, np.float64)
    except (TypeError, ValueError, IndexError) as reason:
        raise RecordingError(f"column {shown(name)} holds no numbers: {reason}", file=path.name) from None


def csv_columns(path: Path) -> list[Column]:
    """Return the columns of a CSV file."""
    import pyarrow as pa  # noqa: PLC0415 - slow to import
    from pyarrow import csv as arrow  # noqa: PLC0415

    data = read_bytes(path, RecordingError, limits.MAX_MEASURED_BYTES)
    check_rows(max(data.count(b"\n"), data.count(b"\r")), path)
    lines = _text(data).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    head = lines[:_HEAD_LINES]
    first, separator = _first_numbers(head, path)
    cells = _cells(head[first], separator)
    comma = any(_COMMA.fullmatch(cell) for line in lines[first : first + 50] for cell in _cells(line, separator))
    names, units = _header(head[:first], separator, len(cells), path)
    filled = [number for number in range(first, len(lines)) if lines[number].strip()]
    body = "\n".join(lines[number] for number in filled)
    if separator == " ":
        body = re.sub(r"^[ \t]+|[ \t]+$", "", re.sub(r"[ \t]+", " ", body), flags=re.MULTILINE)
    places = [f"{place}" for place in range(len(names))]
    with understood(path, "table"):
        try:
            table = arrow.read_csv(
                io.BytesIO(body.encode()),
                arrow.ReadOptions(column_names=places),
                arrow.ParseOptions(delimiter=separator),
                arrow.ConvertOptions(
                    decimal_point="," if comma else ".",
                    null_values=["", "nan", "NaN", "NAN", "-", "n/a", "#N/A"],
                    strings_can_be_null=True,
                ),
            )
        except pa.ArrowInvalid:
            for number in filled:
                if (count := len(_cells(lines[number], separator))) != len(names):
                    problem = f"has {count} instead of {len(names)} cells separated by {separator!r}"
                    raise RecordingError(problem, file=path.name, line=number + 1) from None
            raise

    def read(place: str, name: str) -> tuple[Array, None]:
        column = table.column(place)
        if pa.types.is_time(column.type):
            column = column.cast(pa.string())
        if not pa.types.is_string(column.type):
            return numbers(column.to_numpy(zero_copy_only=False), name, path), None
        texts = column.to_pylist()
        times_s = _clock_s(texts)
        if times_s is None:
            row = next((row for row, text in enumerate(texts) if text and not _NUMBER.fullmatch(text.strip())), None)
            if row is None:
                raise RecordingError(f"column {shown(name)} mixes decimal points and commas", file=path.name)
            problem = f"column {shown(name)} holds {shown(texts[row])}, which is not a number"
            raise RecordingError(f"{problem}; leave a missing cell empty", file=path.name, line=filled[row] + 1)
        return times_s, None

    columns = zip(places, names, units, strict=True)
    return [Column(name, unit, partial(read, place, name)) for place, name, unit in columns if name]


def _text(data: bytes) -> str:
    if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):  # Excel's "Unicode text"
        return data.decode("utf-16", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")  # exporters on Windows: a degree sign is one byte


def _clock_s(texts: list[str | None]) -> Array | None:
    """Parse times of day [s], increasing over midnight, or return None if a cell is not a time."""
    found = [_CLOCK.fullmatch((text or "").strip()) for text in texts]
    if not all(found):
        return None
    parts = np.array([[float(part.replace(",", ".")) for part in each.groups()] for each in found if each])
    seconds = parts @ [3600.0, 60.0, 1.0]
    return seconds + 86400.0 * np.append(0.0, np.cumsum(np.diff(seconds) < -43200.0))


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        cells = line.split()
    elif '"' in line:
        cells = next(csv.reader([line], delimiter=separator), [])
    else:
        cells = line.split(separator)
    return [cell.strip().strip('"').strip() for cell in cells]


def _first_numbers(lines: list[str], path: Path) -> tuple[int, str]:
    """Return the index of the first line of numbers, and the separator of its cells."""
    # In such a line, every other cell may be a word, such as a gear, and one a date or a time of day.
    for number, line in enumerate(lines):
        for separator in ";\t|, ":
            cells = _cells(line, separator)
            filled = [cell for cell in cells if cell]
            known = sum(bool(_NUMBER.fullmatch(cell) or _DATED.fullmatch(cell)) for cell in filled)
            if known < 2 or 2 * known < len(filled):
                continue
            same = all(len(_cells(other, separator)) == len(cells) for other in lines[number + 1 : -1] if other.strip())
            if separator in ", " and not same:
                continue
            return number, separator
    raise RecordingError(
        f"has no line of numbers in its first {len(lines)} lines; the columns of a CSV must be separated by a comma, "
        "semicolon, tab, bar or blanks",
        file=path.name,
    )


def _header(head: list[str], separator: str, count: int, path: Path) -> tuple[list[str], list[str]]:
    """Return names and units from the last lines before the numbers."""
    rows = [row for line in head if len(row := _cells(line.lstrip("#"), separator)) >= count]
    rows = [row for row in rows if sum(bool(cell) for cell in row) >= 2]
    names = [len(row) for line in head if sum(map(bool, row := _cells(line.lstrip("#"), separator))) >= 2]
    wrong = len(rows[-1]) if rows and any(rows[-1][count:]) else names[-1] if names and not rows else 0
    if wrong:
        raise RecordingError(
            f"names {wrong} columns but has {count}; decimal commas need another separator", file=path.name
        )
    if not rows or all(map(_NUMBER.fullmatch, rows[-1][:count])):
        problem = "has no line with the names of its columns above the numbers"
        if head:
            problem += f"; from here on, lines have {count} cells separated by {separator!r}, and a line above does not"
        raise RecordingError(problem, file=path.name, line=len(head) + 1)
    units = [""] * count
    if len(rows) > 1 and all(re.fullmatch(r"[\[(]?[^\s]{0,8}[\])]?", cell) for cell in rows[-1]):
        units = [cell.strip("[]()") for cell in rows.pop()[:count]]
    return rows[-1][:count], units


_MAX_ANSWER_BYTES: Final = 16 * limits.MAX_ROWS + 2**20
"""Longest answer of a reader: values and times of a column [bytes]."""


def read_columns(path: Path) -> list[Column]:
    """Return the columns of a file."""
    if not is_file(path):
        raise RecordingError(f"cannot read {shown_path(path)}: it {why_no_file(path)}", value=path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        problem = f"{shown_path(path)}: files of measured data end in {', '.join(_READERS)}"
        raise RecordingError(problem, value=path.suffix)
    return _numbered(reader(path))


def _numbered(columns: list[Column]) -> list[Column]:
    """Number repeated column names, starting with the second occurrence."""
    seen: dict[str, int] = {}
    found = []
    for column in columns:
        seen[column.name] = count = seen.get(column.name, 0) + 1
        found.append(column if count == 1 else column._replace(name=f"{column.name} ({count})"))
    return found


def second_of(name: str) -> str:
    """Return the name that distinguishes a second column from the first column of the same name."""
    return f"{name} (2)"


def find(columns: list[Column], name: str, path: Path) -> Column:
    """Return the column with a given name."""
    found = [column for column in columns if column.name == name]
    if found:
        return found[0]
    nearest = nearest_names(name, {column.name for column in columns})
    raise RecordingError(f"there is no column {shown(name)}; {nearest}", file=path.name, value=name)


def _in_child(path: Path) -> list[Column]:
    """Return the columns of a file through a child process, which lives as long as the columns."""
    child = Child(__file__, limits.MAX_READER_BYTES, quiet=True)

    def asked(request: Any, doing: str) -> tuple[dict[str, Any], bytes]:
        try:
            answer = child.ask(json.dumps(request).encode(), doing, limits.MAX_READER_S, _MAX_ANSWER_BYTES)
        except ChildFault as fault:
            raise RecordingError(f"cannot read {shown_path(path)}: its reader {fault}", value=path) from fault
        head, _, content = answer.partition(b"\n")
        about = json.loads(head)
        if "refused" in about:
            problem, attributes = about["refused"]
            raise RecordingError(problem, **attributes)
        return about, content

    def read(index: int, name: str) -> tuple[Array, Array | None]:
        about, content = asked(index, f"reading column {shown(name)}")
        found = np.frombuffer(content, np.float64)
        values, times = np.split(found, 2) if about["timed"] else (found, None)
        return values.copy(), None if times is None else times.copy()

    about, _ = asked(os.fspath(path), "opening the file")
    return [Column(name, unit, partial(read, index, name)) for index, (name, unit) in enumerate(about["columns"])]


def make_answerer() -> Callable[[bytes], bytes]:
    """Return a function that answers requests in the child process."""
    # A request is JSON: the path of a file that is opened, or the number of a column that is read. An answer is a line
    # of JSON, then values and times of a column as 64-bit floating-point numbers.
    opened: list[Column] = []

    def answer(request: bytes) -> bytes:
        wanted, content = json.loads(request), b""
        try:
            if isinstance(wanted, str):
                path = Path(wanted)
                opened[:] = FOREIGN_READERS[path.suffix.lower()](path)
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

    with understood(path, "MATLAB file"):
        try:
            check_rows(max((max(shape, default=0) for _, shape, _ in whosmat(path)), default=0), path)
            variables = loadmat(path, simplify_cells=True)
        except NotImplementedError:
            problem = f"{shown_path(path)} is a MATLAB file of version 7.3; save it with `save(..., '-v7')`"
            raise RecordingError(problem, value=path) from None

    def read(name: str, values: Any) -> tuple[Array, None]:
        return numbers(values, name, path), None

    # Nested structs give dotted names.
    vectors = {
        ".".join(place): value.squeeze()
        for place, value in leaves(variables).items()
        if isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.squeeze().ndim == 1
    }
    units = variables.get("units")
    given = units if isinstance(units, Mapping) else {}
    return [
        Column(name, str(given.get(name, "")), partial(read, name, values))
        for name, values in vectors.items()
        if not name.startswith(("__", "units.", "metrics.", "meanings."))
    ]


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


FOREIGN_READERS: Final[dict[str, Callable[[Path], list[Column]]]] = {
    ".mat": _mat,
    ".parquet": _parquet,
    **dict.fromkeys((".mf4", ".mdf", ".dat"), _mdf),
}
_READERS: Final[dict[str, Callable[[Path], list[Column]]]] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".asc"), csv_columns),
    **dict.fromkeys(FOREIGN_READERS, _in_child),
}

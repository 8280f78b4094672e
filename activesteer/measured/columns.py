"""Columns of files of measured data in any format, read on demand: CSV, MAT, Parquet, MDF."""

from __future__ import annotations

import codecs
import csv
import io
import json
import os
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.core import limits
from activesteer.core.child_process import Child, ChildFault
from activesteer.core.conventions import Array
from activesteer.core.files import is_file, read_bytes, shown_path, why_no_file
from activesteer.errors import RecordingError, nearest_names, shown
from activesteer.measured import foreign_files
from activesteer.measured.foreign_files import Column, check_rows, numbers, understood

_HEAD_LINES: Final = 200
"""Number of lines within which the numbers of a CSV must begin."""
_NUMBER: Final = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.IGNORECASE)
_COMMA: Final = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_CLOCK: Final = re.compile(r"(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)")
_DATED: Final = re.compile(r"(\d{4}-\d\d-\d\d[ T])?" + _CLOCK.pattern + "Z?")


def csv_columns(path: Path) -> list[Column]:
    """Return the columns of a CSV."""
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
    body = "\n".join(line for line in lines[first:] if line.strip())
    if separator == " ":
        body = re.sub(r"^[ \t]+|[ \t]+$", "", re.sub(r"[ \t]+", " ", body), flags=re.MULTILINE)
    places = [f"{place}" for place in range(len(names))]
    with understood(path, "table"):
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

    def values(place: str) -> Any:
        column = table.column(place)
        if pa.types.is_time(column.type):
            column = column.cast(pa.string())
        if not pa.types.is_string(column.type):
            return column.to_numpy(zero_copy_only=False)
        if (times_s := _clock_s(column.to_pylist())) is not None:
            return times_s
        text = next(str(item) for item in column if not _NUMBER.fullmatch(str(item).strip()) and item.is_valid)
        raise ValueError(f"{shown(text)} is no number")

    def read(place: str, name: str) -> tuple[Array, None]:
        try:
            return numbers(values(place), name, path), None
        except (ValueError, StopIteration) as reason:
            raise RecordingError(f"column {shown(name)} holds no numbers: {reason}", file=path.name) from None

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
    """Return times of day [s], increasing over midnight, or None if a text is no time of day."""
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
    """Return the number of the first line of numbers, and the separator of its cells."""
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
    """Return names and units. The last line before the numbers holds the names, or the units of the names before it."""
    rows = [row for line in head if len(row := _cells(line.lstrip("#"), separator)) >= count]
    rows = [row for row in rows if sum(bool(cell) for cell in row) >= 2]
    names = [len(row) for line in head if sum(map(bool, row := _cells(line.lstrip("#"), separator))) >= 2]
    wrong = len(rows[-1]) if rows and any(rows[-1][count:]) else names[-1] if names and not rows else 0
    if wrong:
        raise RecordingError(
            f"names {wrong} columns and has {count}; decimal commas need another separator", file=path.name
        )
    if not rows:
        raise RecordingError("has no line with the names of its columns above the numbers", file=path.name, line=1)
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
    """Append a number to the second and further columns of a name. Files such as MDF may repeat names."""
    seen: dict[str, int] = {}
    found = []
    for column in columns:
        seen[column.name] = count = seen.get(column.name, 0) + 1
        found.append(column if count == 1 else column._replace(name=f"{column.name} ({count})"))
    return found


def second_of(name: str) -> str:
    """Return the name given to the second column of a name."""
    return f"{name} (2)"


def find(columns: list[Column], name: str, path: Path) -> Column:
    """Return the column with a name."""
    found = [column for column in columns if column.name == name]
    if found:
        return found[0]
    nearest = nearest_names(name, {column.name for column in columns})
    raise RecordingError(f"there is no column {shown(name)}; {nearest}", file=path.name, value=name)


def _in_child(path: Path) -> list[Column]:
    """Return the columns of a file that a child process reads, which lives as long as the columns."""
    child = Child(foreign_files.__file__, limits.MAX_READER_BYTES, quiet=True)

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


_READERS: Final[dict[str, Callable[[Path], list[Column]]]] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".asc"), csv_columns),
    **dict.fromkeys(foreign_files.READERS, _in_child),
}

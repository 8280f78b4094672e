"""Columns of a CSV written by another program."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer import limits
from activesteer.conventions import Array
from activesteer.errors import RecordingError, shown
from activesteer.files import read_bytes
from activesteer.measured.column import Column, check_rows, numbers, understood

_HEAD_LINES: Final = 200
"""Number of lines within which the numbers of a CSV must begin."""
_NUMBER: Final = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.IGNORECASE)
_COMMA: Final = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_CLOCK: Final = re.compile(r"(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)")
_DATED: Final = re.compile(r"(\d{4}-\d\d-\d\d[ T])?" + _CLOCK.pattern + "Z?")


def csv_columns(path: Path) -> list[Column]:
    """Return the columns of a CSV.

    Args:
        path: The file. Cells are separated by commas, semicolons, tabs, bars or blanks, and may be quoted. Decimal
            points or commas; lines above the names, and a line of units below them; UTF-8, UTF-16 or Latin-1.

    Raises:
        RecordingError: the file cannot be read, or holds no table.
    """
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
        if pa.types.is_string(column.type):
            if (times_s := _clock_s(column.to_pylist())) is not None:
                return times_s
            text = next(str(item) for item in column if not _NUMBER.fullmatch(str(item).strip()) and item.is_valid)
            raise ValueError(f"{shown(text)} is no number")
        return column.to_numpy(zero_copy_only=False)

    def lazy(place: str, name: str) -> Callable[[], tuple[Array, None]]:
        def read() -> tuple[Array, None]:
            try:
                return numbers(values(place), name, path), None
            except (ValueError, StopIteration) as reason:
                raise RecordingError(f"column {shown(name)} holds no numbers: {reason}", file=path.name) from None

        return read

    return [
        Column(name, unit, lazy(place, name)) for place, name, unit in zip(places, names, units, strict=True) if name
    ]


def _text(data: bytes) -> str:
    if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):  # Excel's "Unicode text"
        return data.decode("utf-16", "replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")  # exporters on Windows: a degree sign is one byte


def _clock_s(texts: list[str | None]) -> Array | None:
    """Return times of day [s], increasing over midnight; None if a text is no time of day."""
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
    """Return the number of the first line of numbers, and the separator of its cells.

    In such a line, every other cell may be a word, such as a gear, and one a date or a time of day.
    """
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
    if not rows and names:
        raise RecordingError(
            f"names {names[-1]} columns and has {count}; decimal commas need another separator", file=path.name
        )
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

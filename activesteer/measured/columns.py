"""Columns of a file of measured data, read on demand: CSV, MAT, Parquet, MDF."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer import limits
from activesteer.child_process import Child, ChildFault
from activesteer.conventions import Array
from activesteer.errors import RecordingError, nearest_names, shown
from activesteer.files import is_file, shown_path, why_no_file
from activesteer.measured import foreign_files
from activesteer.measured.column import Column
from activesteer.measured.csv_columns import csv_columns

_MAX_ANSWER_BYTES: Final = 16 * limits.MAX_ROWS + 2**20
"""Longest answer of a reader: values and times of a column [bytes]."""


def read_columns(path: Path) -> list[Column]:
    """Return the columns of a file.

    Args:
        path: A CSV (`.csv`, `.txt`, `.tsv`, `.asc`), `.mat`, `.parquet` or `.mf4` (`.mdf`, `.dat`) file.

    Raises:
        RecordingError: the file cannot be read, or has an unknown ending.
    """
    if not is_file(path):
        raise RecordingError(f"cannot read {shown_path(path)}: it {why_no_file(path)}", value=path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise RecordingError(
            f"{shown_path(path)}: files of measured data end in {', '.join(_READERS)}", value=path.suffix
        )
    return _numbered(reader(path))


def _numbered(columns: list[Column]) -> list[Column]:
    """Append a number to the second and further columns of a name; files such as MDF may repeat names."""
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
    """Return the column with a name.

    Raises:
        RecordingError: there is none.
    """
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

    def lazy(index: int, name: str) -> Callable[[], tuple[Array, Array | None]]:
        def read() -> tuple[Array, Array | None]:
            about, content = asked(index, f"reading column {shown(name)}")
            found = np.frombuffer(content, np.float64)
            values, times = np.split(found, 2) if about["timed"] else (found, None)
            return values.copy(), None if times is None else times.copy()

        return read

    about, _ = asked(os.fspath(path), "opening the file")
    return [Column(name, unit, lazy(index, name)) for index, (name, unit) in enumerate(about["columns"])]


_READERS: Final[dict[str, Callable[[Path], list[Column]]]] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".asc"), csv_columns),
    **dict.fromkeys(foreign_files.READERS, _in_child),
}

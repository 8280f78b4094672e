"""Tables that a user gives as CSV: found beside the manoeuvre file, read by the names of their columns."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from activesteer.config import Source
from activesteer.errors import ManeuverError, nearest_names


def find_csv(name: str, own: Path | None, source: Source, key: Sequence[str]) -> Path:
    """A CSV that a manoeuvre names.

    Args:
        name: What it is called there.
        own: Folder of the manoeuvre file; None for a table that has no file.
        source: For error messages.
        key: Key that names it.

    Returns:
        Path of an existing file.

    Raises:
        ManeuverError: there is no such file; the message names the nearest ones.
    """
    beside = () if own is None else (own / name,)
    for candidate in (*beside, Path(name).expanduser()):
        if candidate.is_file():
            return candidate
    folder = own or Path.cwd()
    present = [path.name for path in folder.glob("*.csv")]
    raise source.fail(key, f"there is no file {name!r} in {folder}; {nearest_names(name, present)}")


def read_columns(
    path: Path, required: Sequence[str], optional: Sequence[str] = ()
) -> tuple[dict[str, list[float]], list[str]]:
    """Columns of a CSV whose first line names them; others may stand beside them.

    Args:
        path: The file.
        required: Names of columns that it must have.
        optional: Names of columns that it may have.

    Returns:
        Column name -> values, and where each row stands, as `track.csv, line 7`.

    Raises:
        ManeuverError: the file cannot be read, a column is missing, or a value is no number.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as reason:
        msg = f"cannot read {path}: {reason}"
        raise ManeuverError(msg) from reason
    reader = csv.DictReader(lines, skipinitialspace=True)
    header = [name.strip() for name in reader.fieldnames or []]
    for column in required:
        if column not in header:
            known = nearest_names(column, header)
            wanted = " and ".join(required)
            msg = f"{path.name}, line 1: must name the columns {wanted}; {column} is missing: {known}"
            raise ManeuverError(msg)
    reader.fieldnames = header
    columns: dict[str, list[float]] = {name: [] for name in (*required, *optional) if name in header}
    places = []
    for row in reader:
        place = f"{path.name}, line {reader.line_num}"
        for name, values in columns.items():
            values.append(_number(row[name], f"{place}: {name}"))
        places.append(place)
    return columns, places


def _number(text: str | None, where: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        msg = f"{where}: {text!r} is not a number"
        raise ManeuverError(msg)
    return value

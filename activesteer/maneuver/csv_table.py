"""CSV tables of a user: found beside the manoeuvre file, read by the names of their columns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from activesteer.config import Source, field_in_unit
from activesteer.errors import ManeuverError, nearest_names, shown
from activesteer.files import csv_number, is_file, read_csv, user_path


def find_csv(name: str, folder: Path | None, source: Source, key: Sequence[str]) -> Path:
    """Find the CSV that a key of a manoeuvre names, in the folder of its file; None for a table that has no file."""
    beside = () if folder is None else (folder / name,)
    for candidate in (*beside, user_path(name, source.error)):
        if name.isprintable() and is_file(candidate):
            return candidate
    folder = folder or Path.cwd()
    present = [path.name for path in folder.iterdir() if path.suffix == ".csv"]
    raise source.fail(
        key, f"there is no file {shown(name)} in {shown(folder)}; {nearest_names(name, present)}", name, present
    )


def read_columns(
    path: Path, required: Sequence[str], optional: Sequence[str] = ()
) -> tuple[dict[str, list[float]], list[int]]:
    """Read required and optional columns of a CSV whose first line names them; other columns are ignored.

    A column may be in degrees or km/h, as in a TOML file: `steering_wheel_deg` fills `steering_wheel_rad`.

    Returns:
        Column name to values in SI, and the line number of each row.
    """
    rows = read_csv(path, ManeuverError)
    if not rows:
        raise ManeuverError("is empty; its first line must name the columns", file=path.name, line=1)
    header, rows = rows[0], rows[1:]
    places: dict[str, tuple[int, str, float]] = {}
    for place, given in enumerate(header.cells):
        name, factor = field_in_unit(given, (*required, *optional))
        if name is None:
            continue
        if name in places:
            raise ManeuverError(
                f"{places[name][1]} and {given} are the same column; leave one out",
                file=path.name,
                line=header.line,
                key=given,
            )
        places[name] = place, given, factor
    for row in rows:
        if any(row.cells[len(header.cells) :]):
            raise ManeuverError(
                f"has {len(row.cells)} cells, the first line {len(header.cells)}; decimal commas need semicolons",
                file=path.name,
                line=row.line,
            )
    for name in required:
        if name not in places:
            raise ManeuverError(
                f"must name the columns {' and '.join(required)}; {name} is missing",
                file=path.name,
                line=header.line,
                key=name,
                allowed=(*required, *optional),
            )
    columns: dict[str, list[float]] = {
        name: [
            csv_number(row.cells[place] if place < len(row.cells) else "", ManeuverError, path.name, row.line, given)
            * factor
            for row in rows
        ]
        for name, (place, given, factor) in places.items()
    }
    return columns, [row.line for row in rows]

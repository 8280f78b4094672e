"""Files that a manoeuvre names: CSV tables, height profiles and OpenCRG files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from activesteer import limits
from activesteer.config import Source, field_in_unit
from activesteer.errors import ManeuverError, nearest_names, shown
from activesteer.files import csv_number, is_file, read_bytes, read_csv, user_path
from activesteer.road.crg import packed, referenced


def find_csv(name: str, folder: Path | None, source: Source, key: Sequence[str]) -> Path:
    """Find the CSV that a key of a manoeuvre names, in the folder of its file, or None for a table that has no file."""
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
    """Read required and optional columns of a CSV whose first line names them. Other columns are ignored.

    A column may be in degrees or km/h, as in a TOML file: `steering_wheel_deg` fills `steering_wheel_rad`.
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


def with_road_files(
    table: Mapping[str, Any], folder: Path | None, source: Source
) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Fill the contents of the road's files into the table of a manoeuvre (see `Maneuver.filled_from_csv`).

    The files to be kept with the recording are the CSV files; the table itself holds the OpenCRG file.
    """
    road = table.get("road")
    files: dict[str, bytes] = {}
    if not isinstance(road, Mapping):
        return dict(table), files
    filled = dict(road)
    for key, values, read in (("profile", "heights", _profile), ("crg", "crg_data", _crg)):
        name, path = road.get(key), ("road", key)
        if not isinstance(name, str):
            continue
        if values in road and ".".join(path) not in source.overridden:
            if folder is None:
                continue
            raise source.fail(path, f"{key} and {values} both give the surface; leave one out")
        file = find_csv(name, folder, source, path)
        try:
            filled[values] = read(file)
        except ManeuverError as reason:
            raise source.fail(path, f"{file.name}: {reason}", reason.value, reason.allowed) from reason
        if key == "profile":
            files[f"road/{file.name}"] = read_bytes(file, ManeuverError, limits.MAX_CSV_BYTES)
    return {**table, "road": filled}, files


def _profile(file: Path) -> dict[str, list[float]]:
    columns, _ = read_columns(file, ("s_m",), ("z_m", "left_z_m", "right_z_m"))
    given = set(columns) - {"s_m"}
    if given == {"z_m"}:
        return {"s_m": columns["s_m"], "left_z_m": columns["z_m"]}
    if given != {"left_z_m", "right_z_m"}:
        raise ManeuverError(f"has the heights {sorted(given)}; z_m, or left_z_m and right_z_m are needed")
    return columns


def _crg(file: Path) -> list[str]:
    """Return an OpenCRG file with the files that it refers to, packed."""
    files = {file.name: read_bytes(file, ManeuverError, limits.MAX_CRG_BYTES)}
    name, place = file.name, file
    for _ in range(limits.MAX_CRG_FILES):
        other = referenced(files[name])
        if other is None:
            return list(packed(files))
        found = next(
            (path for path in (place.parent / other, place.parent / PurePosixPath(other).name) if is_file(path)), None
        )
        if found is None:
            raise ManeuverError(f"refers to {shown(other)}, which is not found beside it")
        name, place = other, found
        files[name] = read_bytes(found, ManeuverError, limits.MAX_CRG_BYTES)
    raise ManeuverError(f"refers to more than {limits.MAX_CRG_FILES} files in a chain")

"""The files that the table [road] of a manoeuvre names: a height profile as CSV, or an OpenCRG file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from activesteer import limits
from activesteer.config import Source
from activesteer.errors import ManeuverError, shown
from activesteer.files import is_file, read_bytes
from activesteer.maneuver.csv_table import find_csv, read_columns
from activesteer.road.crg import packed, referenced


def with_road_files(
    table: Mapping[str, Any], folder: Path | None, source: Source
) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Fill the contents of the road's files into the table of a manoeuvre; see `Maneuver.filled_from_csv`.

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

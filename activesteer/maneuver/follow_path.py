"""A user's own path, from a CSV or from the manoeuvre file, at constant speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from activesteer.config import Source
from activesteer.errors import ManeuverError
from activesteer.files import MAX_CSV_BYTES, read_bytes
from activesteer.maneuver.along_course import AlongCourse
from activesteer.maneuver.csv_table import find_csv
from activesteer.maneuver.path_points import check_points, read_csv
from activesteer.road.course import Course
from activesteer.road.path import Path


@dataclass(frozen=True)
class PathTable:
    """Points in the order of travel; the car starts at (0, 0), heading along x."""

    csv: str | None = None
    """CSV file with the columns x_m and y_m: a path, or a name in the manoeuvre's folder."""
    x_m: tuple[float, ...] | None = None
    """World x of the points [m]. Default: the points of the CSV."""
    y_m: tuple[float, ...] | None = None
    """World y, left positive [m]."""

    def __post_init__(self) -> None:
        """Check that the points make a path.

        Raises:
            ManeuverError: there are none, or a car cannot follow them.
        """
        if self.x_m is None or self.y_m is None:
            raise ManeuverError("csv (a file with the columns x_m and y_m) or both lists x_m and y_m are needed")
        check_points(self.x_m, self.y_m, lambda index: f"point {index + 1}")


@dataclass(frozen=True, kw_only=True)
class FollowPath(AlongCourse):
    """A path through given points."""

    path: PathTable
    """The points."""

    @classmethod
    def filled_from_csv(
        cls, table: Mapping[str, Any], folder: FilePath | None, source: Source
    ) -> tuple[dict[str, Any], dict[str, bytes]]:
        """Fill in the points of the CSV; see the base class."""
        points = table.get("path")
        if not isinstance(points, Mapping) or not isinstance(points.get("csv"), str):
            return dict(table), {}
        if ("x_m" in points or "y_m" in points) and "path.csv" not in source.overridden:
            if folder is None:
                return dict(table), {}
            raise source.fail(("path", "csv"), "csv and the lists x_m, y_m both give the points; leave one out")
        file = find_csv(points["csv"], folder, source, ("path", "csv"))
        try:
            x_m, y_m, lines = read_csv(file)
            check_points(x_m, y_m, lambda index: f"{file.name}, line {lines[index]}")
        except ManeuverError as reason:
            raise source.fail(("path", "csv"), str(reason), reason.value, reason.allowed) from reason
        filled = {**table, "path": {**points, "x_m": x_m, "y_m": y_m}}
        return filled, {f"path/{file.name}": read_bytes(file, ManeuverError, MAX_CSV_BYTES)}

    def _make_course(self) -> Course:
        return Course(Path.through(self.path.x_m or (), self.path.y_m or ()))

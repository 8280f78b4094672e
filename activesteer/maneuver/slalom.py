"""Slalom: at constant speed past a row of cones, left and right in turn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.along_course import AlongCourse, Width, known_width
from activesteer.maneuver.base import SIGNS, Side
from activesteer.road.course import Course
from activesteer.road.path import Path

_SAMPLE_M: Final = 0.5


@dataclass(frozen=True)
class ConeRow:
    """The row of cones along x and the path past it."""

    spacing_m: Annotated[float, Range(5.0, 200.0)] = 36.0
    """Distance between cones [m]; 18 and 30.5 m (100 ft) are common, 36 m suits 100 km/h."""
    count: Annotated[int, Range(2, 100)] = 6
    """Number of cones."""
    offset_m: Annotated[float, Range(0.0, 10.0)] = 1.15
    """Distance of the path from the row at every cone: the amplitude of its sine [m]."""
    entry_m: Annotated[float, Range(0.0, 1000.0)] = 50.0
    """Distance from the start to the first cone [m]."""
    side: Side = "left"
    """Side on which the car passes the first cone: `left` or `right`."""

    def __post_init__(self) -> None:
        """Check that the path has room to leave the straight line before the first cone."""
        if self.entry_m < self.spacing_m:
            raise ManeuverError(
                f"is {self.entry_m:g} m; the path leaves the straight line one spacing before the first cone: "
                f"at least {self.spacing_m:g} m are needed (spacing_m)",
                key="entry_m",
                value=self.entry_m,
                allowed=Range(self.spacing_m),
            )


@dataclass(frozen=True, kw_only=True)
class Slalom(AlongCourse):
    """A slalom along a sine.

    Between the cones the path is a cosine with its crests at the cones. It leaves the line of the cones one spacing
    before the first crest, with no more curvature than the cosine. Between the last two cones it straightens, with 15 %
    more curvature. Behind the last cone it is straight and parallel to the row, so that the car oscillates there only
    by itself. Both transitions are quintics without a jump of curvature.
    """

    cones: ConeRow = ConeRow()
    """The cones."""
    vehicle_width_m: Width | None = None
    """Width of the vehicle, which must fit past the cones [m]. Default: the width in the vehicle file."""

    def _make_course(self) -> Course:
        row, width = self.cones, known_width(self.vehicle_width_m)
        if row.offset_m <= 0.5 * width:
            raise ManeuverError(
                f"is {row.offset_m:g} m; a car of {width:g} m width touches the cones unless it is "
                f"above {0.5 * width:g} m",
                key="cones.offset_m",
                value=row.offset_m,
                allowed=Range(0.5 * width),
            )
        places = row.entry_m + row.spacing_m * np.arange(row.count, dtype=np.float64)
        path_x, path_y = _slalom_path(places, row.spacing_m, row.offset_m)
        cones = np.column_stack([places, np.zeros_like(places)])
        return Course(Path.through(path_x, SIGNS[row.side] * path_y), (), cones, float(places[-1]))


def _slalom_path(places: np.ndarray, spacing: float, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of a path that passes the first cone on the left."""
    from scipy.interpolate import BPoly  # noqa: PLC0415 - slow to import, and only a slalom needs it

    first, last = float(places[0]), float(places[-1])
    wave_number = math.pi / spacing
    crest = np.array([offset, 0.0, -offset * wave_number**2])
    straight = np.array([1.0, 0.0, 0.0])
    last_side = 1.0 if len(places) % 2 else -1.0
    entry = BPoly.from_derivatives([first - spacing, first], [0.0 * straight, crest])
    leaving = BPoly.from_derivatives([last - spacing, last], [-last_side * crest, last_side * offset * straight])
    x = np.linspace(0.0, last, math.ceil(last / _SAMPLE_M) + 1)
    y = np.select(
        [x < first - spacing, x < first, x < last - spacing],
        [0.0, entry(x), offset * np.cos(wave_number * (x - first))],
        leaving(x),
    )
    return x, y

"""Slalom: round a row of cones, left and right in turn, at constant speed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.along_course import AlongCourse, Width, known_width
from activesteer.maneuver.choices import SIDES, check_choice
from activesteer.road.course import Course
from activesteer.road.path import Path

_SAMPLE_M: Final = 0.5


@dataclass(frozen=True)
class ConeRow:
    """The row of cones along x and how it is driven."""

    spacing_m: Annotated[float, Range(5.0, 200.0)] = 36.0
    """Distance of the cones [m]; 18 and 30.5 m (100 ft) are common, 36 m suits 100 km/h."""
    count: Annotated[int, Range(2, 100)] = 6
    """How many cones there are."""
    offset_m: Annotated[float, Range(0.0, 10.0)] = 1.15
    """Distance of the path from the row at every cone, that is the amplitude of its sine [m]."""
    entry_m: Annotated[float, Range(0.0, 1000.0)] = 50.0
    """Distance from the start to the first cone [m]."""
    side: str = "left"
    """On which side the car passes the first cone: `left` or `right`."""

    def __post_init__(self) -> None:
        """Checks what belongs together.

        Raises:
            ManeuverError: the side is unknown, or there is no room to leave the straight line before the first cone.
        """
        check_choice("side", self.side, SIDES)
        if self.entry_m < self.spacing_m:
            raise ManeuverError(
                f"is {self.entry_m:g} m; the path leaves the straight line one spacing before the first cone, "
                f"so that at least {self.spacing_m:g} m are needed (spacing_m)",
                key="entry_m",
                value=self.entry_m,
                allowed=Range(self.spacing_m),
            )


@dataclass(frozen=True, kw_only=True)
class Slalom(AlongCourse):
    """A slalom along a sine.

    Between the cones the path is a cosine with its crests at the cones. It comes to the first crest from the line of
    the cones, within one spacing and with no more curvature than the cosine has. Between the last two cones it
    straightens, with 15 % more curvature; from the last cone on it is straight and parallel to the row, so that
    whatever the car does there is an oscillation of its own. Both are quintics without a jump of curvature.
    """

    cones: ConeRow = ConeRow()
    """The cones."""
    vehicle_width_m: Width | None = None
    """Width of the vehicle, which must fit past the cones [m]; that of the vehicle file where not given."""

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
        return Course(Path.through(path_x, SIDES[row.side] * path_y), (), cones, float(places[-1]))


def _slalom_path(places: np.ndarray, spacing: float, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Path that passes the first cone on the left."""
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

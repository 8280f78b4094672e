"""The road that the manoeuvre sets and the vehicle drives on.

A road is a plane with a grade and a bank, on which there may be an uneven surface (`surface`). Its friction may differ
from place to place. Places are given in the world axes of the recording, x along the track from the initial position of
the centre of gravity, y to the left; or, with `along = "path"`, by the distance along the path of the manoeuvre's
course and the side of that path. A wheel has the friction at its contact point. While the car settles before
the recording, it rolls on the plane, only on `mu`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, ClassVar, Final, Literal, NamedTuple

import numpy as np

from activesteer.config import Range, Source, build, check_points
from activesteer.core.conventions import Array
from activesteer.core.limits import fail, table_of
from activesteer.core.path import Path
from activesteer.errors import ManeuverError, RecordingError
from activesteer.road.course import Course, ProfileTable, course_of, sampled
from activesteer.road.crg import unpacked
from activesteer.road.obstacles import SIDES, Grid, Obstacle, Roughness, Side, summed

Friction = Annotated[float, Range(0.01, 2.0)]

_MAX_POINTS: Final = 100_000
_MAX_LENGTH_M: Final = 100_000.0
_SAMPLE_M: Final = 0.25
"""Distance of the samples of a banking [m]: bank runs over tens of metres."""
_SLICES: Final = 20
"""Pieces in which a patch with changing friction is drawn."""
_SLICE_M: Final = 2.0
"""Length of the pieces in which a patch along a path is drawn [m], at most `_MAX_SLICES` of them."""
_MAX_SLICES: Final = 200
_EDGE_POINTS: Final = 31
"""Points of the edge of an obstacle: a border of the drawing cuts a rotated obstacle within some centimetres."""
_SHOWN_BESIDE_M: Final = 4.0
"""Width to either side of the path in which its friction is drawn [m]. The friction also counts further out."""


@dataclass(frozen=True)
class RoadPatch:
    """A stretch of the road with a different friction, as a table [[road.patches]]."""

    start_m: float
    """Start along x or along the path, see `along`; included [m]."""
    end_m: float
    """End along x or along the path, not included [m]."""
    mu: Friction
    """Friction relative to the friction in the tyre files [-]."""
    side: Side = "both"
    """`both`, `left` (y > 0, or left of the path) or `right` (y <= 0)."""
    mu_end: Friction | None = None
    """Friction at the end [-], linear from `mu` at the start. Default: `mu` throughout."""

    def __post_init__(self) -> None:
        """Check that the patch ends after its start."""
        if not self.end_m > self.start_m:
            raise ManeuverError(
                f"the patch ends at {self.end_m:g} m, which is not after its start_m of {self.start_m:g} m"
            )


@dataclass(frozen=True)
class BankingTable:
    """Bank versus distance, smooth through its points, as the table [road.banking]."""

    s_m: tuple[float, ...]
    """Distances along x or along the path [m], increasing."""
    bank_rad: tuple[float, ...]
    """Bank at these distances [rad]. Positive if the left side is higher."""

    def __post_init__(self) -> None:
        """Check the points of the banking."""
        check_points("s_m", self.s_m, {"bank_deg": self.bank_rad}, Range(2, _MAX_POINTS), ManeuverError)
        if self.s_m[-1] - self.s_m[0] > _MAX_LENGTH_M:
            raise ManeuverError(
                f"is {self.s_m[-1] - self.s_m[0]:g} m long; at most {_MAX_LENGTH_M:g} m is allowed", key="s_m"
            )
        if any(abs(bank) > math.pi / 4.0 for bank in self.bank_rad):
            raise ManeuverError(
                "has a bank steeper than 45 deg; at most 45 deg to either side is allowed", key="bank_deg"
            )

    def sampled(self) -> tuple[float, float, Array]:
        """Return the first position, the step [m] and the cross slopes."""
        step_m, banks_rad = sampled(self.s_m, self.bank_rad, _SAMPLE_M)
        return self.s_m[0], step_m, np.tan(banks_rad)


class Area(NamedTuple):
    """A rectangle of the road, with friction `mu` at the start (included), which changes by `slope_1pm` per metre."""

    # On a road along a path, x is the distance along the path and y the distance to its left.
    start_m: float
    end_m: float
    right_m: float
    left_m: float
    mu: float
    slope_1pm: float = 0.0

    def clipped(self, start_m: float, end_m: float, right_m: float, left_m: float) -> Area | None:
        """Return the intersection with another rectangle [m], or None if empty."""
        start, end = max(self.start_m, start_m), min(self.end_m, end_m)
        right, left = max(self.right_m, right_m), min(self.left_m, left_m)
        if not (start < end and right < left):
            return None
        mu = self.mu + self.slope_1pm * (start - self.start_m) if self.slope_1pm else self.mu
        return Area(start, end, right, left, mu, self.slope_1pm)


class Piece(NamedTuple):
    """A quadrilateral for drawing, with the friction in its middle and corners anticlockwise [m]."""

    area: int
    mu: float
    corners_m: Array


@dataclass(frozen=True)
class Road:
    """The road under the wheels, as the table [road] of a manoeuvre file."""

    OVERRULED: ClassVar = {"mu": {"mu_left": None, "mu_right": None}}
    KEY_HINTS: ClassVar = {
        "bank": "give bank_deg for the whole road, or a table banking over the distance",
        **dict.fromkeys(
            ("bump", "bumps", "obstacles", "cleat", "kerb", "pothole"), "give tables [[road.obstacle]] with a kind"
        ),
    }

    mu: Friction = 1.0
    """Friction relative to the friction in the tyre files [-]."""
    grade: Annotated[float, Range(-0.5, 0.5)] = 0.0
    """Rise over run in the direction of travel [-]. Positive is uphill."""
    mu_left: Friction | None = None
    """Friction where y > 0 [-]; default `mu`."""
    mu_right: Friction | None = None
    """Friction where y <= 0 [-]; default `mu`."""
    patches: tuple[RoadPatch, ...] = ()
    """Stretches with their own friction. Where two overlap, the later one counts."""
    along: Literal["x", "path"] = "x"
    """Line that patches, sides, obstacles and surfaces follow: `x`, the world's x axis, or `path`, the path of the
    manoeuvre's course."""

    bank_rad: Annotated[float, Range(-0.5, 0.5)] = 0.0
    """Bank of the whole road [rad]. Positive if the left side is higher, as for a right-hand curve."""
    obstacle: tuple[Obstacle, ...] = ()
    """Bumps, cleats, kerbs, potholes, cross slopes and waves. Their heights add up."""
    profile: str | None = None
    """CSV file with the columns s_m and z_m, or s_m, left_z_m and right_z_m: a path, or a name in the manoeuvre's
    folder."""
    heights: ProfileTable | None = None
    """Heights of two tracks versus distance. Default: the heights of the CSV."""
    roughness: Roughness | None = None
    """Random roughness of ISO 8608. Default: none."""
    crg: str | None = None
    """OpenCRG file: a path, or a name in the manoeuvre's folder. The car enters it at `start_m`. Its reference line is
    the line of the road, unless the road is laid along a path."""
    crg_data: tuple[str, ...] = ()
    """Content of that file, compressed, as recordings keep it."""
    banking: BankingTable | None = None
    """Bank versus distance, as for a banked curve. Default: none."""
    contact: Literal["auto", "single_point", "four_point", "enveloping"] = "auto"
    """Model of the contact with an uneven road, see `activesteer.vehicle.native_contact`. `auto`: `single_point` if all
    unevenness is long and smooth, otherwise `enveloping`."""
    start_m: Annotated[float, Range(3.0, 1000.0)] = 10.0
    """Distance from which an uneven surface or `banking` acts fully [m]. The surface fades in from 2 m on."""
    outside: Literal["extend", "error"] = "extend"
    """Behaviour beyond the known surface: `extend` its edge, or end the run with an `error`."""

    def __post_init__(self) -> None:
        """Check that every key has an effect."""
        split = self.patches or self.mu_left is not None or self.mu_right is not None
        if self.along == "path" and not split and not self.is_uneven:
            raise ManeuverError("'path' has no effect without patches, mu_left, mu_right or a surface", key="along")
        gridded = self._is_gridded
        for key, default, needed in (
            ("contact", "auto", self.is_uneven), ("start_m", 10.0, gridded or self.banking is not None),
            ("outside", "extend", gridded),
        ):  # fmt: skip
            if getattr(self, key) != default and not needed:
                raise ManeuverError("has no effect on a road without such a surface; leave it out", key=key)
        if self.crg_data:
            unpacked(self.crg_data)
            if others := [key for key in ("heights", "roughness", "banking") if getattr(self, key) is not None]:
                raise ManeuverError(f"cannot be combined with {' and '.join(others)}", key="crg")
        elif self.crg is not None:
            raise ManeuverError(
                "names a file, but only a manoeuvre reads the file; build the road from a manoeuvre", key="crg"
            )
        if self.profile is not None and self.heights is None:
            problem = (
                "names a file, but only a manoeuvre reads the file; build the road from a manoeuvre, or give heights"
            )
            raise ManeuverError(problem, key="profile")

    @property
    def _is_gridded(self) -> bool:
        return self.heights is not None or self.roughness is not None or bool(self.crg_data)

    @property
    def is_uneven(self) -> bool:
        """True if the road has a surface in addition to its plane."""
        return bool(self.obstacle) or self.banking is not None or self._is_gridded

    @property
    def contact_used(self) -> str:
        """Contact model on the uneven surface."""
        if self.contact != "auto":
            return self.contact
        smooth = not (self._is_gridded or self.is_steep)
        return "single_point" if smooth else "enveloping"

    @property
    def is_steep(self) -> bool:
        """True if an obstacle is sharp within the contact patch, such as a cleat or a kerb."""
        return not all(obstacle.is_smooth for obstacle in self.obstacle)

    def laid(self, course: Course | None) -> Road:
        """Return the road: with the path of the course if it follows the course, otherwise unchanged.

        Raises:
            ManeuverError: the road follows the path, and the manoeuvre has none.
        """
        values = [getattr(self, field.name) for field in fields(Road)]
        if self.along == "x":
            line = unpacked(self.crg_data).line if self.crg_data else None
            if line is None:
                return self
            ahead = np.linspace(0.0, self.start_m, 1 + math.ceil(self.start_m))[:-1]
            x, y = np.append(ahead, self.start_m + line.x_m), np.append(0.0 * ahead, line.y_m)
            return LaidRoad(*values, path=Path.through(x, y))
        if course is None:
            raise ManeuverError(
                "is 'path', but this manoeuvre sets the steering wheel and has no path; use 'x'", key="road.along"
            )
        return LaidRoad(*values, path=course.path)

    def grid(self) -> Grid | None:
        """Return the heights of the surface without obstacles and banking, or None if flat."""
        if self.crg_data:
            return unpacked(self.crg_data).grid._replace(s_m=self.start_m)
        grids = [part.grid() for part in (self.roughness, self.heights) if part is not None]
        return summed(*grids) if len(grids) > 1 else grids[0] if grids else None

    def placed(self, s_m: Array, d_m: Array) -> tuple[Array, Array]:
        """Convert positions along and to the left of the road's middle line to the world [m]."""
        return s_m, d_m

    def located(self, x_m: Array, y_m: Array) -> tuple[Array, Array]:
        """Convert positions in the world to positions along and to the left of the road's middle line [m]."""
        return x_m, y_m

    def extended_share(self, x_m: Array, y_m: Array) -> float:
        """Return the fraction of positions in the world [m] that are outside the known surface."""
        grid = self.grid()
        if grid is None:
            return 0.0
        s, d = self.located(x_m, y_m)
        return float(np.mean(~grid.knows(s, d) & (s >= self.start_m)))

    def areas(self) -> tuple[Area, ...]:
        """Return the areas with a friction other than `mu`. Where they overlap, the later one counts."""
        sides = (("left", self.mu_left), ("right", self.mu_right))
        split = [Area(-math.inf, math.inf, *SIDES[side], mu) for side, mu in sides if mu is not None]
        return (*split, *(Area(it.start_m, it.end_m, *SIDES[it.side], it.mu, _slope(it)) for it in self.patches))

    def pieces(self, start_m: float, end_m: float, right_m: float, left_m: float) -> list[Piece]:
        """Return quadrilaterals [m] of different friction within a rectangle of the world, later ones on top."""
        shown = (area.clipped(start_m, end_m, right_m, left_m) for area in self.areas())
        return [
            piece
            for index, area in enumerate(shown)
            if area is not None
            for piece in _sliced(index, area, 1 if area.slope_1pm == 0.0 else _SLICES, lambda x, y: (x, y))
        ]

    def outlines(self, start_m: float, end_m: float, right_m: float, left_m: float) -> list[tuple[str, Array]]:
        """Return label and corners [m] of the steps and bumps within a rectangle of the world."""
        found = []
        for it in self.obstacle:
            if it.height_m is None or it.kind == "sine_wave":
                continue
            right, left = np.clip(it.borders, right_m, left_m)
            d_m = np.linspace(right, left, _EDGE_POINTS)
            near_m = it.start_m - math.tan(it.angle_rad) * d_m
            far_m = near_m + (math.inf if it.length_m is None else it.length_m)
            s_m = np.clip(np.concatenate([near_m, far_m[::-1]]), start_m, end_m)
            corners_m = np.column_stack(self.placed(s_m, np.concatenate([d_m, d_m[::-1]])))
            found.append((f"{it.kind.replace('_', ' ')} of {1e3 * it.height_m:.4g} mm", corners_m))
        return found


def _sliced(index: int, area: Area, slices: int, place: Callable[[Array, Array], tuple[Array, Array]]) -> list[Piece]:
    """Cut an area into slices, and convert their corners to the world with `place`."""
    stations = np.linspace(area.start_m, area.end_m, slices + 1)
    edges = [np.column_stack(place(stations, np.full(slices + 1, y))) for y in (area.right_m, area.left_m)]
    corners = np.stack([edges[0][:-1], edges[0][1:], edges[1][1:], edges[1][:-1]], axis=1)
    middles = 0.5 * (stations[1:] + stations[:-1]) - area.start_m
    return [
        Piece(index, area.mu + area.slope_1pm * x if area.slope_1pm else area.mu, quad)
        for x, quad in zip(middles.tolist(), corners, strict=True)
    ]


def _slope(patch: RoadPatch) -> float:
    return 0.0 if patch.mu_end is None else (patch.mu_end - patch.mu) / (patch.end_m - patch.start_m)


@dataclass(frozen=True)
class LaidRoad(Road):
    """A road that follows a path."""

    path: Path = field(kw_only=True)
    """The path of the course."""

    def placed(self, s_m: Array, d_m: Array) -> tuple[Array, Array]:
        """Convert positions along and to the left of the path to the world (see the base class)."""
        path = self.path
        x, y, heading = (np.interp(s_m, path.s_m, line) for line in (path.x_m, path.y_m, path.heading_rad))
        beyond = np.maximum(s_m - path.length_m, 0.0) + np.minimum(s_m, 0.0)
        cos, sin = np.cos(heading), np.sin(heading)
        return x + beyond * cos - d_m * sin, y + beyond * sin + d_m * cos

    def located(self, x_m: Array, y_m: Array) -> tuple[Array, Array]:
        """Convert positions in the world to positions along and to the left of the path (see the base class)."""
        from scipy.spatial import KDTree  # noqa: PLC0415 - slow to import, and needed for few roads

        path = self.path
        _, near = KDTree(np.column_stack([path.x_m, path.y_m])).query(np.column_stack([x_m, y_m]))
        dx, dy, heading = x_m - path.x_m[near], y_m - path.y_m[near], path.heading_rad[near]
        cos, sin = np.cos(heading), np.sin(heading)
        return path.s_m[near] + dx * cos + dy * sin, dy * cos - dx * sin

    def pieces(self, start_m: float, end_m: float, right_m: float, left_m: float) -> list[Piece]:
        """Return all areas of different friction as quadrilaterals along the path. The rectangle is ignored."""
        path, found = self.path, []
        for index, area in enumerate(self.areas()):
            shown = area.clipped(0.0, path.length_m, -_SHOWN_BESIDE_M, _SHOWN_BESIDE_M)
            if shown is not None:
                slices = min(_MAX_SLICES, math.ceil((shown.end_m - shown.start_m) / _SLICE_M))
                found += _sliced(index, shown, slices, self.placed)
        return found

    def outlines(self, start_m: float, end_m: float, right_m: float, left_m: float) -> list[tuple[str, Array]]:
        """Return label and corners of all steps and bumps along the path. The rectangle is ignored."""
        return super().outlines(0.0, self.path.length_m, -_SHOWN_BESIDE_M, _SHOWN_BESIDE_M)


def road_of(metadata: Mapping[str, Any]) -> Road:
    """Return the road of a recorded run, a default road if not recorded."""
    maneuver = table_of(metadata.get("maneuver", {}), "maneuver")
    table = table_of(maneuver.get("road", {}), "maneuver.road")
    road = build(Road, table, Source("the metadata of the recording", error=RecordingError), ("maneuver", "road"))
    if road.along == "x":
        return road.laid(None)
    if (course := course_of(metadata)) is None:
        raise fail("maneuver.road.along", "is 'path', but the recording has no course")
    return road.laid(course)

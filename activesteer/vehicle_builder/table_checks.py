"""Checks of a table, with all errors at once: names, missing points, contradictions, units."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from activesteer.config import Source
from activesteer.errors import ParameterError, nearest_names
from activesteer.vehicle_builder.axle_kinds import AxleKind
from activesteer.vehicle_builder.table import POINT_FIELDS, AxleTable, CarTable, Point

_PLAUSIBLE: Final = {
    "spring_rate_Npm": (5e3, 8e5, 1e3, "N/mm"),
    "wheel_rate_Npm": (5e3, 3e5, 1e3, "N/mm"),
    "stiffness_Npm": (2e4, 1e10, 1e3, "N/mm"),
    "radial_Npm": (2e4, 1e10, 1e3, "N/mm"),
    "axial_Npm": (2e4, 1e10, 1e3, "N/mm"),
    "damper_Nspm": (200.0, 5e4, 1e3, "N s/mm"),
    "cg_height_m": (0.2, 1.5, 1e-3, "mm"),
    "anti_roll_bar_Npm": (300.0, 3e5, 1e3, "N/mm"),
    "total_kg": (200.0, 6000.0, 1e3, "t"),
    "bump_stop_m": (0.003, 0.3, 1e-3, "mm"),
    "rebound_stop_m": (0.003, 0.3, 1e-3, "mm"),
    "rack_limit_m": (0.02, 0.15, 1e-3, "mm"),
    "pinion_radius_m": (0.003, 0.3, 1e-3, "mm"),
}
"""Key -> lowest and highest value of a road car, and a unit that users may have used by mistake, with its factor."""


_ONE_OF: Final = (
    ("spring_rate_Npm", "wheel_rate_Npm", "ride_frequency_Hz"),
    ("damper_force_N", "damper_Nspm", "damping_ratio"),
    ("anti_roll_bar_Npm", "anti_roll_bar_Nmprad"),
)
"""Keys of an axle of which one is enough."""
_STIFFNESS: Final = ("stiffness_Npm", "bushings_Npm", "bushing")


def check_points(table: CarTable, kinds: Mapping[str, AxleKind], source: Source) -> None:
    """Check names, number and units of all points, and units of other values."""
    problems = [
        *_name_problems(table, kinds),
        *_axle_contradictions("front", table.front),
        *_axle_contradictions("rear", table.rear),
        *_car_contradictions(table),
        *_length_problems(table),
        *_unit_problems(table),
    ]
    if problems:
        raise ParameterError("\n  ".join([f"{source.name}: {len(problems)} errors:", *problems]))


def _axle_contradictions(axle: str, given: AxleTable) -> Iterator[str]:
    for group in _ONE_OF:
        ways = [way for way in group if getattr(given, way) is not None]
        if len(ways) > 1:
            yield f"{axle}: {' and '.join(ways)} say the same; give one of them"
    if (given.damper_force_N is None) != (given.damper_velocity_mps is None):
        yield f"{axle}: damper_velocity_mps and damper_force_N belong together; give both"
    for name, link in given.links.items():
        ways = [way for way in _STIFFNESS if getattr(link, way) is not None]
        if len(ways) > 1:
            yield f"{axle}.links.{name}: {' and '.join(ways)} say the same; give one of them"


def _name_problems(table: CarTable, kinds: Mapping[str, AxleKind]) -> Iterator[str]:
    for axle, kind in kinds.items():
        given = table.axle(axle)
        for name in given.points:
            if name not in kind.needed:
                yield f"{axle}.points.{name}: a {kind.name} axle has no such point; {nearest_names(name, kind.needed)}"
        for key in ("spring_ratio", "damper_ratio"):
            if getattr(given, key) is not None and not kind.guided:
                yield f"{axle}.{key}: follows from the hardpoints of a {kind.name} axle"
        for key in ("toe_rad", "camber_rad", "spring_on", "damper_on", "wheel_rate_Npm", "ride_frequency_Hz"):
            if getattr(given, key) is not None and kind.guided:
                yield f"{axle}.{key.replace('_rad', '_deg')}: an axle of curves has it from its measurements"
        missing = [name for name in kind.needed if name not in given.points]
        if missing:
            yield f"{axle}.points: a {kind.name} axle also needs {', '.join(missing)}"
        links = [link.name for link in kind.links]
        for name in given.links:
            if name not in links:
                yield f"{axle}.links.{name}: a {kind.name} axle has no such link; {nearest_names(name, links)}"
        for key in ("spring_on", "damper_on"):
            on = getattr(given, key)
            if on is not None and on not in kind.carriers:
                yield f"{axle}.{key}: nothing that could carry it is named {on!r}; {nearest_names(on, kind.carriers)}"


def _car_contradictions(table: CarTable) -> Iterator[str]:
    mass = table.mass
    if (mass.total_kg is None) == (mass.chassis_kg is None):
        yield "mass: total_kg (of the whole car) or chassis_kg is needed, one of them"
    if mass.total_kg is not None and (mass.front_fraction is None or mass.cg_height_m is None):
        yield "mass: with total_kg, front_fraction and cg_height_m are needed"
    if mass.chassis_kg is not None and mass.chassis_cg is None:
        yield "mass: with chassis_kg, chassis_cg is needed"
    if table.steering.ratio is not None and table.steering.pinion_radius_m is not None:
        yield "steering: ratio and pinion_radius_m say the same; give one of them"
    if (table.rear_steering.axis_lower is None) != (table.rear_steering.axis_upper is None):
        yield "rear_steering: axis_lower and axis_upper belong together; give both"


def all_points(table: CarTable) -> Iterator[tuple[str, Point]]:
    """Return all points of the table by dotted key."""
    for axle in ("front", "rear"):
        for name, point in table.axle(axle).points.items():
            yield f"{axle}.points.{name}", point
    for part in ("front", "rear", "mass", "rear_steering"):
        for name in sorted(POINT_FIELDS):
            point = getattr(getattr(table, part), name, None)
            if point is not None:
                yield f"{part}.{name}", point


def _length_problems(table: CarTable) -> Iterator[str]:
    for key, point in (*all_points(table), ("origin", table.origin)):
        if len(point) != 3:
            yield f"{key}: {len(point)} numbers given; x, y, z are needed"
    for axle in ("front", "rear"):
        given = table.axle(axle)
        for key in ("knuckle_inertia_kgm2", "carrier_inertia_kgm2", "strut_inertia_kgm2", "stop_stiffness"):
            _count = getattr(given, key)
            if _count is not None and len(_count) != 3:
                yield f"{axle}.{key}: {len(_count)} numbers given; 3 are needed"
        for name, link in given.links.items():
            if link.bushings_Npm is not None and (len(link.bushings_Npm) != 2 or min(link.bushings_Npm) <= 0.0):
                yield f"{axle}.links.{name}.bushings_Npm: two stiffnesses above 0 are needed, inner and outer"
    for key in ("inertia_kgm2", "chassis_inertia_kgm2"):
        value = getattr(table.mass, key)
        if value is not None and (len(value) != 3 or min(value) <= 0.0):
            yield f"mass.{key}: three numbers above 0 are needed: roll, pitch, yaw"


def _unit_problems(table: CarTable) -> Iterator[str]:
    points = list(all_points(table))
    size = {key: max(map(abs, point), default=0.0) for key, point in points}
    if table.units == "m":
        large = [key for key in size if size[key] > 15.0]
        if large:
            example = large[0]
            yield (
                f"{len(large)} of {len(points)} points are not in metres, as {example} with {size[example]:g}: "
                + ('are all in mm? then write units = "mm"' if len(large) > len(points) / 2 else "are these in mm?")
                + ("" if len(large) > len(points) / 2 else f" ({', '.join(large[:6])})")
            )
    elif points and max(size.values()) < 15.0:
        yield f'units is "mm", and no point is further than {max(size.values()):g} from the origin: are they in m?'
    for path, value in _numbers(table):
        key = path.rpartition(".")[2]
        if key in _PLAUSIBLE:
            low, high, factor, unit = _PLAUSIBLE[key]
            if not low <= value <= high and value != 0.0:
                hint = f"; is it in {unit}? then write {value * factor:g}" if low <= value * factor <= high else ""
                yield f"{path}: {value:g} is no value of a road car ({low:g} to {high:g}){hint}"


def _numbers(part: Any, path: str = "") -> Iterator[tuple[str, float]]:
    if dataclasses.is_dataclass(part):
        for item in dataclasses.fields(part):
            yield from _numbers(getattr(part, item.name), f"{path}.{item.name}" if path else item.name)
    elif isinstance(part, dict):
        for key, value in part.items():
            yield from _numbers(value, f"{path}.{key}")
    elif isinstance(part, float) and math.isfinite(part):
        yield path, part

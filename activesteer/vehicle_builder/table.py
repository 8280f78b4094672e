"""The table of a new car, with its checks.

In a CSV file a row is a dotted key and its values: `front.wheel_centre, 0, 762.5, 297.2` is the point `wheel_centre` of
[front.points], `mass.total_kg, 1430` the key `total_kg` of [mass]. `#` begins a comment.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final

from activesteer.config import Range, Source, build, read_toml
from activesteer.core.files import read_csv
from activesteer.core.units import known_unit
from activesteer.errors import ParameterError, nearest_names
from activesteer.sensors.parameters import Sensors
from activesteer.vehicle.brakes.records import Brakes
from activesteer.vehicle.electric_actuators import Battery, Motors, RearActuator, SuperpositionActuator
from activesteer.vehicle.parameters import Aerodynamics, Powertrain
from activesteer.vehicle_builder.axle_kinds import DEFAULTS, AxleKind, kind_of

Positive = Annotated[float, Range(1e-9)]
NotNegative = Annotated[float, Range(0.0)]
Point = tuple[float, ...]

UNITS: Final = ("m", "mm")
"""Units of the points."""


@dataclass(frozen=True)
class LinkTable:
    """Keys of a link, with one of `stiffness_Npm`, `bushings_Npm` and `bushing`."""

    stiffness_Npm: Positive | None = None
    """Stiffness of rod and both bushings in series [N/m]."""
    bushings_Npm: tuple[float, ...] | None = None
    """Radial stiffness of inner and outer bushing [N/m]. The rod between them counts as rigid."""
    bushing: str | None = None
    """Class of the bushings: ball_joint, hard, medium, soft."""
    hardening_Npm3: NotNegative | None = None
    """Cubic part of the force [N/m3]."""
    damping_Nspm: NotNegative | None = None
    """Damping of the rubber [N s/m]."""


@dataclass(frozen=True)
class TopMountTable:
    """Keys of the top mount of a strut, or of a damper with its rod."""

    radial_Npm: Positive | None = None
    """Strut: stiffness across its axis, of bushing, bending rod and body in series [N/m]."""
    axial_Npm: Positive | None = None
    """Stiffness along the axis [N/m]."""
    radial_damping_Nspm: NotNegative | None = None
    """Strut: damping across its axis [N s/m]."""
    axial_damping_Nspm: NotNegative | None = None
    """Damping along the axis [N s/m]."""
    rod_mass_kg: Positive | None = None
    """Damper: mass of piston and rod [kg]."""


@dataclass(frozen=True)
class AxleTable:
    """Keys of an axle, with points of its left side."""

    type: str | None = None
    """Kind of suspension."""
    points: dict[str, Point] = field(default_factory=dict)
    """Hardpoints of the left side, in the table's units."""
    links: dict[str, LinkTable] = field(default_factory=dict)
    """Elasticity of the links."""
    tyre: str | None = None
    """Tyre file: a file in the folder of the table, or a name in models/tyres."""
    toe_rad: Annotated[float, Range(-0.1, 0.1)] | None = None
    """Static toe of one wheel, positive toe-in [rad]."""
    camber_rad: Annotated[float, Range(-0.2, 0.2)] | None = None
    """Static camber, negative with the top inwards [rad]."""
    spring_rate_Npm: Positive | None = None
    """Rate of the spring itself [N/m]."""
    wheel_rate_Npm: Positive | None = None
    """Change of wheel load per wheel travel, both wheels together, links included [N/m]."""
    ride_frequency_Hz: Positive | None = None
    """Natural frequency of the sprung mass of this axle on springs and tyres [Hz]."""
    spring_on: str | None = None
    """Carrier of the lower end of the spring."""
    damper_on: str | None = None
    """Carrier of the lower end of the damper."""
    spring_ratio: Annotated[float, Range(0.15, 1.6)] | None = None
    """Axle of curves: shortening of the spring per wheel travel."""
    damper_ratio: Annotated[float, Range(0.15, 1.6)] | None = None
    """Axle of curves: shortening of the damper, and of the stops, per wheel travel."""
    damper_velocity_mps: tuple[float, ...] | None = None
    """Compression velocities of the damper's curve [m/s]."""
    damper_force_N: tuple[float, ...] | None = None
    """Forces at these velocities, against the motion [N]."""
    damper_Nspm: Positive | None = None
    """Or: mean damping around rest [N s/m]. The curve has the shape of the compact's."""
    damping_ratio: Annotated[float, Range(0.01, 2.0)] | None = None
    """Or: damping ratio of the sprung mass of this axle on springs and tyres."""
    damper_friction_N: NotNegative | None = None
    """Dry friction of a damper [N]."""
    anti_roll_bar_Npm: NotNegative | None = None
    """Force at each wheel per difference of travel (at a strut: along it) [N/m]."""
    anti_roll_bar_Nmprad: NotNegative | None = None
    """Or: its contribution to the roll stiffness of the axle [N m/rad]."""
    bump_stop_m: Positive | None = None
    """Compression of the damper from the design position to the bump stop [m]."""
    rebound_stop_m: Positive | None = None
    """Extension of the damper to the rebound stop [m]."""
    stop_stiffness: tuple[float, ...] | None = None
    """a, b, c of the stops' force a x + b x2 + c x3, x < 0 in bump [N/m, N/m2, N/m3]."""
    wheel_mass_kg: Positive | None = None
    """Wheel with tyre, hub flange and all rotating parts [kg]."""
    wheel_spin_inertia_kgm2: Positive | None = None
    """Inertia of the wheel about its axle [kg m2]."""
    wheel_inertia_kgm2: Positive | None = None
    """Inertia of the wheel about a diameter [kg m2]."""
    knuckle_mass_kg: Positive | None = None
    """Knuckle with half of the links, spring and damper; in front with hub and brake [kg]."""
    knuckle_cg: Point | None = None
    """Centre of gravity of the knuckle, in the table's units."""
    knuckle_inertia_kgm2: tuple[float, ...] | None = None
    """Inertia of the knuckle about its centre of gravity, vehicle axes [kg m2]."""
    carrier_mass_kg: Positive | None = None
    """Rear axle: mass that steers with the wheel: carrier, hub, brake [kg]."""
    carrier_cg: Point | None = None
    """Centre of gravity of the carrier, in the table's units."""
    carrier_inertia_kgm2: tuple[float, ...] | None = None
    """Inertia of the carrier [kg m2]."""
    strut_mass_kg: Positive | None = None
    """McPherson: mass at the top mount that does not travel: piston rod, half of the spring [kg]."""
    strut_cg: Point | None = None
    """Centre of gravity of the strut, in the table's units."""
    strut_inertia_kgm2: tuple[float, ...] | None = None
    """Inertia of the strut [kg m2]."""
    top_mount: TopMountTable | None = None
    """Elasticity of the top mount. Default: as in the compact for a strut, rigid for a damper."""


@dataclass(frozen=True)
class MassTable:
    """Masses of the whole car with driver, or of the chassis only."""

    total_kg: Positive | None = None
    """Mass of the whole car [kg]."""
    front_fraction: Annotated[float, Range(0.2, 0.8)] | None = None
    """Fraction of the weight on the front wheels."""
    cg_height_m: Positive | None = None
    """Height of the centre of gravity of the whole car over the road [m]."""
    inertia_kgm2: tuple[float, ...] | None = None
    """Roll, pitch and yaw inertia of the whole car about its centre of gravity [kg m2]."""
    chassis_kg: Positive | None = None
    """Or: mass of the chassis with all parts outside the other bodies [kg]."""
    chassis_cg: Point | None = None
    """Centre of gravity of the chassis, in the table's units."""
    chassis_inertia_kgm2: tuple[float, ...] | None = None
    """Inertia of the chassis about its centre of gravity [kg m2]."""


@dataclass(frozen=True)
class SteeringTable:
    """Keys of the steering: rack and column."""

    ratio: Annotated[float, Range(1.0, 60.0)] | None = None
    """Steering wheel angle over mean road-wheel angle at the centre, unloaded."""
    pinion_radius_m: Positive | None = None
    """Or: rack travel per steering wheel angle [m/rad]."""
    rack_limit_m: Positive | None = None
    """Rack travel to either side [m]."""
    rack_mass_kg: Positive | None = None
    """Rack and half of the tie rods [kg]."""
    rack_friction_N: NotNegative | None = None
    """Dry friction of the rack [N]."""
    column_stiffness_Npm: Positive | None = None
    """Stiffness of torsion bar and assist, at the rack [N/m]."""


@dataclass(frozen=True)
class RearSteeringTable:
    """Hinge between rear knuckle and carrier, required even in a car without rear steering."""

    axis_lower: Point | None = None
    """A point of the steering axis on the left side, in the table's units."""
    axis_upper: Point | None = None
    """A higher point of the axis."""
    limit_rad: Annotated[float, Range(1e-3, 0.3)] | None = None
    """Angle of the mechanical stop [rad]."""
    stiffness_Nmprad: Annotated[float, Range(1e4, 1e8)] | None = None
    """Stiffness of screw, housing and carrier bushings about the axis [N m/rad]."""


@dataclass(frozen=True)
class CarTable:
    """Keys of a table of hardpoints."""

    units: str = "m"
    """Unit of all points: m or mm."""
    origin: Point = (0.0, 0.0, 0.0)
    """Point on the road below the middle of the front axle, in the table's own coordinates."""
    source: str = ""
    """Source of the numbers, for the README."""
    width_m: Annotated[float, Range(0.5, 4.0)] | None = None
    """Width of the body without mirrors [m]."""
    front: AxleTable = AxleTable()
    rear: AxleTable = AxleTable()
    mass: MassTable = MassTable()
    steering: SteeringTable = SteeringTable()
    rear_steering: RearSteeringTable = RearSteeringTable()
    brakes: Brakes | None = None
    powertrain: Powertrain | None = None
    aerodynamics: Aerodynamics | None = None
    rear_actuator: RearActuator | None = None
    """Actuator of the rear wheels. Default: the hinges of the model."""
    superposition_actuator: SuperpositionActuator | None = None
    """Actuator of the superposition. Default: the servo of the model."""
    motors: Motors | None = None
    """Electric motors on wheels or axles. Default: none."""
    battery: Battery | None = None
    """Battery of the motors. Default: without limits."""
    sensors: Sensors | None = None
    """Sensors of the controllers. Default: ideal sensors."""

    def axle(self, name: str) -> AxleTable:
        """Return the axle `front` or `rear`."""
        return self.front if name == "front" else self.rear


POINT_FIELDS: Final = {"knuckle_cg", "carrier_cg", "strut_cg", "chassis_cg", "axis_lower", "axis_upper"}


def read_table(path: Path) -> tuple[CarTable, Source]:
    """Read a table, and check it as far as possible without other files."""
    if path.suffix.lower() == ".csv":
        raw, source = _read_csv(path)
    elif path.suffix.lower() == ".toml":
        raw, source = read_toml(path)
    else:
        raise ParameterError("a table ends in .toml or .csv", file=str(path))
    table = build(CarTable, raw, source)
    if table.units not in UNITS:
        raise source.fail(("units",), f"{table.units!r} is not a unit of length; {nearest_names(table.units, UNITS)}")
    return table, source


def _read_csv(path: Path) -> tuple[dict[str, Any], Source]:
    axle_keys = {item.name for item in dataclasses.fields(AxleTable)} | {"toe_deg", "camber_deg"}
    raw: dict[str, Any] = {}
    lines: list[str] = []
    for number, cells in read_csv(path, ParameterError):
        while not cells[-1]:
            cells.pop()
        lines += [""] * (number - len(lines))
        if cells[0].lower() in ("name", "key") and not raw:
            continue
        if len(cells) < 2:
            why = "has no value; a line of a .csv file is KEY, VALUE"
            if "=" in cells[0]:
                why += ", and a table with lines KEY = VALUE needs the ending .toml"
            raise ParameterError(why, file=path.name, line=number, key=cells[0])
        keys = cells[0].split(".")
        if len(keys) == 2 and keys[0] in ("front", "rear") and keys[1] not in axle_keys:
            keys = [keys[0], "points", keys[1]]
        lines[-1] = f"{'.'.join(keys)} ="
        values = [_value(cell) for cell in cells[1:]]
        within = raw
        for key in keys[:-1]:
            within = within.setdefault(key, {}) if isinstance(within, dict) else within
        if not isinstance(within, dict) or keys[-1] in within:
            raise ParameterError("is given twice", file=path.name, line=number, key=cells[0])
        within[keys[-1]] = values[0] if len(values) == 1 else values
    return raw, Source(path.name, "\n".join(lines))


def _value(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


def chosen_kinds(table: CarTable, front: str | None = None, rear: str | None = None) -> dict[str, AxleKind]:
    """Return the suspension of each axle: from the argument, the table or the default."""
    chosen = {"front": front, "rear": rear}
    return {axle: kind_of(axle, chosen[axle] or table.axle(axle).type or DEFAULTS[axle]) for axle in ("front", "rear")}


def in_vehicle_axes(table: CarTable) -> CarTable:
    """Return the table with all points in metres and vehicle coordinates."""
    factor = known_unit(table.units).factor

    def moved(point: Point) -> Point:
        return tuple(factor * (value - origin) for value, origin in zip(point, table.origin, strict=True))

    def converted(part: Any) -> Any:
        changes: dict[str, Any] = {
            name: moved(point) for name in POINT_FIELDS if (point := getattr(part, name, None)) is not None
        }
        if isinstance(part, AxleTable):
            changes["points"] = {name: moved(point) for name, point in part.points.items()}
        return dataclasses.replace(part, **changes)

    parts = {name: converted(getattr(table, name)) for name in ("front", "rear", "mass", "rear_steering")}
    return dataclasses.replace(table, units="m", origin=(0.0, 0.0, 0.0), **parts)


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
"""Lowest and highest value of a road car by key, and a unit that users may have used by mistake, with its factor."""


_ONE_OF: Final = (
    ("spring_rate_Npm", "wheel_rate_Npm", "ride_frequency_Hz"),
    ("damper_force_N", "damper_Nspm", "damping_ratio"),
    ("anti_roll_bar_Npm", "anti_roll_bar_Nmprad"),
    ("stiffness_Npm", "bushings_Npm", "bushing"),
    ("ratio", "pinion_radius_m"),
)
"""Keys of a part of which one is enough."""
_TOGETHER: Final = (("damper_velocity_mps", "damper_force_N"), ("axis_lower", "axis_upper"))
"""Keys of a part that belong together."""


def check_points(table: CarTable, kinds: Mapping[str, AxleKind], source: Source) -> None:
    """Check names, number and units of all points, and units of other values."""
    problems = [
        *_name_problems(table, kinds),
        *_contradictions(table),
        *_length_problems(table),
        *_unit_problems(table),
        *_side_problems(table),
    ]
    if problems:
        head = f"{source.name}: {len(problems)} error{'s' * (len(problems) != 1)}:"
        raise ParameterError("\n  ".join([head, *problems]))


def _contradictions(table: CarTable) -> Iterator[str]:
    parts = {name: getattr(table, name) for name in ("front", "rear", "steering", "rear_steering")}
    for axle in ("front", "rear"):
        parts |= {f"{axle}.links.{name}": link for name, link in table.axle(axle).links.items()}
    for path, part in parts.items():
        given = {key for group in (*_ONE_OF, *_TOGETHER) for key in group if getattr(part, key, None) is not None}
        for group in _ONE_OF:
            if len(ways := [way for way in group if way in given]) > 1:
                yield f"{path}: {' and '.join(ways)} have the same meaning; give one of them"
        for group in _TOGETHER:
            if len(given.intersection(group)) == 1:
                yield f"{path}: {' and '.join(group)} belong together; give both"
    mass = table.mass
    if (mass.total_kg is None) == (mass.chassis_kg is None):
        yield "mass: either total_kg (of the whole car) or chassis_kg is needed"
    if mass.total_kg is not None and (mass.front_fraction is None or mass.cg_height_m is None):
        yield "mass: with total_kg, front_fraction and cg_height_m are needed"
    if mass.chassis_kg is not None and mass.chassis_cg is None:
        yield "mass: with chassis_kg, chassis_cg is needed"


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
                yield f"{axle}.{key.replace('_rad', '_deg')}: an axle of curves takes it from the measurements"
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
                yield f"{path}: {value:g} is not a value of a road car ({low:g} to {high:g}){hint}"


def _side_problems(table: CarTable) -> Iterator[str]:
    points = {key: point for key, point in all_points(table) if len(point) == len(table.origin) == 3}
    wrong = [key for key, (_, y, _) in points.items() if not key.startswith("mass.") and y <= table.origin[1]]
    if wrong:
        more = f" and {len(wrong) - 6} more" if len(wrong) > 6 else ""
        example = f"y of {wrong[0]} is {points[wrong[0]][1]:g}"
        yield (
            f"{', '.join(wrong[:6])}{more}: not on the left side, where y is above {table.origin[1]:g} "
            f"{table.units}; {example}"
        )


def _numbers(part: Any, path: str = "") -> Iterator[tuple[str, float]]:
    if dataclasses.is_dataclass(part):
        for item in dataclasses.fields(part):
            yield from _numbers(getattr(part, item.name), f"{path}.{item.name}" if path else item.name)
    elif isinstance(part, dict):
        for key, value in part.items():
            yield from _numbers(value, f"{path}.{key}")
    elif isinstance(part, float) and math.isfinite(part):
        yield path, part

"""A complete car: values from its table, and assumed values."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import mujoco
import numpy as np

from activesteer.config import to_table
from activesteer.core.conventions import Array
from activesteer.core.units import unit_of
from activesteer.errors import ParameterError
from activesteer.sensors.parameters import Sensors
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle.brakes.records import Brakes
from activesteer.vehicle.electric_actuators import Battery, Motors, RearActuator, SuperpositionActuator
from activesteer.vehicle.parameters import Aerodynamics, Powertrain
from activesteer.vehicle.statics import mass_properties, point_mass_inertia
from activesteer.vehicle_builder.axle_kinds import AxleKind, LinkKind, Mount
from activesteer.vehicle_builder.kc_fit import MeasuredAxle
from activesteer.vehicle_builder.table import AxleTable, CarTable


@dataclass(frozen=True)
class Assumption:
    """A value that the table does not give."""

    key: str
    value: str
    rule: str


@dataclass(frozen=True)
class Solid:
    """Mass properties in vehicle axes [kg, m, kg m2]."""

    mass_kg: float
    cg_m: Array
    inertia_kgm2: Array


@dataclass(frozen=True)
class TopMount:
    """Top mount of a strut or damper in the frame of the left side."""

    directions: dict[str, Array]  # unit vector of each slide, vehicle axes: upwards, forward, to the left
    stiffness_Npm: dict[str, float]
    damping_Nspm: dict[str, float]
    rod: Solid | None  # piston and rod of a damper; None for a strut, which has its own body


@dataclass
class Axle:
    """An axle that is complete except for the trim."""

    name: str
    kind: AxleKind
    points: dict[str, Array]
    links: tuple[LinkKind, ...]
    table: AxleTable
    tyre: str
    tyre_parameters: TyreParameters
    toe_rad: float
    camber_rad: float
    wheel_mass_kg: float
    wheel_spin_inertia_kgm2: float
    wheel_inertia_kgm2: float
    knuckle: Solid
    strut: Solid | None
    carrier: Solid | None
    spring: Mount
    damper: Mount
    top_mount: TopMount | None  # elasticity of the top mount, or None if it is rigid
    anti_roll_bar_Npm: float
    measured: MeasuredAxle | None  # measurements that an axle of curves has to match
    ride_frequency_Hz: float | None
    damping_ratio: float | None

    @property
    def corner(self) -> str:
        """Name of the left corner."""
        return f"{self.name[0]}l"

    @property
    def wheel_centre_m(self) -> Array:
        """Position of the left wheel centre."""
        return self.points["wheel_centre"]

    @property
    def radius_m(self) -> float:
        """Unloaded radius of the tyre."""
        return float(self.tyre_parameters["UNLOADED_RADIUS"])


@dataclass
class CarDesign:
    """A car that is complete except for the trim."""

    name: str
    table: CarTable
    front: Axle
    rear: Axle
    width_m: float
    rack_mass_kg: float
    rack_limit_m: float
    rack_friction_N: float
    rack_sign: float  # -1 if the rack moves to the right to steer left (tie rods behind the steering axis), else 1
    column_stiffness_Npm: float
    kingpin_m: tuple[Array, Array]
    rear_limit_rad: float
    rear_stiffness_Nmprad: float
    brakes: Brakes
    powertrain: Powertrain
    aerodynamics: Aerodynamics
    assumptions: list[Assumption] = field(default_factory=list)

    @property
    def axles(self) -> tuple[Axle, Axle]:
        """The front and the rear axle."""
        return self.front, self.rear

    @property
    def questions(self) -> tuple[str, ...]:
        """Questions about unusual measurements."""
        return tuple(line for axle in self.axles if axle.measured is not None for line in axle.measured.questions)

    @property
    def wheelbase_m(self) -> float:
        """Distance of the wheel centres of front and rear axle."""
        return float(self.front.wheel_centre_m[0] - self.rear.wheel_centre_m[0])


class Log:
    """Log of assumptions."""

    def __init__(self) -> None:
        self.assumptions: list[Assumption] = []

    def take(self, path: str, part: Any, name: str, default: float, rule: str) -> float:
        """Return a value from the table, or the default with an entry in the log."""
        if (given := getattr(part, name)) is not None:
            return given
        self.note(f"{path}.{name}" if path else name, f"{default:.4g} {unit_of(name)}".strip(), rule)
        return default

    def angle(self, key: str, given_rad: float | None, default_deg: float, rule: str) -> float:
        """Return an angle from the table, or the default with an entry in the log [rad]."""
        if given_rad is None:
            self.note(key, f"{default_deg:g} deg", rule)
        return math.radians(default_deg) if given_rad is None else given_rad

    def note(self, key: str, value: str, rule: str) -> None:
        """Add an assumption."""
        self.assumptions.append(Assumption(key, value, rule))


def chassis_of(car: CarDesign, model: mujoco.MjModel, log: Log) -> Solid:
    """Return the chassis from the table, or the whole car minus all other bodies."""
    table, others = car.table.mass, mass_properties(model, without=["chassis"])
    base = car.wheelbase_m
    if table.chassis_kg is not None and table.chassis_cg is not None:
        inertia = table.chassis_inertia_kgm2
        if inertia is None:
            inertia = _usual_inertia(table.chassis_kg, base, car, 0.5)
            log.note("mass.chassis_inertia_kgm2", _words(inertia), _INERTIA_RULE)
        return Solid(table.chassis_kg, np.array(table.chassis_cg), np.array(inertia))
    assert table.total_kg is not None
    assert table.front_fraction is not None
    assert table.cg_height_m is not None
    mass = table.total_kg - others.mass_kg
    # The weights act on the contact points, below the wheel centres.
    rear, front = car.rear.wheel_centre_m[0], car.front.wheel_centre_m[0]
    cg = np.array([float(rear + table.front_fraction * (front - rear)), 0.0, table.cg_height_m])
    if mass < 0.3 * table.total_kg:
        raise ParameterError(
            f"is {table.total_kg:.0f} kg, but wheels, knuckles and rack have {others.mass_kg:.0f} kg of it; at most "
            f"{0.7 * table.total_kg:.0f} kg is allowed",
            key="mass.total_kg",
        )
    chassis_cg = (table.total_kg * cg - others.mass_kg * others.cg_m) / mass
    chassis_cg[1] = 0.0
    inertia = table.inertia_kgm2
    if inertia is None:
        inertia = _usual_inertia(table.total_kg, base, car, table.front_fraction)
        log.note("mass.inertia_kgm2", _words(inertia), _INERTIA_RULE)
    left = np.diag(np.array(inertia)).astype(float) - others.inertia_kgm2
    left -= others.mass_kg * point_mass_inertia(others.cg_m - cg) + mass * point_mass_inertia(chassis_cg - cg)
    own = np.diag(left)
    if own.min() <= 0.0 or 2.0 * own.max() > own.sum():
        raise ParameterError(
            f"of the {_words(inertia)} kg m2 of the whole car, {_words(own)} remain for the chassis "
            "without wheels and suspensions; each of the three can be at most the sum of the others",
            key="mass.inertia_kgm2",
        )
    return Solid(mass, chassis_cg, own)


_INERTIA_RULE = (
    "yaw 0.91 m l_f l_r, pitch 0.95 of yaw, roll with a radius of gyration of 0.4 of the track: the compact's"
)


def _usual_inertia(mass: float, base: float, car: CarDesign, front_fraction: float) -> tuple[float, float, float]:
    to_front = (1.0 - front_fraction) * base
    yaw = 0.915 * mass * to_front * (base - to_front)
    track = car.front.wheel_centre_m[1] + car.rear.wheel_centre_m[1]
    return round(mass * (0.4 * track) ** 2, 1), round(0.95 * yaw, 1), round(yaw, 1)


def _words(values: tuple[float, ...] | Array) -> str:
    return ", ".join(f"{value:.1f}" for value in values)


_DIGITS: Final = 7


def hardware_tables(part: Any) -> dict[str, Any]:
    """Return the given tables of actuators, motors, battery and sensors."""
    tables = {
        "rear_actuator": to_table(part.rear_actuator or RearActuator(), defaults=False),
        "superposition_actuator": to_table(part.superposition_actuator or SuperpositionActuator(), defaults=False),
        "motors": to_table(part.motors or Motors(), defaults=False),
        "battery": to_table(part.battery or Battery(), defaults=False),
        "sensors": _sensors(part.sensors or Sensors()),
    }
    return {name: in_degrees(table) for name, table in tables.items() if table}


def in_degrees(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table with angles in degrees, rounded for readers."""
    result = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            result[key] = in_degrees(value)
        elif key.endswith("_rad"):
            result[key.removesuffix("_rad") + "_deg"] = _each(value, math.degrees)
        else:
            result[key] = _each(value, lambda one: one)
    return result


def _each(value: Any, change: Callable[[float], float]) -> Any:
    if isinstance(value, (list, tuple)):
        return [_each(one, change) for one in value]
    return float(f"{change(value):.{_DIGITS}g}") if isinstance(value, float) else value


def _sensors(sensors: Sensors) -> dict[str, Any]:
    """Return the values that differ from the preset, which fills in all others."""
    table, filled = (to_table(one, defaults=False) for one in (sensors, Sensors(preset=sensors.preset)))
    given = {"preset": sensors.preset} if sensors.preset != Sensors.preset else {}
    for key, value in table.items():
        preset = filled.get(key)
        if isinstance(value, Mapping):
            differing = {name: one for name, one in value.items() if one != (preset or {}).get(name)}
            given |= {key: differing} if differing else {}
        elif value != preset:
            given[key] = value
    return given

"""A complete car: values of the table, and values by rules, which are kept."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from activesteer.brakes.parameters import Brakes
from activesteer.conventions import Array
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle.parameters import Aerodynamics, Powertrain
from activesteer.vehicle_builder.axle_kinds import AxleKind
from activesteer.vehicle_builder.kc_fit import MeasuredAxle
from activesteer.vehicle_builder.levers import Mount
from activesteer.vehicle_builder.table import AxleTable, CarTable


@dataclass(frozen=True)
class Assumption:
    """A value that the table does not give."""

    key: str
    value: str
    rule: str


@dataclass(frozen=True)
class Solid:
    """Mass, centre of gravity and inertia about it in vehicle axes [kg, m, kg m2]."""

    mass_kg: float
    cg_m: Array
    inertia_kgm2: Array


@dataclass(frozen=True)
class Link:
    """A link of the left side."""

    name: str
    inner: str
    outer: str
    stiffness_Npm: float
    hardening_Npm3: float
    damping_Nspm: float
    remark: str


@dataclass(frozen=True)
class TopMount:
    """The top mount of a strut or damper.

    Attributes:
        directions: Unit vector of each slide of the left side, vehicle axes: `z` along the axis, upwards; a strut also
            has `x` and `y` across it, forward and to the left.
        stiffness_Npm: Stiffness of each slide [N/m].
        damping_Nspm: Damping of each slide [N s/m].
        rod: Piston and rod of a damper; None for a strut, which has a body of its own.
    """

    directions: dict[str, Array]
    stiffness_Npm: dict[str, float]
    damping_Nspm: dict[str, float]
    rod: Solid | None


@dataclass
class Axle:
    """An axle, complete but for the trim."""

    name: str
    kind: AxleKind
    points: dict[str, Array]
    links: tuple[Link, ...]
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
    top_mount: TopMount | None
    """Elasticity of the top mount; None if it is rigid."""
    anti_roll_bar_Npm: float
    measured: MeasuredAxle | None
    """Measurements that an axle of curves has to match."""
    ride_frequency_Hz: float | None
    damping_ratio: float | None

    @property
    def corner(self) -> str:
        """Name of the left corner."""
        return f"{self.name[0]}l"

    @property
    def wheel_centre_m(self) -> Array:
        """Left wheel centre."""
        return self.points["wheel_centre"]

    @property
    def radius_m(self) -> float:
        """Unloaded radius of the tyre."""
        return float(self.tyre_parameters["UNLOADED_RADIUS"])


@dataclass
class Car:
    """A car, complete but for the trim."""

    name: str
    table: CarTable
    front: Axle
    rear: Axle
    width_m: float
    rack_mass_kg: float
    rack_limit_m: float
    rack_friction_N: float
    rack_sign: float
    """-1 if the rack moves to the right to steer left (tie rods behind the steering axis), else 1."""
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
        """Front and rear axle."""
        return self.front, self.rear

    @property
    def questions(self) -> tuple[str, ...]:
        """Unusual measurements."""
        return tuple(line for axle in self.axles if axle.measured is not None for line in axle.measured.questions)

    @property
    def wheelbase_m(self) -> float:
        """Distance of the wheel centres of front and rear axle."""
        return float(self.front.wheel_centre_m[0] - self.rear.wheel_centre_m[0])


class Log:
    """Log of the assumptions."""

    def __init__(self) -> None:
        self.assumptions: list[Assumption] = []

    def take(self, key: str, given: float | None, default: float, rule: str, unit: str = "") -> float:
        """Return the given value, or the default, which is then noted."""
        if given is not None:
            return given
        self.note(key, f"{default:.4g} {unit}".strip(), rule)
        return default

    def angle(self, key: str, given_rad: float | None, default_deg: float, rule: str) -> float:
        """Return the given angle, or the default in degrees, which is then noted [rad]."""
        if given_rad is None:
            self.note(key, f"{default_deg:g} deg", rule)
        return math.radians(default_deg) if given_rad is None else given_rad

    def note(self, key: str, value: str, rule: str) -> None:
        """Note an assumption."""
        self.assumptions.append(Assumption(key, value, rule))

"""Completion of a car with values from published proportions.

The engine's step is implicit in the stiffness of tendons, so the bushings are tendons along the slides, like all other
springs of a car.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.core.conventions import Array
from activesteer.core.units import known_unit
from activesteer.errors import ParameterError, nearest_names
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle.brakes.records import Brakes
from activesteer.vehicle.electric_actuators import Motors
from activesteer.vehicle.parameters import Aerodynamics, Powertrain
from activesteer.vehicle_builder.axle_kinds import AxleKind, LinkKind, Mount, mount
from activesteer.vehicle_builder.design import Axle, CarDesign, Log, Solid, TopMount
from activesteer.vehicle_builder.kc_fit import MeasuredAxle, measured_axle
from activesteer.vehicle_builder.kc_tables import KcTables
from activesteer.vehicle_builder.table import AxleTable, CarTable, LinkTable, TopMountTable


def rack_sign(front: Axle) -> float:
    """Return the sign of the rack's y for steering to the left."""
    if front.kind.guided:
        return -1.0
    return math.copysign(1.0, _rack_per_steer(front))


def _rack_per_steer(front: Axle) -> float:
    """Return the rack travel to the left per steer angle of the left wheel, for rigid links [m/rad]."""
    # The steering axis without elasticity.
    lower, upper = front.points["lca_outer"], front.points["strut_top" if front.kind.strut else "uca_outer"]
    inner, outer = front.points["tie_rod_inner"], front.points["tie_rod_outer"]
    along = (upper - lower) / np.linalg.norm(upper - lower)
    rod = outer - inner
    if abs(rod[1]) < 1e-3:
        raise ParameterError(
            "the tie rod does not run across the car: tie_rod_inner and tie_rod_outer have the same y", key="front"
        )
    moved = np.cross(along, outer - lower)
    per_steer = float(rod @ moved / rod[1])
    if abs(per_steer) < 0.02:
        raise ParameterError(
            f"the tie rod passes the steering axis at {1e3 * abs(per_steer):.0f} mm and cannot steer the wheel; "
            "tie_rod_outer must be ahead of or behind the line through the upper and the lower joint",
            key="front",
        )
    return per_steer


def rack_per_steer_m(front: Axle) -> float:
    """Return the magnitude of the rack travel per steer angle about straight ahead, for rigid links [m/rad]."""
    if front.measured is not None:
        rack, steer = front.measured.curves.rack_m, front.measured.curves.rack_steer_rad
        near = np.argsort(np.abs(rack))[:5]
        return 1.0 / float(np.polyfit(np.array(rack)[near], np.array(steer)[near], 1)[0])
    return abs(_rack_per_steer(front))


def rack_limit_m(front: Axle) -> float:
    """Return the travel of the rack to its stops [m]."""
    if front.measured is not None:
        return min(-front.measured.curves.rack_m[0], front.measured.curves.rack_m[-1])
    return round(0.92 * rack_per_steer_m(front) * math.sin(math.radians(36.0)), 4)


_RADIAL_NPM, _AXIAL_NPM = 3e5, 1.2e6
_DAMPING_S = 1e-3
"""Damping per stiffness: a loss factor of 0.09 at the 15 Hz of a wheel, as rubber has."""
_ROD_KG = 1.2
_ROD_INERTIA_KGM2 = (0.008, 0.008, 0.0006)
_BELOW_MOUNT_M = 0.07


def top_mount(
    axle: str, table: TopMountTable | None, kind: AxleKind, points: dict[str, Array], damper: Mount, log: Log
) -> TopMount | None:
    """Complete the top mount of an axle, or return None for a rigid mount."""
    if table is None and not kind.strut:
        return None
    key, table = f"{axle}.top_mount", table or TopMountTable()
    if kind.strut:
        upper, lower = points["strut_top"], points["strut_bottom"]
    elif damper.start_m is None or damper.lever != 1.0:
        raise ParameterError(f"a damper on {damper.carrier} has no rod in the model; leave the key out", key=key)
    else:
        upper, lower = points["damper_inner"], points["damper_outer"]
    along = (upper - lower) / np.linalg.norm(upper - lower)
    axial = log.take(key, table, "axial_Npm", _AXIAL_NPM, "as in the compact")
    directions, stiffness, rod = {"z": along}, {"z": axial}, None
    if kind.strut:
        if table.rod_mass_kg is not None:
            raise ParameterError(f"a strut has {axle}.strut_mass_kg instead", key=f"{key}.rod_mass_kg")
        radial = log.take(key, table, "radial_Npm", _RADIAL_NPM, "as in the compact")
        forward = np.array([1.0, 0.0, 0.0]) - along[0] * along
        forward /= np.linalg.norm(forward)
        directions = {"x": forward, "y": np.cross(along, forward), "z": along}
        stiffness = {"x": radial, "y": radial, "z": axial}
    else:
        for name in ("radial_Npm", "radial_damping_Nspm"):
            if getattr(table, name) is not None:
                raise ParameterError("a damper between two joints has no force across its axis", key=f"{key}.{name}")
        kg = log.take(key, table, "rod_mass_kg", _ROD_KG, "piston and rod")
        rod = Solid(kg, upper - _BELOW_MOUNT_M * along, np.array(_ROD_INERTIA_KGM2) * kg / _ROD_KG)
    damping = {}
    for name, value in stiffness.items():
        given = table.axial_damping_Nspm if name == "z" else table.radial_damping_Nspm
        damping[name] = _DAMPING_S * value if given is None else given
    return TopMount(directions, stiffness, damping, rod)


DEFAULT_TYRE: Final = "compact_205_55R16.tir"
BUSHINGS_NPM: Final = {"ball_joint": 1e8, "hard": 1e7, "medium": 1e6, "soft": 3e5}
"""Radial stiffness of one bushing by class [N/m]. Classes of pysuspension's guide to joint types, with `soft` raised
from 1e5, which lets a wheel move by 10 mm under 1 kN."""
_DAMPING: Final = ((3e6, 3000.0), (6e5, 2000.0), (0.0, 1500.0))
"""Smallest stiffness of a link for this damping [N/m, N s/m]: 10 to 35 % of critical, as in the compact."""


_SERVO_NMPRAD: Final = 1e5
"""Stiffness of the rear steering of the compact [N m/rad]."""
_DRAWN: Final = {
    "spring_inner": (0.0, -0.16, 0.45), "spring_outer": (0.0, -0.12, 0.05), "damper_inner": (-0.06, -0.16, 0.5),
    "damper_outer": (-0.06, -0.12, 0.0), "tie_rod_inner": (-0.13, -0.4, -0.04),
}  # fmt: skip
"""Points from the wheel centre for the drawing of an axle of curves, which has no points [m]."""


def complete(
    name: str,
    table: CarTable,
    kinds: dict[str, AxleKind],
    tyres: dict[str, tuple[str, TyreParameters]],
    log: Log,
    tables: KcTables | None = None,
) -> CarDesign:
    """Return the complete car of a table, with rules for the missing values."""
    steering, brakes = table.steering, table.brakes
    column_Npm = log.take("steering", steering, "column_stiffness_Npm", 4e6, "the compact's: torsion bar and assist")
    servo_Nmprad = table.rear_steering.stiffness_Nmprad or _SERVO_NMPRAD
    kingpin_m = _kingpin(table, np.array(table.rear.points["wheel_centre"]), log)
    front, rear = (
        _axle(axle, table.axle(axle), kinds[axle], *tyres[axle], log, (tables, kingpin_m, (column_Npm, servo_Nmprad)))
        for axle in ("front", "rear")
    )
    if brakes is None:
        brakes = Brakes(front_torque_Nm=2200.0, rear_torque_Nm=700.0, drag_torque_Nm=1.5)
        log.note("brakes", "2200 and 700 N m per wheel", "the compact's: 1.35 g of a car of 1430 kg, 76 % in front")
    powertrain = table.powertrain
    if powertrain is None and table.motors is not None:
        powertrain = pedal_of(table.motors)
        log.note("powertrain", "all of the motors' torque and power; 15 % of the torque on release", "a usual pedal")
    if powertrain is None:
        powertrain = Powertrain(
            front_fraction=1.0, max_torque_Nm=3170.0, max_power_W=101e3, engine_brake_torque_Nm=345.0, inertia_kgm2=3.7
        )
        log.note("powertrain", "front-wheel drive, 101 kW and 3170 N m at the wheels", "the compact's")
    aero = table.aerodynamics
    if aero is None:
        middle = 0.5 * float(front.wheel_centre_m[0] + rear.wheel_centre_m[0])
        aero = Aerodynamics(drag_area_m2=0.65, pressure_point_m=(round(middle, 3), 0.0, 0.6))
        log.note("aerodynamics", "0.65 m2", "a car of the compact's class; acts between the axles, 0.6 m high")
    track = 2.0 * max(front.wheel_centre_m[1], rear.wheel_centre_m[1])
    return CarDesign(
        name,
        table,
        front,
        rear,
        log.take("", table, "width_m", round(float(track) + 0.27, 2), "largest track + 0.27 m"),
        log.take("steering", steering, "rack_mass_kg", 3.0, "rack bar and half of the tie rods"),
        log.take("steering", steering, "rack_limit_m", rack_limit_m(front), "36 deg of steer angle"),
        log.take("steering", steering, "rack_friction_N", 150.0, "the compact's, electric assist"),
        rack_sign(front),
        column_Npm,
        kingpin_m,
        log.angle("rear_steering.limit_deg", table.rear_steering.limit_rad, 3.0, "the compact's"),
        servo_Nmprad,
        brakes,
        powertrain,
        aero,
        log.assumptions,
    )  # fmt: skip


def pedal_of(motors: Motors) -> Powertrain:
    """Return a powertrain that demands the full torque of the motors at full pedal."""
    front_Nm, rear_Nm = (sum(motor.wheel_torque_Nm for motor in motors.on(axle)) for axle in ("front", "rear"))
    return Powertrain(
        front_fraction=round(front_Nm / (front_Nm + rear_Nm), 3),
        max_torque_Nm=front_Nm + rear_Nm,
        max_power_W=round(sum(motor.power_W for _, motor in motors), 1),
        engine_brake_torque_Nm=round(0.15 * (front_Nm + rear_Nm), 1),
        max_wheel_speed_radps=round(min(motor.speed_radps[-1] / motor.gear_ratio for _, motor in motors), 2),
    )


def _axle(
    axle: str,
    table: AxleTable,
    kind: AxleKind,
    tyre: str,
    parameters: TyreParameters,
    log: Log,
    rig: tuple[KcTables | None, tuple[Array, Array], tuple[float, float]],
) -> Axle:
    points = {name: np.array(point) for name, point in table.points.items()}
    front = axle == "front"
    centre, radius = points["wheel_centre"], float(parameters["UNLOADED_RADIUS"])
    usual_kg, rule = round(18.5 * (radius / 0.316) ** 2, 1), "18.5 kg at a tyre radius of 0.316 m, as its square"
    wheel_kg = log.take(axle, table, "wheel_mass_kg", usual_kg, rule)
    if kind.guided:
        points |= {name: centre + np.array(beside) for name, beside in _DRAWN.items()}
    outer = np.mean([points[link.outer] for link in kind.links] or [points["damper_outer"]], axis=0)
    knuckle = _solid(
        axle, "knuckle", table, (20.5 if kind.strut else 18.0) if front else 12.5, 0.5 * (centre + outer),
        (0.3, 0.28, 0.16), 20.5, "between the wheel centre and the mean of the outer points", log,
    )  # fmt: skip
    strut = carrier = None
    if kind.strut:
        top, bottom = points["strut_top"], points["strut_bottom"]
        down = (bottom - top) / np.linalg.norm(bottom - top)
        inertia = (0.03, 0.03, 0.006)
        strut = _solid(axle, "strut", table, 3.0, top + 0.1 * down, inertia, 3.0, "0.1 m below the top mount", log)
    if not front:
        inside, inertia = centre - np.array([0.0, 0.04, 0.0]), (0.04, 0.05, 0.04)
        carrier = _solid(axle, "carrier", table, 6.0, inside, inertia, 6.0, "40 mm inside the wheel centre", log)
    spin, across = (
        log.take(axle, table, key, wheel_kg * (of * radius) ** 2, f"radius of gyration {of} of the tyre's radius")
        for key, of in (("wheel_spin_inertia_kgm2", 0.736), ("wheel_inertia_kgm2", 0.56))
    )
    if spin > 2.0 * across:
        raise ParameterError(
            f"is {spin:.3g} and wheel_inertia_kgm2, about a diameter, {across:.3g} kg m2; the former can be at most "
            "twice the latter",
            key=f"{axle}.wheel_spin_inertia_kgm2",
            value=spin,
        )
    measured = None
    if kind.guided and rig[0] is not None:
        measured = measured_axle(axle, rig[0], centre, rig[1], rig[2])
    toe, camber = (0.05, -0.5) if front else (0.1, -1.0)
    spring_on = table.spring_on
    if spring_on is None:
        spring_on = kind.spring_on
        if not kind.strut and not kind.guided:
            log.note(f"{axle}.spring_on", spring_on, f"usual for a {kind.name} axle")
    damper_on = table.damper_on or spring_on
    if table.damper_on is None and not kind.strut and not kind.guided:
        log.note(f"{axle}.damper_on", damper_on, "as the spring")
    frequency = table.ride_frequency_Hz
    rate = measured.wheel_rate_Npm if measured is not None else None
    if rate is table.spring_rate_Npm is table.wheel_rate_Npm is frequency is None:
        frequency = 1.2 if front else 1.4
        log.note(f"{axle}.ride_frequency_Hz", f"{frequency:g} Hz", "passenger car; the rear faster, against pitch")
    damping = table.damping_ratio
    if damping is None and table.damper_Nspm is None and table.damper_force_N is None:
        damping = 0.28
        log.note(f"{axle}.damping_ratio", "0.28", "passenger car; curve of the compact's shape, rebound twice bump")
    return Axle(
        axle,
        kind,
        points,
        tuple(_link(axle, link, table.links.get(link.name, LinkTable()), log) for link in kind.links),
        table,
        tyre,
        parameters,
        0.0 if measured else log.angle(f"{axle}.toe_deg", table.toe_rad, toe, "passenger car, toe-in"),
        0.0 if measured else log.angle(f"{axle}.camber_deg", table.camber_rad, camber, "passenger car"),
        wheel_kg,
        spin,
        across,
        knuckle,
        strut,
        carrier,
        mount(axle, "spring", spring_on, kind, points, table.spring_ratio or 1.0),
        damper := mount(axle, "damper", damper_on, kind, points, _damper_ratio(axle, table, measured, log)),
        top_mount(axle, table.top_mount, kind, points, damper, log),
        _anti_roll_bar(axle, table, measured, float(centre[1]), log),
        measured,
        frequency,
        damping,
    )  # fmt: skip


def _solid(
    axle: str,
    part: str,
    table: AxleTable,
    default_kg: float,
    default_cg: Array,
    default_inertia: tuple[float, ...],
    of_kg: float,
    where: str,
    log: Log,
) -> Solid:
    """Return the mass properties of one part, with inertia in proportion to mass if missing."""
    key = f"{axle}.{part}"
    cg, inertia = (getattr(table, f"{part}_{name}") for name in ("cg", "inertia_kgm2"))
    kg = log.take(axle, table, f"{part}_mass_kg", default_kg, "a part of this kind in the compact's class")
    if cg is None:
        log.note(f"{key}_cg", " ".join(f"{value:.3f}" for value in default_cg) + " m", where)
    if inertia is None:
        inertia = tuple(float(f"{value * kg / of_kg:.3g}") for value in default_inertia)
        log.note(f"{key}_inertia_kgm2", " ".join(f"{value:g}" for value in inertia), "the compact's, in proportion")
    if min(inertia) <= 0.0 or 2.0 * max(inertia) > sum(inertia):
        raise ParameterError(f"{key}_inertia_kgm2: {list(inertia)} given; each can be at most the sum of the others")
    return Solid(kg, default_cg if cg is None else np.array(cg), np.array(inertia))


def _link(axle: str, kind: LinkKind, table: LinkTable, log: Log) -> LinkKind:
    key, hardening, remark = f"{axle}.links.{kind.name}", table.hardening_Npm3, "given"
    if table.stiffness_Npm is not None:
        stiffness = table.stiffness_Npm
    elif table.bushings_Npm is not None:
        one, two = table.bushings_Npm
        stiffness, remark = one * two / (one + two), f"two bushings of {one:g} and {two:g} N/m in series"
    elif table.bushing is not None:
        if table.bushing not in BUSHINGS_NPM:
            words = nearest_names(table.bushing, BUSHINGS_NPM)
            raise ParameterError(
                f"no class of bushings is named {table.bushing!r}; {words}",
                key=f"{key}.bushing",
                value=table.bushing,
            )
        stiffness, remark = 0.5 * BUSHINGS_NPM[table.bushing], f"two bushings of class {table.bushing}"
        log.note(f"{key}.stiffness_Npm", f"{stiffness:g} N/m", remark)
    else:
        stiffness, remark = kind.stiffness_Npm, f"assumed: {kind.reason}"
        hardening = kind.hardening_Npm3 if hardening is None else hardening
        cubic = f" + {hardening:g} N/m3" if hardening else ""
        log.note(key, f"{stiffness:g} N/m{cubic}, {kind.damping_Nspm:g} N s/m", kind.reason)
    damping = table.damping_Nspm
    if damping is None and table.stiffness_Npm is table.bushings_Npm is table.bushing is None:
        damping = kind.damping_Nspm
    elif damping is None:
        damping = next(value for minimum, value in _DAMPING if stiffness >= minimum)
        log.note(f"{key}.damping_Nspm", f"{damping:g} N s/m", "by stiffness, as in the compact")
    return LinkKind(kind.name, kind.inner, kind.outer, stiffness, hardening or 0.0, damping, remark)


def _damper_ratio(axle: str, table: AxleTable, measured: MeasuredAxle | None, log: Log) -> float:
    if measured is None:
        return 1.0
    if table.damper_ratio is None and measured.damper_ratio is not None:
        return measured.damper_ratio
    return log.take(axle, table, "damper_ratio", 1.0, "damper and stops as they act at the wheel")


def _anti_roll_bar(axle: str, table: AxleTable, measured: MeasuredAxle | None, half_track: float, log: Log) -> float:
    if table.anti_roll_bar_Nmprad is not None:
        # Both wheels carry k (z_l - z_r) = k t phi at an arm of t/2 each: K = k t2.
        return table.anti_roll_bar_Nmprad / (2.0 * half_track) ** 2
    if table.anti_roll_bar_Npm is None and measured is not None and measured.anti_roll_bar_Npm is not None:
        return measured.anti_roll_bar_Npm
    return log.take(axle, table, "anti_roll_bar_Npm", 0.0, "no anti-roll bar")


def _kingpin(table: CarTable, centre: Array, log: Log) -> tuple[Array, Array]:
    """Return the lower and the upper point of the rear steering axis."""
    lower, upper = table.rear_steering.axis_lower, table.rear_steering.axis_upper
    if lower is not None and upper is not None:
        return np.array(lower), np.array(upper)
    # The compact's: caster 2 deg, inclination 4 deg, 21 mm inside and 4 mm behind the wheel centre.
    first = centre + np.array([0.0, -0.013, -0.1129])
    second = centre + np.array([-0.008, -0.029, 0.1171])
    log.note("rear_steering", "caster 2 deg, inclination 4 deg", "the compact's axis relative to the wheel centre")
    return first, second


def check_origin(car: CarDesign, given: CarTable) -> None:
    """Check that the vehicle coordinates begin on the road below the front axle."""
    centre, radius = car.front.wheel_centre_m, car.front.radius_m
    if abs(centre[0]) > 0.05 or not 0.75 * radius < centre[2] < 1.15 * radius:
        off = np.array([centre[0], 0.0, centre[2] - 0.94 * radius]) / known_unit(given.units).factor
        say = ", ".join(f"{value:.4g}" for value in np.array(given.origin) + off)
        raise ParameterError(
            f"is at x {centre[0]:.3f} m, {centre[2]:.3f} m above the origin; vehicle coordinates begin on the road "
            f"below the front axle, and the tyre's radius is {radius:.3f} m. Give that point in the table's "
            f"coordinates: about origin = [{say}] ({given.units})",
            key="front.points.wheel_centre",
        )
    rear = car.rear.wheel_centre_m[0]
    if rear > -0.5:
        raise ParameterError(
            f"is at x {rear:.3f} m; x points forward, so the rear axle is at minus the wheelbase. Are the rear "
            "points relative to the rear axle?",
            key="rear.points.wheel_centre",
        )

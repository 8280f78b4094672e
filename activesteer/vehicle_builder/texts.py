"""Generated files of a built car: MJCF, vehicle file, README, and table of a measured car.

With the table, `activesteer vehicle new NAME --kc DIR` makes the same car again, with curves instead of links.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from activesteer.config import read_toml, to_table, toml_text
from activesteer.core.conventions import CORNERS, GRAVITY_MPS2, Array
from activesteer.resources import find_vehicle
from activesteer.rigs.kc.result import KcResult
from activesteer.scenario import CarSpec
from activesteer.simulation.two_track_search import two_track_lines
from activesteer.theory.single_track import TwoTrackParameters
from activesteer.tyre.evaluation import MagicFormula
from activesteer.vehicle.statics import mass_properties
from activesteer.vehicle_builder.completion import rack_per_steer_m
from activesteer.vehicle_builder.design import Axle, CarDesign, hardware_tables, in_degrees
from activesteer.vehicle_builder.trim import Trimmed, TrimmedAxle

_LEFT_OF_STIFFNESS: Final = {"front": 0.6, "rear": 1.05}
"""Effective cornering stiffness of an axle over its tyres' in the compact: compliance and roll steer."""
_TEMPLATES: Final = Path(__file__).resolve().parent / "templates"


def vehicle_text(
    car: CarDesign, trimmed: Trimmed, model: mujoco.MjModel | None, two_track: TwoTrackParameters | None = None
) -> str:
    """Return the content of the vehicle file."""
    remarks, _ = read_toml(_TEMPLATES / "remarks.toml")
    remarks |= {
        "steering": f"Ratio at the centre without load; lock: the rack stops at {1e3 * car.rack_limit_m:.1f} mm.",
        "single_track": (
            f"Estimated: {_LEFT_OF_STIFFNESS['front']:g} (front) and {_LEFT_OF_STIFFNESS['rear']:g} (rear) times the "
            "stiffness of the tyres under static load, as in the compact.\n"
            f"`activesteer identify --vehicle {car.name}.toml` drives the car and replaces the values."
        ),
    }
    made = "Made by `activesteer vehicle new`; README.md lists the assumptions."
    text = toml_text(_table(car, trimmed, model, two_track), remarks)
    return f"# {car.name}: properties that its MJCF does not define. {made}\n{text}"


def _table(
    car: CarDesign, trimmed: Trimmed, model: mujoco.MjModel | None, two_track: TwoTrackParameters | None
) -> dict[str, Any]:
    """Return the vehicle file as a table."""
    compact, _ = read_toml(find_vehicle("compact"))
    lines = two_track_lines(two_track) if two_track is not None else {}
    limit_rad = 0.99 * car.rack_limit_m / trimmed.pinion_radius_m
    return {
        "mjcf": f"{car.name}.xml",
        "width_m": round(car.width_m, 3),
        "tyres": {axle.name: axle.tyre for axle in car.axles},
        "steering": {
            "ratio": round(trimmed.ratio, 3),
            "steering_wheel_limit_deg": math.floor(math.degrees(limit_rad)),
        },
        "dampers": {
            axle.name: {
                "velocity_mps": [float(f"{value:g}") for value in trimmed.axle(axle.name).damper_velocity_mps],
                "force_N": [float(f"{value:g}") for value in trimmed.axle(axle.name).damper_force_N],
            }
            for axle in car.axles
        },
        "friction": {
            "front_damper_N": round(trimmed.front.friction_N, 1),
            "rear_damper_N": round(trimmed.rear.friction_N, 1),
            "vibration_mps": compact["friction"]["vibration_mps"],
            "rack_N": round(car.rack_friction_N, 1),
        },
        **_curves(car, trimmed),
        "brakes": to_table(car.brakes, defaults=False),
        "powertrain": to_table(car.powertrain, defaults=False),
        "aerodynamics": to_table(car.aerodynamics, defaults=False),
        **hardware_tables(car.table),
        "single_track": _single_track(car, model),
        **({"two_track": {key: float(value) for key, value in lines.items()}} if lines else {}),
        "controllers": compact["controllers"],
    }


def _curves(car: CarDesign, trimmed: Trimmed) -> dict[str, Any]:
    """Return the tables [curves.front] and [curves.rear], empty for axles with links."""
    guided = {axle.name: curves for axle in car.axles if (curves := trimmed.axle(axle.name).curves) is not None}
    tables = {name: in_degrees(to_table(curves, defaults=False)) for name, curves in guided.items()}
    return {"curves": tables} if tables else {}


def _single_track(car: CarDesign, model: mujoco.MjModel | None) -> dict[str, float]:
    """Return the single-track model estimated from the tyres."""
    base = car.wheelbase_m
    mass, inertia, to_front, stiffness = 1500.0, 2300.0, 0.45 * base, {"front": 1e5, "rear": 1.5e5}
    if model is not None:
        body = mass_properties(model)
        mass, inertia = body.mass_kg, float(body.inertia_kgm2[2, 2])
        to_front = float(car.front.wheel_centre_m[0] - body.cg_m[0])
        for axle in car.axles:
            arm = base - to_front if axle.name == "front" else to_front
            load = 0.5 * mass * GRAVITY_MPS2 * arm / base
            force = MagicFormula(axle.tyre_parameters).evaluate(load, 0.0, [1e-3, -1e-3], vx_mps=80.0 / 3.6).fy_N
            stiffness[axle.name] = 2.0 * float(force[1] - force[0]) / 2e-3 * _LEFT_OF_STIFFNESS[axle.name]
    front, rear = stiffness["front"], stiffness["rear"]
    moment = rear * (base - to_front) - front * to_front
    square = front * rear * base**2 / (mass * moment) if moment > 0.0 else math.inf
    speed = min(max(math.sqrt(square), 50.0 / 3.6), 300.0 / 3.6)
    return {
        "mass_kg": round(mass, 1),
        "yaw_inertia_kgm2": round(inertia, 1),
        "cg_to_front_m": round(to_front, 4),
        "cg_to_rear_m": round(base - to_front, 4),
        "front_stiffness_Nprad": round(front),
        "rear_stiffness_Nprad": round(rear),
        "characteristic_speed_kmh": round(3.6 * speed, 1),
    }


def num(value: float, digits: int = 6) -> str:
    """Format a number with at most `digits` decimals, without trailing zeros."""
    text = f"{float(value):.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def sig(value: float, digits: int = 6) -> str:
    """Format a number with `digits` significant digits."""
    return f"{float(value):.{digits}g}".replace("e+0", "e").replace("e+", "e")


def vec(values: Iterable[float], digits: int = 6) -> str:
    """Format numbers with at most `digits` decimals, separated by blanks as in MJCF."""
    return " ".join(num(value, digits) for value in values)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("activesteer.vehicle_builder"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.globals |= {"num": num, "sig": sig, "vec": vec, "round": round, "sqrt": math.sqrt}
    environment.globals |= {"radians": math.radians, "pi": math.pi}
    environment.filters["sig"] = sig
    return environment


def filled(template: str, **values: Any) -> str:
    """Return a template with its values filled in."""
    return _environment().get_template(template).render(values)


_NO_KEYFRAMES = "<mujocoinclude>\n  <keyframe/>\n</mujocoinclude>\n"


class _Corner(NamedTuple):
    name: str
    axle: Axle
    side: float  # 1 on the left, -1 on the right

    def at(self, point: Array) -> str:
        """Return a point of the left side as text, mirrored to this side."""
        return vec((point[0], self.side * point[1], point[2]))


def mjcf_files(car: CarDesign, trimmed: Trimmed) -> dict[str, str]:
    """Return the contents of the model's files by name, with an empty keyframe."""
    front, corners = car.front, _corners(*car.axles)
    half_width_m = 0.5 * float(front.tyre_parameters["WIDTH"])
    main = {"car": car, "front": front, "corners": corners, "trimmed": trimmed, "half_width_m": half_width_m}
    left_m = front.points["tie_rod_inner"]
    steering = {"left_m": left_m, "right_m": left_m * np.array([1.0, -1.0, 1.0])}
    # Springs without a shape of their own, or on an arm.
    viewed = [one for one in corners if one.axle.spring.start_m is None or one.axle.spring.on_arm]
    scene = {"corners": corners, "viewed": viewed, "rack_per_steer": rack_per_steer_m(front)}
    return {
        f"{car.name}.xml": filled("car.xml", **main, rack_joint=_rack_joint),
        "front_axle.xml": _axle_file(car, front, trimmed),
        "rear_axle.xml": _axle_file(car, car.rear, trimmed),
        "steering.xml": filled("steering.xml", car=car, **steering, bar_kgm2=car.rack_mass_kg * left_m[1] ** 2 / 5.0),
        "scene.xml": filled("scene.xml", car=car, **scene),
        "keyframes.xml": _NO_KEYFRAMES,
    }


def _corners(*axles: Axle) -> list[_Corner]:
    return [_Corner(f"{axle.name[0]}{end}", axle, side) for axle in axles for end, side in (("l", 1.0), ("r", -1.0))]


def _rack_joint(axle: Axle, lever: float) -> str:
    """Return the joint that lengthens a spring of a guided axle as the rack raises its wheel."""
    lift = 0.0 if axle.measured is None else axle.measured.rack_lift
    return f'<joint joint="rack" coef="{num(lever * lift)}"/>' if lift else ""


def _axle_file(car: CarDesign, axle: Axle, trimmed: Trimmed) -> str:
    """Return the content of front_axle.xml or rear_axle.xml."""
    middle = axle.wheel_centre_m - np.array([0.0, 0.06, 0.0])
    drawn = [axle.points[point] for point in dict.fromkeys(link.outer for link in axle.links)]
    drawn = [point for point in drawn if np.linalg.norm(point - middle) > 0.01]
    lower, upper = (_in_design(axle, point) for point in car.kingpin_m)
    axis = (upper - lower) / np.linalg.norm(upper - lower)
    return filled(
        "axle.xml",
        axle=axle,
        words=axle.kind.name.replace("_", " ").capitalize(),
        trim=trimmed.axle(axle.name),
        corners=_corners(axle),
        directions={} if axle.top_mount is None else axle.top_mount.directions,
        rod=None if axle.top_mount is None else axle.top_mount.rod,
        half_width_m=0.5 * float(axle.tyre_parameters["WIDTH"]),
        middle_m=middle,
        drawn=[*drawn, *([axle.points["strut_bottom"]] if axle.kind.strut else [])],
        kingpin={
            "lower": lower, "upper": upper, "axis": axis,
            "middle": lower + axis * (axle.wheel_centre_m[2] - lower[2]) / axis[2],
        },
    )  # fmt: skip


def _in_design(axle: Axle, point: Array) -> Array:
    """Return a point of the knuckle at zero joint positions."""
    if axle.measured is None:
        return point
    curves = axle.measured.curves
    camber, toe = (-float(np.interp(0.0, curves.travel_m, over)) for over in (curves.camber_rad, curves.toe_rad))
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(camber), -np.sin(camber)], [0.0, np.sin(camber), np.cos(camber)]])
    about_z = np.array([[np.cos(toe), -np.sin(toe), 0.0], [np.sin(toe), np.cos(toe), 0.0], [0.0, 0.0, 1.0]])
    return axle.wheel_centre_m + (about_z @ about_x).T @ (point - axle.wheel_centre_m)


def readme_text(car: CarDesign, trimmed: Trimmed, table_name: str) -> str:
    """Return the content of README.md."""
    measured = [
        (axle, *max(axle.measured.roughness.items(), key=lambda item: item[1], default=("", 0.0)))
        for axle in car.axles
        if axle.measured is not None
    ]
    damping = {axle.name: _damping_Nspm(trimmed.axle(axle.name)) for axle in car.axles}
    return filled("README.md", car=car, trimmed=trimmed, table=table_name, measured=measured, damping=damping)


def _damping_Nspm(trim: TrimmedAxle) -> float:
    """Return the mean damping about zero velocity."""
    speeds, forces = trim.damper_velocity_mps, trim.damper_force_N
    at = next(index for index, speed in enumerate(speeds) if speed >= 0.0)
    first, last = max(at - 1, 0), min(at + 1, len(speeds) - 1)
    return (forces[last] - forces[first]) / (speeds[last] - speeds[first])


_REMARK = (
    "# {name} as a table for `activesteer vehicle new NAME --kc FOLDER`: written by `activesteer kc --tables FOLDER`.\n"
    "# Left side, coordinates of the car's own model, x forward, y left, z up from the road.\n"
)


_LEAST = 1e-4
"""Mass and inertia of a part that the original car does not have [kg, kg m2]."""


def car_table(car: CarSpec, result: KcResult) -> str:
    """Return the content of the table of a measured car."""
    model, config = result.measured.vehicle.model, car.config
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    load, body = result.measured.static_load_N, mass_properties(model)
    standing = result.curves["parallel_travel"]
    centres = standing.centre_m[standing.zero].copy()
    # The origin of the rig is that of the chassis, which stands slightly off the road.
    wheels = [model.body(f"{corner}_wheel").id for corner in CORNERS]
    centres[:, 2] = result.measured.vehicle.data.xpos[wheels, 2]
    steering = model.tendon("steering_column")
    friction = config.friction
    table: dict[str, Any] = {
        "units": "m",
        "origin": [round(float(centres[:2, 0].mean()), 3), 0.0, 0.0],
        "source": f"{car.name} on the K&C rig of activesteer",
        "width_m": config.width_m,
        "mass": {
            "total_kg": round(body.mass_kg, 3),
            "front_fraction": round(float(load[:2].sum() / load.sum()), 6),
            "cg_height_m": round(float(result.measured.vehicle.data.subtree_com[0, 2]), 5),
            "inertia_kgm2": [round(float(value), 2) for value in np.diag(body.inertia_kgm2)],
        },
        "steering": {
            "rack_mass_kg": round(float(model.body("rack").mass[0]), 3),
            "rack_limit_m": round(float(model.joint("rack").range[1]), 5),
            "rack_friction_N": friction.rack_N,
            "column_stiffness_Npm": float(model.tendon_stiffness[steering.id]),
        },
        **_rear_steering(result, centres[2]),
        **{axle: _axle_table(car, model, data, centres, axle) for axle in ("front", "rear")},
        "brakes": to_table(config.brakes, defaults=False),
        "powertrain": to_table(config.powertrain, defaults=False),
        "aerodynamics": to_table(config.aerodynamics, defaults=False),
        **hardware_tables(config),
    }
    return _REMARK.format(name=car.name) + toml_text(table)


def _rear_steering(result: KcResult, centre_m: Array) -> dict[str, Any]:
    """Return a lower and an upper point of the hinge between rear knuckle and wheel."""
    model, axis = result.measured.vehicle.model, result.measured.axes[2]
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, "rl_steer") < 0:
        return {}
    points = {
        key: _point(axis.point_m + axis.direction * (centre_m[2] + beside - axis.point_m[2]) / axis.direction[2])
        for key, beside in (("axis_lower", -0.11), ("axis_upper", 0.12))
    }
    limit = float(model.joint("rl_steer").range[1])
    stiffness = float(model.actuator("rl_steer").gainprm[0])
    return {
        "rear_steering": {
            **points,
            "limit_deg": round(float(np.degrees(limit)), 4),
            "stiffness_Nmprad": float(f"{stiffness:.6g}"),
        }
    }


def _point(point: Array) -> list[float]:
    return [round(float(value), 5) for value in point]


def _axle_table(car: CarSpec, model: mujoco.MjModel, data: mujoco.MjData, centres: Array, axle: str) -> dict[str, Any]:
    corner, front = f"{axle[0]}l", axle == "front"
    curve = getattr(car.config.dampers, axle)
    friction = car.config.friction
    centre = centres[0 if front else 2]
    # Design position and standing position differ by fractions of a millimetre, which shift the masses too.
    moved = centre - data.xpos[model.body(f"{corner}_wheel").id]
    wheel = model.body(f"{corner}_wheel")
    parts = {"knuckle": f"{corner}_knuckle"} | ({} if front else {"carrier": f"{corner}_carrier"})
    masses: dict[str, Any] = {}
    for key, name in parts.items():
        if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) < 0:
            continue
        index = model.body(name).id
        axes = data.ximat[index].reshape(3, 3)
        inertia = np.diag(axes @ np.diag(model.body_inertia[index]) @ axes.T)
        masses |= {
            f"{key}_mass_kg": max(round(float(model.body_mass[index]), 4), _LEAST),
            f"{key}_cg": _point(data.xipos[index] + moved),
            f"{key}_inertia_kgm2": [max(float(f"{value:.5g}"), _LEAST) for value in inertia],
        }
    spin = int(np.argmax(np.abs(data.ximat[wheel.id].reshape(3, 3)[1])))
    across_least = math.ceil(0.5 * round(float(wheel.inertia[spin]), 4) * 1e4) * 1e-4
    return {
        "type": "curves",
        "tyre": getattr(car.config.tyres, axle),
        "damper_velocity_mps": list(curve.velocity_mps),
        "damper_force_N": list(curve.force_N),
        "damper_friction_N": friction.front_damper_N if front else friction.rear_damper_N,
        "wheel_mass_kg": round(float(wheel.mass[0]), 4),
        "wheel_spin_inertia_kgm2": round(float(wheel.inertia[spin]), 4),
        # A disc has half; rounding must not give less.
        "wheel_inertia_kgm2": max(round(float(np.delete(wheel.inertia, spin).mean()), 4), across_least),
        **masses,
        "points": {"wheel_centre": _point(centre)},
    }

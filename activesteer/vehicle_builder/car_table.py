"""Table of an existing car for its rig measurements: masses, tyres, dampers, steering, brakes.

With it, `activesteer vehicle new NAME --kc DIR` makes the same car again, with curves instead of links.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np

from activesteer.config import to_table, toml_text
from activesteer.conventions import CORNERS, Array
from activesteer.rigs.kc.result import KcResult
from activesteer.scenario import CarSpec
from activesteer.vehicle.statics import mass_properties
from activesteer.vehicle_builder.design import hardware_tables

_REMARK = (
    "# {name} as a table for `activesteer vehicle new NAME --kc FOLDER`: written by `activesteer kc --tables FOLDER`.\n"
    "# Left side, coordinates of the car's own model, x forward, y left, z up from the road.\n"
)


_LEAST = 1e-4
"""Mass and inertia of a part that the original car does not have [kg, kg m2]."""


def car_table(car: CarSpec, result: KcResult) -> str:
    """Return the text of the table."""
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
        **{axle: _axle(car, model, data, centres, axle) for axle in ("front", "rear")},
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


def _axle(car: CarSpec, model: mujoco.MjModel, data: mujoco.MjData, centres: Array, axle: str) -> dict[str, Any]:
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

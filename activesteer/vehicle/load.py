"""Load of a car, and factors on the car as modelled, applied to the model before it is compiled."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from activesteer.conventions import CORNERS, Array
from activesteer.errors import ModelError
from activesteer.vehicle.parameters import Factors, Load, VehicleParameters
from activesteer.vehicle.statics import mass_properties, point_mass_inertia

_AXLES: Final = (CORNERS[:2], CORNERS[2:])
_BOOT_M: Final = (0.0, 0.0, 0.6)
_TANK_M: Final = (0.4, 0.0, 0.35)
"""Default position of payload and fuel, relative to the road below the middle of the rear axle, vehicle axes [m]."""


def apply_load(spec: mujoco.MjSpec, parameters: VehicleParameters) -> None:
    """Load the car.

    Masses are points fixed to the chassis. The site `cg`, whose motion is recorded, moves with the centre of gravity of
    the whole car. A car without load stays exactly as it is.
    """
    chassis = spec.body("chassis")
    if chassis is None:
        raise ModelError("there is no body 'chassis'", value="chassis")
    load, factors = parameters.load, parameters.factors
    if load == Load() and factors == Factors():
        return
    bare = spec.compile()
    _scale_springs(spec, bare, factors)
    body = bare.body("chassis")
    before = mass_properties(bare)
    fraction = before.mass_kg / float(body.mass[0])
    scale = 1.0 + (factors.mass - 1.0) * fraction
    if scale <= 0.0:
        minimum = 1.0 - 1.0 / fraction
        raise ModelError(
            f"{factors.mass:g} leaves no mass for the chassis; more than {minimum:.2f} is needed",
            key="factors.mass",
            value=factors.mass,
        )
    mass = scale * float(body.mass[0])
    # The shift is that of the whole empty car's centre of gravity; only the chassis' is moved.
    move_m = np.array([load.cg_forward_change_m, 0.0, load.cg_height_change_m])
    cg = body.ipos + move_m * factors.mass * before.mass_kg / mass
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, body.iquat)
    axes = axes.reshape(3, 3)
    inertia = scale * axes @ np.diag(body.inertia) @ axes.T
    spread = (factors.yaw_inertia - 1.0) * factors.mass * before.inertia_kgm2[2, 2]
    inertia += np.diag([0.0, spread, spread])
    points = [*_points(bare, load), (mass, cg)]
    total = sum(weight for weight, _ in points)
    middle = sum(weight * place for weight, place in points) / total
    inertia = inertia + sum(weight * point_mass_inertia(place - middle) for weight, place in points)
    chassis.mass, chassis.ipos, chassis.iquat, chassis.inertia = total, middle, (1.0, 0.0, 0.0, 0.0), np.zeros(3)
    chassis.fullinertia = inertia[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)]
    moved = mass_properties(spec.compile()).cg_m - before.cg_m
    site = spec.site("cg")
    if site is not None:
        site.pos = site.pos + moved


def _points(bare: mujoco.MjModel, load: Load) -> list[tuple[float, Array]]:
    """Return the masses on the car and their positions, vehicle axes [kg], [m]."""
    data = mujoco.MjData(bare)
    mujoco.mj_kinematics(bare, data)
    front, rear = (data.xpos[[bare.body(f"{corner}_wheel").id for corner in pair], 0].mean() for pair in _AXLES)
    below = np.array([rear, 0.0, 0.0])
    boot = below + _BOOT_M if load.payload_position_m is None else np.array(load.payload_position_m)
    tank = below + _TANK_M if load.fuel_position_m is None else np.array(load.fuel_position_m)
    roof = np.array([0.5 * (front + rear), 0.0, load.roof_height_m])
    return [(load.payload_kg, boot), (load.fuel_kg, tank), (load.roof_kg, roof)]


def _scale_springs(spec: mujoco.MjSpec, bare: mujoco.MjModel, factors: Factors) -> None:
    """Change the rates of springs and anti-roll bars; the force of a spring in the design position stays."""
    for tendon in spec.tendons:
        if tendon.name.endswith("_anti_roll_bar"):
            tendon.stiffness = factors.anti_roll_bar * np.asarray(tendon.stiffness)
        elif tendon.name.endswith("_spring") and factors.spring_rate != 1.0:
            design_m = float(bare.tendon_length0[bare.tendon(tendon.name).id])
            # The curve is compressed along x: G(x) = F(f x) has at x0 / f the force of F at x0, and f times the rate.
            free_m = design_m - (design_m - float(tendon.springlength[0])) / factors.spring_rate
            tendon.stiffness = factors.spring_rate ** np.arange(1, 4) * np.asarray(tendon.stiffness)
            tendon.springlength = [free_m, free_m]

"""The vehicle file of a new car: what MJCF cannot say, and what controllers know until the car was driven."""

from __future__ import annotations

import math

import mujoco

from activesteer.tyre.evaluation import MagicFormula
from activesteer.vehicle_builder.design import Axle, Car
from activesteer.vehicle_builder.masses import whole
from activesteer.vehicle_builder.numbers import num, sig
from activesteer.vehicle_builder.trimmed import Trimmed, TrimmedAxle

_LEFT_OF_STIFFNESS = {"front": 0.6, "rear": 1.05}
"""Effective cornering stiffness of an axle over that of its tyres, in the compact: compliance and roll steer."""


def vehicle_text(car: Car, trimmed: Trimmed, model: mujoco.MjModel | None) -> str:
    """Text of the vehicle file.

    Args:
        car: The car.
        trimmed: What was trimmed.
        model: The car compiled, for its single-track model; None: a placeholder that serves while it is trimmed.
    """
    brakes, power, aero = car.brakes, car.powertrain, car.aerodynamics
    limit_deg = math.degrees(0.99 * car.rack_limit_m / trimmed.pinion_radius_m)
    dampers = "\n\n".join(_damper(axle, trimmed.axle(axle.name)) for axle in car.axles)
    point = ", ".join(f"{value:g}" for value in aero.pressure_point_m)
    return f"""# {car.name}: what its MJCF cannot say. Made by `activesteer vehicle new`; README.md lists what was assumed.
mjcf = "{car.name}.xml"
width_m = {num(car.width_m, 3)}

[tyres]
front = "{car.front.tyre}"
rear = "{car.rear.tyre}"

# Ratio at the centre, unloaded; lock: the rack stops at {num(1e3 * car.rack_limit_m, 1)} mm.
[steering]
ratio = {num(trimmed.ratio, 3)}
steering_wheel_limit_deg = {math.floor(limit_deg)}

# Compression positive.
{dampers}

# Dry friction; vibration as in the compact's file (a road of class A at 80 km/h).
[friction]
front_damper_N = {num(car.front.friction_N, 1)}
rear_damper_N = {num(car.rear.friction_N, 1)}
vibration_mps = 0.07
rack_N = {num(car.rack_friction_N, 1)}

# Torque per wheel at full pedal.
[brakes]
front_torque_Nm = {num(brakes.front_torque_Nm, 1)}
rear_torque_Nm = {num(brakes.rear_torque_Nm, 1)}
drag_torque_Nm = {num(brakes.drag_torque_Nm, 2)}
stiffness_Nmprad = {sig(brakes.stiffness_Nmprad)}

[powertrain]
front_share = {num(power.front_share, 3)}
max_torque_Nm = {num(power.max_torque_Nm, 1)}
engine_brake_torque_Nm = {num(power.engine_brake_torque_Nm, 1)}
lag_s = {num(power.lag_s, 3)}

[aerodynamics]
drag_area_m2 = {num(aero.drag_area_m2, 3)}
air_density_kgpm3 = {num(aero.air_density_kgpm3, 4)}
pressure_point_m = [{point}]

{_single_track(car, model)}
# Driver and controllers have the package's own values ([driver], [controllers]): none are written for this car.
"""


def _damper(axle: Axle, found: TrimmedAxle) -> str:
    return (
        f"[dampers.{axle.name}]\n"
        f"velocity_mps = [{', '.join(f'{value:g}' for value in found.damper_velocity_mps)}]\n"
        f"force_N = [{', '.join(f'{value:g}' for value in found.damper_force_N)}]"
    )


def _single_track(car: Car, model: mujoco.MjModel | None) -> str:
    if model is None:
        mass, inertia, to_front, stiffness = 1500.0, 2300.0, 0.45 * car.wheelbase_m, {"front": 1e5, "rear": 1.5e5}
    else:
        body = whole(model)
        mass, inertia = body.mass_kg, float(body.inertia_kgm2[2, 2])
        to_front = float(car.front.wheel_centre_m[0] - body.cg_m[0])
        stiffness = {}
        for axle in car.axles:
            arm = car.wheelbase_m - to_front if axle.name == "front" else to_front
            load = 0.5 * mass * 9.81 * arm / car.wheelbase_m
            force = MagicFormula(axle.tyre_parameters).evaluate(load, 0.0, [1e-3, -1e-3], vx_mps=80.0 / 3.6).fy_N
            stiffness[axle.name] = 2.0 * float(force[1] - force[0]) / 2e-3 * _LEFT_OF_STIFFNESS[axle.name]
    to_rear = car.wheelbase_m - to_front
    front, rear = stiffness["front"], stiffness["rear"]
    moment = rear * to_rear - front * to_front
    square = front * rear * car.wheelbase_m**2 / (mass * moment) if moment > 0.0 else (120.0 / 3.6) ** 2
    speed_kmh = 3.6 * math.sqrt(square)
    return f"""# Estimated: stiffnesses are {_LEFT_OF_STIFFNESS["front"]:g} (front) and {_LEFT_OF_STIFFNESS["rear"]:g} (rear) of those of the tyres under static load, as in the compact.
# `activesteer identify --vehicle ...` drives the car and replaces this table.
[single_track]
mass_kg = {num(mass, 1)}
yaw_inertia_kgm2 = {num(inertia, 1)}
cg_to_front_m = {num(to_front, 4)}
cg_to_rear_m = {num(to_rear, 4)}
front_stiffness_Nprad = {num(front, 0)}
rear_stiffness_Nprad = {num(rear, 0)}
characteristic_speed_kmh = {num(min(max(speed_kmh, 50.0), 300.0), 1)}
"""

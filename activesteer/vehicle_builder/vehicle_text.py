"""The vehicle file of a new car: what MJCF cannot say, and what controllers know until the car was driven."""

from __future__ import annotations

import math
from pathlib import Path
from string import Template
from typing import Final

import mujoco

from activesteer.controllers import SingleTrackParameters
from activesteer.conventions import GRAVITY_MPS2
from activesteer.tyre.evaluation import MagicFormula
from activesteer.vehicle.mass_properties import mass_properties
from activesteer.vehicle_builder.design import Axle, Car
from activesteer.vehicle_builder.numbers import num, sig
from activesteer.vehicle_builder.trimmed import Trimmed, TrimmedAxle

_LEFT_OF_STIFFNESS: Final = {"front": 0.6, "rear": 1.05}
"""Effective cornering stiffness of an axle over that of its tyres, in the compact: compliance and roll steer."""
_TEMPLATE: Final = Path(__file__).resolve().parent / "templates" / "vehicle.toml"


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
    track = _single_track(car, model)
    return Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        name=car.name,
        width=num(car.width_m, 3),
        front_tyre=car.front.tyre,
        rear_tyre=car.rear.tyre,
        rack_mm=num(1e3 * car.rack_limit_m, 1),
        ratio=num(trimmed.ratio, 3),
        limit=math.floor(limit_deg),
        dampers=dampers,
        front_friction=num(trimmed.front.friction_N, 1),
        rear_friction=num(trimmed.rear.friction_N, 1),
        rack_friction=num(car.rack_friction_N, 1),
        front_brake=num(brakes.front_torque_Nm, 1),
        rear_brake=num(brakes.rear_torque_Nm, 1),
        brake_drag=num(brakes.drag_torque_Nm, 2),
        brake_stiffness=sig(brakes.stiffness_Nmprad),
        front_share=num(power.front_share, 3),
        max_torque=num(power.max_torque_Nm, 1),
        max_power=num(power.max_power_W, 1),
        max_wheel_speed=num(power.max_wheel_speed_radps, 1),
        drive_inertia=num(power.inertia_kgm2, 2),
        engine_brake=num(power.engine_brake_torque_Nm, 1),
        lag=num(power.lag_s, 3),
        drag_area=num(aero.drag_area_m2, 3),
        air_density=num(aero.air_density_kgpm3, 4),
        drag_point=point,
        left_front=f"{_LEFT_OF_STIFFNESS['front']:g}",
        left_rear=f"{_LEFT_OF_STIFFNESS['rear']:g}",
        mass=num(track.mass_kg, 1),
        yaw_inertia=num(track.yaw_inertia_kgm2, 1),
        cg_to_front=num(track.cg_to_front_m, 4),
        cg_to_rear=num(track.cg_to_rear_m, 4),
        front_stiffness=num(track.front_stiffness_Nprad, 0),
        rear_stiffness=num(track.rear_stiffness_Nprad, 0),
        characteristic_speed=num(3.6 * (track.characteristic_speed_mps or 0.0), 1),
    )


def _damper(axle: Axle, found: TrimmedAxle) -> str:
    return (
        f"[dampers.{axle.name}]\n"
        f"velocity_mps = [{', '.join(f'{value:g}' for value in found.damper_velocity_mps)}]\n"
        f"force_N = [{', '.join(f'{value:g}' for value in found.damper_force_N)}]"
    )


def _single_track(car: Car, model: mujoco.MjModel | None) -> SingleTrackParameters:
    """The car as controllers see it, estimated from its tyres; the characteristic speed within 50 to 300 km/h."""
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
    return SingleTrackParameters(mass, inertia, to_front, base - to_front, front, rear, speed)

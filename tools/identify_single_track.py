"""Identifies the single-track parameters of a vehicle from steady-state cornering of the multibody car.

Usage: python tools/identify_single_track.py [VEHICLE]

Prints the table [single_track] for the vehicle file. Mass, inertia and axle distances are those of the model at static
ride. Axle stiffnesses and characteristic speed are effective ones: they belong to the driver's angle (steering wheel
over overall ratio), so they include roll steer, compliance and the column, as in ISO 4138. Steps of the steering wheel
to 0.1 g, in the linear range, at several speeds.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np

from activesteer import simulate
from activesteer.scenario import resolve
from activesteer.vehicle import Vehicle

SPEEDS_KMH = (60.0, 80.0, 100.0, 120.0)
LATERAL_ACCELERATION_G = 0.1
STEADY_ROWS = 500


class Body(NamedTuple):
    """Mass properties of the whole car at static ride."""

    mass_kg: float
    yaw_inertia_kgm2: float
    cg_to_front_m: float
    cg_to_rear_m: float


class SteadyState(NamedTuple):
    """One steady-state corner."""

    speed_mps: float
    yaw_gain_1ps: float
    front_stiffness_Nprad: float
    rear_stiffness_Nprad: float


def mass_properties(vehicle_name: str) -> Body:
    """Mass properties of the whole car, from the model at static ride."""
    scenario = resolve("standstill", vehicle_name)
    vehicle = Vehicle(scenario.mjcf, scenario.car, scenario.tyres, scenario.road)
    model, data = vehicle.model, vehicle.data
    centre = data.subtree_com[model.body("chassis").id]
    inertia = 0.0
    for body in range(1, model.nbody):
        axes = data.ximat[body].reshape(3, 3)
        offset = data.xipos[body] - centre
        about_own = (axes @ np.diag(model.body_inertia[body]) @ axes.T)[2, 2]
        inertia += about_own + model.body_mass[body] * (offset[0] ** 2 + offset[1] ** 2)
    front, rear = (data.xpos[model.body(f"{axle}l_wheel").id, 0] for axle in "fr")
    return Body(float(model.body_mass.sum()), float(inertia), float(front - centre[0]), float(centre[0] - rear))


def corner(vehicle_name: str, speed_kmh: float, body: Body) -> SteadyState:
    """Drives into a steady corner and evaluates it."""
    recording = simulate(
        "step_steer",
        vehicle=vehicle_name,
        overrides={
            "speed_kmh": speed_kmh,
            "duration_s": 6.0,
            "steer.lateral_acceleration_g": LATERAL_ACCELERATION_G,
        },
    )

    def mean(channel: str) -> float:
        return float(recording[channel][-STEADY_ROWS:].mean())

    speed, yaw_rate, sideslip = mean("vx_mps"), mean("yaw_rate_radps"), mean("sideslip_rad")
    angle = mean("front_steer_demand_rad")
    force = body.mass_kg * mean("ay_mps2")
    wheelbase = body.cg_to_front_m + body.cg_to_rear_m
    front_slip = angle - sideslip - body.cg_to_front_m * yaw_rate / speed
    rear_slip = -sideslip + body.cg_to_rear_m * yaw_rate / speed
    return SteadyState(
        speed,
        yaw_rate / angle,
        force * body.cg_to_rear_m / wheelbase / front_slip,
        force * body.cg_to_front_m / wheelbase / rear_slip,
    )


def main() -> None:
    """Prints the table."""
    vehicle_name = sys.argv[1] if len(sys.argv) > 1 else "compact"
    body = mass_properties(vehicle_name)
    wheelbase = body.cg_to_front_m + body.cg_to_rear_m
    corners = [corner(vehicle_name, speed, body) for speed in SPEEDS_KMH]
    # Least squares of eq. 3: speed / (wheelbase * gain) - 1 = speed^2 / v_ch^2.
    speeds = np.array([state.speed_mps for state in corners])
    gains = np.array([state.yaw_gain_1ps for state in corners])
    squares = speeds**2
    excess = speeds / (wheelbase * gains) - 1.0
    characteristic_speed = float(np.sqrt((squares @ squares) / (squares @ excess)))
    print(f"mass_kg = {body.mass_kg:.1f}")
    print(f"yaw_inertia_kgm2 = {body.yaw_inertia_kgm2:.1f}")
    print(f"cg_to_front_m = {body.cg_to_front_m:.4f}")
    print(f"cg_to_rear_m = {body.cg_to_rear_m:.4f}")
    print(f"front_stiffness_Nprad = {np.mean([state.front_stiffness_Nprad for state in corners]):.0f}")
    print(f"rear_stiffness_Nprad = {np.mean([state.rear_stiffness_Nprad for state in corners]):.0f}")
    print(f"characteristic_speed_kmh = {3.6 * characteristic_speed:.2f}")


if __name__ == "__main__":
    main()

"""A car and the messages to a controller, for the tests of this folder."""

from __future__ import annotations

import math
from dataclasses import replace

from activesteer.controllers import Controller, ControllerParameters, ControllerSetup, SingleTrackParameters
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement

CAR = SingleTrackParameters(
    mass_kg=1400.0,
    yaw_inertia_kgm2=2100.0,
    cg_to_front_m=1.0,
    cg_to_rear_m=1.5,
    front_stiffness_Nprad=90_000.0,
    rear_stiffness_Nprad=120_000.0,
)
"""Round numbers, so that the matrices can be worked out by hand."""

NO_PREDICTION_MPS = math.sqrt(120_000.0 * 1.5 * 2.5 / (1400.0 * 1.0))
"""Speed at which K_H of this car is zero: m v^2 l_V = C_H l_H l [m/s], about 65 km/h."""


def setup(*, gains: ControllerParameters | None = None, **car: float) -> ControllerSetup:
    """Input from which a controller is made."""
    return ControllerSetup(
        single_track=replace(CAR, **car),
        gains=gains or ControllerParameters(),
        steering_ratio=16.0,
        timestep_s=0.001,
    )


def steering(front_steer_rad: float) -> DriverCommand:
    """Command of a driver who only steers."""
    return DriverCommand(16.0 * front_steer_rad, front_steer_demand_rad=front_steer_rad)


def measured(yaw_rate_radps: float, speed_mps: float = 25.0) -> Measurement:
    """Measurement of a yawing car."""
    return Measurement(
        time_s=0.0,
        speed_mps=speed_mps,
        yaw_rate_radps=yaw_rate_radps,
        ay_mps2=speed_mps * yaw_rate_radps,
        ax_mps2=0.0,
        steering_wheel_rad=0.0,
        rear_steer_rad=0.0,
        superposition_rad=0.0,
        wheel_speed_radps=(spin := speed_mps / 0.31, spin, spin, spin),
    )


def held(
    controller: Controller, command: DriverCommand, measurement: Measurement, steps: int = 1000
) -> ActuatorCommand:
    """Last answer of a controller to constant messages."""
    return [controller.step(command, measurement) for _ in range(steps)][-1]

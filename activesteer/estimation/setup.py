"""What an estimator knows: the car as its file says it, unloaded and with new tyres, and the sensors' data sheets."""

from __future__ import annotations

from dataclasses import dataclass

from activesteer.sensors import Sensors
from activesteer.theory.single_track import SingleTrackParameters
from activesteer.theory.two_track import TwoTrackParameters


@dataclass(frozen=True)
class LateralForces:
    """Lateral force of a tyre rolling straight upright on the road of its file, on a grid.

    Attributes:
        slip_angle_step_rad: Distance of the slip angles, from 0 [rad].
        load_step_N: Distance of the loads, from 0 [N].
        force_N: Size of the force, mean of both directions, for each load at each slip angle [N].
    """

    slip_angle_step_rad: float
    load_step_N: float
    force_N: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class EstimatorSetup:
    """What an estimator gets when it is made.

    Attributes:
        single_track: Mass, yaw inertia, axle distances and axle stiffnesses.
        two_track: What loads the wheels and inclines the body.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        tyres: Tyre of the front and of the rear axle.
        rolling_radius_m: Rolling radius of the wheels, order of `CORNERS` [m].
        drive_fractions: Share of the drive torque of each wheel.
        brake_torque_per_pressure_NmpPa: Of each wheel's brake [Nm/Pa].
        drag_area_m2: Drag coefficient times frontal area [m2].
        sensors: What the data sheets say of the sensors.
    """

    single_track: SingleTrackParameters
    two_track: TwoTrackParameters
    steering_ratio: float
    tyres: tuple[LateralForces, LateralForces]
    rolling_radius_m: tuple[float, float, float, float]
    drive_fractions: tuple[float, float, float, float]
    brake_torque_per_pressure_NmpPa: tuple[float, float, float, float]
    drag_area_m2: float
    sensors: Sensors

"""What an estimator knows: the car as its file says it, unloaded and with new tyres, and the sensors' data sheets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from activesteer.theory.single_track import SingleTrackParameters
from activesteer.theory.two_track import TwoTrackParameters

if TYPE_CHECKING:
    from activesteer.sensors import Sensors


@dataclass(frozen=True)
class KnownTyre:
    """A tyre as an estimator knows it: new, upright, on the road of its file.

    Attributes:
        slip_angle_step_rad: Distance of the slip angles of the grid, from 0 [rad].
        load_step_N: Distance of its loads, from 0 [N].
        force_N: Size of the lateral force, mean of both directions, for each load at each slip angle [N].
        relaxation_length_m: Relaxation length of the slip angle under the load of standing still [m].
        slip_stiffness: Longitudinal force per slip and load, likewise.
        rolling_radius_m: Effective rolling radius, likewise [m].
    """

    slip_angle_step_rad: float
    load_step_N: float
    force_N: tuple[tuple[float, ...], ...]
    relaxation_length_m: float
    slip_stiffness: float
    rolling_radius_m: float

    def stiffness_at(self, load_N: float) -> float:
        """Cornering stiffness [N/rad] under a load [N]."""
        loads_N = self.load_step_N * np.arange(len(self.force_N))
        return float(np.interp(load_N, loads_N, np.array(self.force_N)[:, 1])) / self.slip_angle_step_rad


@dataclass(frozen=True)
class EstimatorSetup:
    """What an estimator gets when it is made.

    Attributes:
        single_track: Mass, yaw inertia, axle distances and axle stiffnesses.
        two_track: What loads the wheels and inclines the body.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        tyres: Tyre of the front and of the rear axle.
        drive_fractions: Fraction of the drive torque of each wheel, order of `CORNERS`.
        brake_torque_per_pressure_NmpPa: Of each wheel's brake [Nm/Pa].
        drag_per_speed2_kgpm: Drag over the square of the speed [kg/m].
        sensors: What the data sheets say of the sensors.
    """

    single_track: SingleTrackParameters
    two_track: TwoTrackParameters
    steering_ratio: float
    tyres: tuple[KnownTyre, KnownTyre]
    drive_fractions: tuple[float, float, float, float]
    brake_torque_per_pressure_NmpPa: tuple[float, float, float, float]
    drag_per_speed2_kgpm: float
    sensors: Sensors

    @property
    def rolling_radius_m(self) -> tuple[float, float, float, float]:
        """Rolling radius of each wheel [m], order of `CORNERS`."""
        front, rear = self.tyres
        return front.rolling_radius_m, front.rolling_radius_m, rear.rolling_radius_m, rear.rolling_radius_m

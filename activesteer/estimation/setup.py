"""Knowledge of an estimator: the car of the vehicle file, unloaded and with new tyres, and the sensors' data sheets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from activesteer.theory.single_track import SingleTrackParameters
from activesteer.theory.two_track import TwoTrackParameters

if TYPE_CHECKING:
    from activesteer.sensors import Sensors

GRID: Final = (10, 41)
"""Number of loads and of slip angles at which the forces of a `KnownTyre` are tabulated."""


@dataclass(frozen=True)
class KnownTyre:
    """Tyre as an estimator knows it: new, upright, on the road of its file.

    Attributes:
        slip_angle_step_rad: Step of the slip angles of the grid, from 0 [rad].
        load_step_N: Step of its loads, from 0 [N].
        force_N: Lateral force for each load and slip angle of `GRID`, mean of both directions, without sign [N].
        relaxation_length_m: Relaxation length of the slip angle under the static load [m].
        slip_stiffness: Longitudinal force per slip and load, under the static load.
        rolling_radius_m: Effective rolling radius under the static load [m].
    """

    slip_angle_step_rad: float
    load_step_N: float
    force_N: tuple[tuple[float, ...], ...]
    relaxation_length_m: float
    slip_stiffness: float
    rolling_radius_m: float

    def stiffness_at(self, load_N: float) -> float:
        """Return the cornering stiffness under a load [N/rad]."""
        loads_N = self.load_step_N * np.arange(len(self.force_N))
        return float(np.interp(load_N, loads_N, np.array(self.force_N)[:, 1])) / self.slip_angle_step_rad


@dataclass(frozen=True)
class EstimatorSetup:
    """Input from which an estimator is made.

    Attributes:
        single_track: Mass, yaw inertia, axle distances and axle stiffnesses.
        two_track: Parameters of wheel loads and body roll.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        tyres: Tyre of the front and of the rear axle.
        drive_fractions: Fraction of the drive torque at each wheel, order of `CORNERS`.
        brake_torque_per_pressure_NmpPa: Brake torque per pressure of each wheel [Nm/Pa].
        drag_per_speed2_kgpm: Drag over the square of the speed [kg/m].
        sensors: Data sheets of the sensors.
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

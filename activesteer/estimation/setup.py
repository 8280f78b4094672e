"""Setup of an estimator: the unloaded car with new tyres, and the sensors' data sheets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np

from activesteer.config import Range
from activesteer.core.conventions import GRAVITY_MPS2, Array
from activesteer.theory.single_track import SingleTrackParameters, TwoTrackParameters

_Positive = Annotated[float, Range(1e-9)]
_NotNegative = Annotated[float, Range(0.0)]


@dataclass(frozen=True)
class EstimatorParameters:
    """Roll steer and uncertainties of the estimator's model."""

    front_roll_steer: Annotated[float, Range(-2.0, 2.0)] = 0.0
    """Slip angle that the front axle loses per roll angle [rad/rad]. From a K&C test: `roll_understeer`, plus
    (1 + `roll_camber`) times the camber stiffness of the tyre over its cornering stiffness."""
    rear_roll_steer: Annotated[float, Range(-2.0, 2.0)] = 0.0
    """The same for the rear axle [rad/rad], with `roll_understeer` subtracted: the rear wheels then steer into the turn
    and gain slip angle."""

    friction: Annotated[float, Range(0.05, 1.5)] = 0.9
    """Assumed friction of the road, relative to the road of the tyre files, until it is observed [-]: dry asphalt."""
    friction_std: _Positive = 0.25
    """Standard deviation of this friction: wet asphalt, 0.6, is likely enough; snow, 0.3, is possible."""
    rear_ratio_std: _Positive = 0.1
    """Standard deviation of the friction of the rear tyres relative to the front tyres: other tyres, wear.
    Chosen."""
    friction_fraction: _NotNegative = 0.05
    """Standard deviation of the observed friction per friction, in the estimate only: the model's tyre is upright. At
    the limit of a ramp of the steering wheel, the inclination of 2 to 3 deg by roll reduces the lateral force of an
    outer wheel by 2 to 3 % (compact) and 7 to 10 % (Tesla). Such an error does not average out."""
    friction_s: _Positive = 10.0
    """Time constant with which the friction returns to the assumed value [s]."""
    slip_angle_std_rad: _Positive = math.radians(0.05)
    """Standard deviation of the slip angle error of an axle: toe, offset of the steering angle sensor [rad]."""
    slip_angle_fraction: _NotNegative = 0.05
    """Slip angle error per slip angle: camber, combined slip, curves that are not similar."""
    slip_angle_braking_s2radpm: _NotNegative = math.radians(0.5) / GRAVITY_MPS2
    """Slip angle error per longitudinal acceleration [rad s2/m]: 0.5 deg per g. Dive and brake forces change the toe of
    the wheels of four cars by 0.03 to 1.5 deg per g, 0.55 deg on average. On a road with split friction the wheel with
    more grip decides."""
    stiffness_std: _Positive = 0.2
    """Standard deviation of the stiffness of the tyres of an axle, relative to new tyres under the known load: wear,
    temperature, winter tyres, load."""
    stiffness_s: _Positive = 100.0
    """Time constant with which the stiffness returns to the stiffness of new tyres [s]."""
    slip_angle_s: _Positive = 1.0
    """Time constant of the slip angle error of an axle [s]."""
    bank_std_mps2: _Positive = 0.3
    """Standard deviation of the gravity across an inclined road [m/s2]: 3 %. By the guideline RAS-L (1995), roads fall
    by 2.5 % across, and curves by 8 % at most."""
    bank_s: _Positive = 10.0
    """Time constant of this gravity [s]."""
    lateral_density_m2ps3: _Positive = 0.0002
    """Spectral density of the lateral acceleration error, without the force errors: 0.03 m/s2 for 0.1 s."""
    yaw_density_rad2ps3: _Positive = 0.00005
    """Spectral density of the yaw acceleration error: 0.016 rad/s2 for 0.1 s, including aligning moments."""
    force_std_N: _NotNegative = 15.0
    """Standard deviation of the axle force of the model."""
    force_fraction: _NotNegative = 0.03
    """Standard deviation per axle force: loads, combined slip, camber."""
    force_s: _Positive = 0.05
    """Duration of the force error [s]: between the lags of tyres, 0.02 s, and body, 1/(2 pi 2.2 Hz) = 0.07 s. From
    0.0125 to 0.2 s the RMS error of the sideslip changes by no more than 0.03 deg in any scenario."""
    along_fraction: _NotNegative = 0.2
    """Standard deviation of the longitudinal force of a wheel, per force: brake pads, split friction."""
    rate_fraction: _NotNegative = 0.005
    """Standard deviation of the yaw rate per value, in addition to its noise: the sensor leans with the body."""
    ay_fraction: _NotNegative = 0.02
    """Standard deviation of the lateral acceleration per value: the body is not exactly a mass on a spring."""
    ax_density_m2ps3: _Positive = 0.004
    """Spectral density of the longitudinal acceleration error."""
    ax_fraction: _NotNegative = 0.02
    """Error of the longitudinal acceleration per value and square root of a second: the body pitches."""
    slope_std_mps2: _Positive = 0.3
    """Standard deviation of the gravity along the road at the start [m/s2]: 3 %."""
    slope_density_m2ps5: _Positive = 0.01
    """Growth of the variance of this gravity: 0.1 m/s2 in a second."""
    wheel_std_mps: _Positive = 0.03
    """Standard deviation of the speed of a wheel centre relative to the car [m/s]: suspension, yaw rate."""
    use_std: _NotNegative = 0.1
    """Relative standard deviation of the fraction of the friction that a wheel uses: brake pads."""
    use_s: _Positive = 0.1
    """Duration of this error [s]."""
    radius_std: _NotNegative = 0.003
    """Relative standard deviation of the rolling radius: wear and pressure that the car has not learned."""


if TYPE_CHECKING:
    from activesteer.sensors import Sensors

GRID: Final = (10, 41)
"""Number of loads and of slip angles at which the forces of a `KnownTyre` are tabulated."""


@dataclass(frozen=True)
class KnownTyre:
    """Tyre in the model of the estimator: new, upright, on the road of its file."""

    slip_angle_step_rad: float
    load_step_N: float
    force_N: tuple[tuple[float, ...], ...]  # by load and slip angle of `GRID`, mean of both directions, without sign
    relaxation_length_m: float
    slip_stiffness: float  # longitudinal force per slip and load, as all three under the static load
    rolling_radius_m: float

    @property
    def loads_N(self) -> Array:
        """Loads of the grid [N]."""
        return self.load_step_N * np.arange(len(self.force_N), dtype=np.float64)

    def stiffness_at(self, load_N: float) -> float:
        """Return the cornering stiffness under a load [N/rad]."""
        return float(np.interp(load_N, self.loads_N, np.array(self.force_N)[:, 1])) / self.slip_angle_step_rad

    def most_N(self, load_N: float) -> float:
        """Return the largest lateral force under a load [N]."""
        return float(np.interp(load_N, self.loads_N, np.array(self.force_N).max(axis=1)))


@dataclass(frozen=True)
class EstimatorSetup:
    """Input for the creation of an estimator."""

    single_track: SingleTrackParameters
    two_track: TwoTrackParameters
    steering_ratio: float
    tyres: tuple[KnownTyre, KnownTyre]
    drive_fractions: tuple[float, float, float, float]
    brake_torque_per_pressure_NmpPa: tuple[float, float, float, float]
    drag_per_speed2_kgpm: float
    sensors: Sensors

    @property
    def load_shifts_kg(self) -> tuple[float, float]:
        """Load transfer to the outer wheel per lateral acceleration, front and rear [N/(m/s2)]."""
        front = self.two_track.front_load_transfer_fraction
        front_m, rear_m = self.two_track.tracks_m
        moment_kgm = self.single_track.mass_kg * self.two_track.load_height_m
        return moment_kgm * front / front_m, moment_kgm * (1.0 - front) / rear_m

    @property
    def rolling_radius_m(self) -> tuple[float, float, float, float]:
        """Rolling radius of each wheel [m], in the order of `CORNERS`."""
        front, rear = self.tyres
        return front.rolling_radius_m, front.rolling_radius_m, rear.rolling_radius_m, rear.rolling_radius_m

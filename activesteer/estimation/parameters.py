"""Parameters of the estimator; keys of the table [controllers.estimator] in a vehicle file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range

_Positive = Annotated[float, Range(1e-9)]
_NotNegative = Annotated[float, Range(0.0)]


@dataclass(frozen=True)
class EstimatorParameters:
    """How far the estimator trusts its model; what the sensors' data sheets say comes beside."""

    friction: Annotated[float, Range(0.05, 1.5)] = 0.9
    """Friction of the road, relative to that of the tyres' files, until it shows [-]: dry asphalt."""
    friction_std: _Positive = 0.25
    """Standard deviation of that: wet asphalt, 0.6, is not unlikely, snow, 0.3, possible."""
    friction_s: _Positive = 10.0
    """How long what was learned of the friction counts for the road that comes [s]."""
    slip_angle_std_rad: _Positive = math.radians(0.05)
    """Slip angle that an axle has beside what it should: toe, offset of the steering angle sensor [rad]."""
    slip_angle_fraction: _NotNegative = 0.1
    """The same per slip angle: tyres by a tenth softer or harder than when they were new, load, temperature."""
    slip_angle_s: _Positive = 1.0
    """How long that stays so [s]."""
    bank_std_mps2: _Positive = 0.1
    """Gravity along an inclined road, beside the offset of the accelerometer [m/s2]: 1 %."""
    bank_s: _Positive = 10.0
    """How long it stays so [s]."""
    lateral_density_m2ps3: _Positive = 0.0002
    """Spectral density of what is wrong with the lateral acceleration beside the forces: 0.03 m/s2 for 0.1 s."""
    yaw_density_rad2ps3: _Positive = 0.00005
    """Of the yaw acceleration: 0.016 rad/s2 for 0.1 s, aligning moments among it."""
    force_std_N: _NotNegative = 15.0
    """Standard deviation of an axle's force as the model gives it ..."""
    force_fraction: _NotNegative = 0.03
    """... and per force: loads, combined slip, camber."""
    force_s: _Positive = 0.05
    """How long that stays so [s]: between what tyres, 0.02 s, and body, 1/(2 pi 2.2 Hz) = 0.07 s, take to follow. From
    0.0125 to 0.2 s no scenario's RMS error of the sideslip moves by more than 0.03 deg."""
    along_fraction: _NotNegative = 0.2
    """Standard deviation of a wheel's longitudinal force, per force: pads, and roads with two sides."""
    rate_fraction: _NotNegative = 0.005
    """Standard deviation of the yaw rate beside its noise, per value: the sensor leans with the body."""
    ay_fraction: _NotNegative = 0.02
    """The same of the lateral acceleration: the body rolls not quite as a mass on a spring."""
    ax_density_m2ps3: _Positive = 0.004
    """Spectral density of what is wrong with the longitudinal acceleration, as of the lateral one."""
    ax_fraction: _NotNegative = 0.02
    """The same per acceleration and root of a second: the body pitches."""
    slope_std_mps2: _Positive = 0.3
    """Gravity along the road at first [m/s2]: 3 %."""
    slope_density_m2ps5: _Positive = 0.01
    """Growth of the variance of that: 0.1 m/s2 a second."""
    wheel_std_mps: _Positive = 0.03
    """Standard deviation of the speed of a wheel's centre, as seen from the car's [m/s]: suspension, yaw rate."""
    use_std: _NotNegative = 0.1
    """Standard deviation of the fraction of the friction that a wheel uses, as a fraction of it: brake pads."""
    use_s: _Positive = 0.1
    """How long what is wrong with that stays so [s]."""
    radius_std: _NotNegative = 0.003
    """Rolling radius, relative: wear and pressure, as far as the car has not learned them."""

"""Parameters of the controllers beyond the paper's; the files in `models/controllers` give them with their reasons."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range

_Fraction = Annotated[float, Range(0.0, 1.0)]
_Gain = Annotated[float, Range(0.0, 100.0)]
_Scale = Annotated[float, Range(1e-4, 10.0)]
_Limit = Annotated[float, Range(0.0, math.radians(10.0))]
_Lag = Annotated[float, Range(0.001, 1.0)]
_Size = Annotated[float, Range(1.0, 1e6)]
_Rate = Annotated[float, Range(0.01, 100.0)]
_Length = Annotated[float, Range(0.01, 5.0)]


@dataclass(frozen=True)
class ServoParameters:
    """What the servos of both axles can, as `lqr`, `integrated` and `mpc` know it; angles at the road wheels."""

    lag_s: _Lag = 0.025
    """Lag of both [s]."""
    rear_limit_rad: _Limit = math.radians(3.0)
    """Most rear angle [rad]."""
    rear_rate_radps: _Rate = math.radians(28.0)
    """Rate of the rear steering [rad/s]."""
    superposition_limit_rad: _Limit = math.radians(3.0)
    """Most angle added at the front [rad]."""
    superposition_rate_radps: _Rate = math.radians(29.0)
    """Rate of the superposition [rad/s]."""


@dataclass(frozen=True)
class SideslipRearSteerParameters:
    """Rear steering with a sideslip term (`ars_sideslip`); all else is that of [controllers.ars]."""

    sideslip_gain: _Gain = 0.5
    """Rear angle against the sideslip angle [rad/rad]: the rear axle answers to it as if it were stiffer by this
    share."""


@dataclass(frozen=True)
class LqrParameters:
    """Both axles by a linear-quadratic regulator (`lqr`)."""

    yaw_rate_scale_radps: _Scale = math.radians(1.5)
    """Error of the yaw rate that weighs as much as a sideslip or an angle of their scales [rad/s]."""
    sideslip_scale_rad: _Scale = math.radians(0.5)
    """Sideslip angle, likewise [rad]."""
    rear_scale_rad: _Scale = math.radians(2.0)
    """Rear angle, likewise [rad]."""
    superposition_scale_rad: _Scale = math.radians(2.5)
    """Angle added at the front, likewise [rad]."""
    reference_length_m: _Length = 0.86
    """Way over which the desired yaw rate follows the driver [m]."""
    friction_fraction: _Fraction = 0.85
    """Part of the estimated friction that the desired yaw rate may ask for [-]."""
    relaxation_length_m: _Length = 0.8
    """Way over which a tyre builds up its force, in the model [m]."""


@dataclass(frozen=True)
class EscParameters:
    """Stability control by the brakes (`esc`)."""

    yaw_rate_band_radps: _Gain = math.radians(3.0)
    """Error of the yaw rate that is left alone [rad/s]."""
    sideslip_limit_rad: _Limit = math.radians(3.0)
    """Sideslip that is left alone [rad]."""
    yaw_rate_time_s: _Lag = 0.1
    """T_r: time in which a moment takes back the error of the yaw rate [s]."""
    sideslip_time_s: _Lag = 0.2
    """T_b: half the time in which a moment turns the car back by the sideslip beyond its limit, without damping [s]."""
    reference_length_m: _Length = 1.1
    """Way over which the desired yaw rate follows the driver [m]."""
    friction_fraction: _Fraction = 0.9
    """Part of the estimated friction that the desired yaw rate may ask for [-]."""
    torque_limit_Nm: Annotated[float, Range(0.0, 1e4)] = 2000.0
    """Most brake torque of a wheel [Nm]."""
    least_speed_mps: Annotated[float, Range(1.0, 20.0)] = 20.0 / 3.6
    """Speed below which it rests [m/s]."""


@dataclass(frozen=True)
class IntegratedParameters:
    """Allocation to steering and brakes (`integrated`); the feedback is that of [controllers.lqr]."""

    yaw_rate_time_s: _Lag = 0.15
    """T_r: time in which an error of the yaw rate is to fade [s]."""
    sideslip_time_s: _Lag = 0.3
    """T_b: time in which the sideslip is to fade [s]."""
    moment_scale_Nm: _Size = 500.0
    """Yaw moment that is missing and weighs as much as a force, an angle or a brake force of their scales [Nm]."""
    force_scale_N: _Size = 2000.0
    """Side force, likewise [N]."""
    angle_scale_rad: _Scale = math.radians(0.05)
    """s: difference from the angles of the feedback, likewise [rad]."""
    brake_scale_N: _Size = 5000.0
    """F_0: brake force of a wheel, likewise [N]."""
    brake_threshold_Nm: _Size = 2500.0
    """Yaw moment below which what is missing is left to the steering [Nm]."""
    brake_fraction: _Fraction = 0.8
    """Part of the friction under a wheel, standing still, that its brake may use [-]."""
    ahead_s: _Lag = 0.1
    """Time ahead for which the rates of the actuators count [s]."""
    side_difference_Pa: Annotated[float, Range(0.0, 1e8)] = 3e6
    """Brake pressure by which one side may exceed the other beyond what the anti-lock system leaves to the driver, of a
    car that does as it should [Pa]."""
    side_yaw_rate_radps: _Scale = math.radians(4.0)
    """Error of the yaw rate at which nothing of it is left [rad/s]."""
    side_sideslip_rad: _Scale = math.radians(3.0)
    """Sideslip angle, likewise [rad]."""
    tolerance_rad: _Limit = math.radians(0.3)
    """Distance of an actuator from its demand that does not count [rad]."""
    window_s: _Lag = 0.06
    """Time in which an actuator must come nearer to its demand, and as long again until it counts as failed [s]."""


@dataclass(frozen=True)
class MpcParameters:
    """Both axles within an envelope (`mpc`)."""

    yaw_rate_scale_radps: _Scale = math.radians(1.0)
    """Error of the yaw rate that weighs as much as a sideslip, an angle or a change of their scales [rad/s]."""
    sideslip_scale_rad: _Scale = math.radians(0.35)
    """Sideslip angle, likewise [rad]."""
    rear_scale_rad: _Scale = math.radians(2.0)
    """Rear angle away from that of the steady turn, likewise [rad]."""
    superposition_scale_rad: _Scale = math.radians(2.5)
    """Angle added at the front, likewise [rad]."""
    change_scale_rad: _Scale = math.radians(5.0)
    """Change of an angle from one block to the next, likewise [rad]."""
    reference_length_m: _Length = 0.65
    """Way over which the desired yaw rate follows the driver [m]."""
    friction_fraction: _Fraction = 0.85
    """Part of the estimated friction that the desired yaw rate may ask for [-]; all of it is the envelope's bound."""
    relaxation_length_m: _Length = 0.8
    """Way over which an axle builds up its force, in the model [m]."""

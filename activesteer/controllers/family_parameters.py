"""Parameters of the controllers beyond the paper's; the files in `models/controllers` give them with their reasons."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range

_Share = Annotated[float, Range(0.0, 1.0)]
_Gain = Annotated[float, Range(0.0, 100.0)]
_Scale = Annotated[float, Range(1e-4, 10.0)]
_Limit = Annotated[float, Range(0.0, math.radians(10.0))]
_Lag = Annotated[float, Range(0.001, 1.0)]
_Length = Annotated[float, Range(0.01, 5.0)]


@dataclass(frozen=True)
class SideslipRearSteerParameters:
    """Rear steering with a sideslip term (`ars_sideslip`); all else is that of [controllers.ars]."""

    sideslip_gain: _Gain = 0.5
    """Rear angle against the sideslip angle [rad/rad]: the rear axle answers to it as if it were stiffer by this
    share."""


@dataclass(frozen=True)
class LqrParameters:
    """Both axles by a linear-quadratic regulator (`lqr`)."""

    yaw_rate_scale_radps: _Scale = math.radians(3.0)
    """Error of the yaw rate that weighs as much as a sideslip or an angle of their scales [rad/s]."""
    sideslip_scale_rad: _Scale = math.radians(0.5)
    """Sideslip angle, likewise [rad]."""
    rear_scale_rad: _Scale = math.radians(2.0)
    """Rear angle, likewise [rad]."""
    superposition_scale_rad: _Scale = math.radians(2.0)
    """Angle added at the front, likewise [rad]."""
    reference_lag_s: _Lag = 0.03
    """Time constant at which the desired yaw rate follows the driver [s]."""
    friction_share: _Share = 0.85
    """Share of the estimated friction that the desired yaw rate may ask for [-]."""
    actuator_lag_s: _Lag = 0.025
    """Lag of both actuators in the model [s]."""
    relaxation_length_m: _Length = 0.5
    """Way over which a tyre builds up its force, in the model [m]."""
    rear_limit_rad: _Limit = math.radians(3.0)
    """Most rear angle demanded [rad]."""
    superposition_limit_rad: _Limit = math.radians(3.0)
    """Most angle added at the front [rad]."""

"""Gains of the controllers beyond the paper's: types and ranges; `models/controllers/*.toml` has values and reasons."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, TypeVar

from activesteer.config import Range, build, read_toml
from activesteer.errors import ControllerError
from activesteer.resources import find_controller_variant

T = TypeVar("T")
_Fraction = Annotated[float, Range(0.0, 1.0)]
_Gain = Annotated[float, Range(0.0, 100.0)]
_Scale = Annotated[float, Range(1e-4, 10.0)]
_Limit = Annotated[float, Range(0.0, math.radians(10.0))]
_Lag = Annotated[float, Range(0.001, 1.0)]
_Size = Annotated[float, Range(1.0, 1e6)]
_Length = Annotated[float, Range(0.01, 5.0)]


@functools.cache
def file_gains(name: str, gains: type[T]) -> T:
    """Return the gains of a controller from its file in `models/controllers`.

    Args:
        name: Name of the controller, of its file and of the table in it.
        gains: Dataclass of the table.

    Raises:
        ControllerError: a key is missing, unknown or out of range.
    """
    table, source = read_toml(find_controller_variant(name), ControllerError)
    return build(gains, table.get(name, {}), source, (name,))


@dataclass(frozen=True)
class SideslipRearSteerParameters:
    """Rear steering with a sideslip term (`ars_sideslip`); [controllers.ars] gives its other gains."""

    sideslip_gain: _Gain
    """Rear angle against the sideslip angle [rad/rad]: share by which the rear axle becomes stiffer against
    sideslip."""


@dataclass(frozen=True)
class LqrParameters:
    """Both axles by a linear-quadratic regulator (`lqr`).

    A yaw rate error, a sideslip angle and two angles, each as large as its scale, cost the same.
    """

    yaw_rate_scale_radps: _Scale
    """Scale of the yaw rate error [rad/s]."""
    sideslip_scale_rad: _Scale
    """Scale of the sideslip angle [rad]."""
    rear_scale_rad: _Scale
    """Scale of the rear angle [rad]."""
    superposition_scale_rad: _Scale
    """Scale of the superposition angle [rad]."""
    reference_length_m: _Length
    """Distance over which the desired yaw rate follows the driver [m]."""
    friction_fraction: Annotated[float, Range(0.1, 1.5)]
    """Fraction of the estimated friction that the desired yaw rate may use [-]."""
    friction_deviations: Annotated[float, Range(0.0, 10.0)]
    """Standard deviations of the friction that are added to it for this limit [-]: the controller acts on the friction
    only as far as the estimate is certain."""
    against_driver_rad: _Limit
    """Superposition against the driver's angle that is allowed while the friction is unknown [rad]; it grows to the
    limit of the actuator with the certainty of the friction."""
    hold_s: _Lag
    """Time for which the superposition is held against a driver who does not steer back [s]."""
    decay_s: _Lag
    """Time in which it then decays to zero [s]."""
    lacking_radps: _Scale
    """Yaw rate by which the car turns less than desired, from which the superposition is not held against the driver
    [rad/s]."""
    relaxation_length_m: _Length
    """Distance over which a tyre of the model builds up its force [m]."""
    moment_scale_Nm: _Size
    """Scale of a missing yaw moment [Nm]."""
    force_scale_N: _Size
    """Scale of a missing side force [N]."""
    ahead_s: _Lag
    """Time ahead for which the rates of the actuators limit the angles [s]."""
    removal_s: _Lag
    """Time in which an actuator must be able to remove its angle [s]."""


@dataclass(frozen=True)
class EscParameters:
    """Stability control by the brakes (`esc`)."""

    yaw_rate_band_radps: _Gain
    """Yaw rate error that causes no action [rad/s]."""
    sideslip_limit_rad: _Limit
    """Sideslip angle that causes no action [rad]."""
    yaw_rate_time_s: _Lag
    """T_r: time in which the moment removes the yaw rate error [s]."""
    sideslip_time_s: _Lag
    """T_b: half the time in which the moment, without damping, turns the car back by the sideslip angle beyond its
    limit [s]."""
    reference_length_m: _Length
    """Distance over which the desired yaw rate follows the driver [m]."""
    friction_fraction: _Fraction
    """Fraction of the estimated friction that the desired yaw rate may use [-]."""
    acceleration_time_s: _Lag
    """T_a: time in which the lateral acceleration follows the desired yaw rate [s]."""
    acceleration_shortfall_mps2: Annotated[float, Range(0.0, 20.0)]
    """D: lateral acceleration that the turn may lack before the desired yaw rate falls [m/s2]."""
    torque_limit_Nm: Annotated[float, Range(0.0, 1e4)]
    """Largest brake torque at a wheel [Nm]."""
    least_speed_mps: Annotated[float, Range(1.0, 20.0)]
    """Speed below which the controller rests [m/s]."""


@dataclass(frozen=True)
class TorqueVectoringParameters:
    """Torque vectoring by electric axles (`tv`)."""

    yaw_rate_time_s: _Lag
    """T_r: time in which the moment removes the yaw rate error [s]."""
    sideslip_limit_rad: _Limit
    """Sideslip angle that causes no action [rad]."""
    sideslip_time_s: _Lag
    """T_b: half the time in which the moment, without damping, turns the car back by the sideslip angle beyond its
    limit [s]."""
    reference_length_m: _Length
    """Distance over which the desired yaw rate follows the driver [m]."""
    friction_fraction: _Fraction
    """Fraction of the estimated friction that the desired yaw rate, and a wheel in all directions, may use [-]."""
    least_fraction: _Fraction
    """Fraction of the friction that stays for the torque in a turn at the limit [-]."""
    acceleration_time_s: _Lag
    """T_a: time in which the lateral acceleration follows the desired yaw rate [s]."""
    acceleration_shortfall_mps2: Annotated[float, Range(0.0, 20.0)]
    """D: lateral acceleration that the turn may lack before the desired yaw rate falls [m/s2]."""
    full_speed_mps: Annotated[float, Range(2.0, 50.0)]
    """Speed from which the controller acts fully [m/s]; below it fades out until walking speed."""


@dataclass(frozen=True)
class IntegratedParameters:
    """Brakes for what the steering of `lqr` cannot give (`integrated`); [controllers.lqr] gives the feedback.

    A missing moment as large as its scale in [controllers.lqr] and a brake force as large as its scale cost the same.
    """

    KEY_HINTS: ClassVar = {
        **{key: f"now controllers.lqr.{key}" for key in ("moment_scale_Nm", "force_scale_N", "ahead_s")},
        **{key: f"now controllers.esc.{key}" for key in ("yaw_rate_time_s", "sideslip_time_s")},
        "brake_fraction": "the brakes have the limit controllers.esc.torque_limit_Nm",
        "angle_scale_deg": "the angles are those of lqr; see controllers.lqr.superposition_scale_deg",
    }

    brake_scale_N: _Size
    """F_0: scale of the brake force at a wheel [N]."""
    brake_threshold_Nm: _Size
    """Missing yaw moment below which the brakes do nothing [Nm]."""
    brake_side_loss: _Fraction
    """Side force that a fully used tyre loses per brake force [-]."""
    side_difference_Pa: Annotated[float, Range(0.0, 1e8)]
    """Brake pressure difference between the sides for a car without errors, in addition to the difference that the
    anti-lock system leaves to the driver [Pa]."""
    side_yaw_rate_radps: _Scale
    """Yaw rate error at which this pressure difference is zero [rad/s]."""
    side_sideslip_rad: _Scale
    """Sideslip error at which this pressure difference is zero [rad]."""
    tolerance_rad: _Limit
    """Distance of an actuator from its demand that is tolerated [rad]."""
    window_s: _Lag
    """Time in which an actuator must approach its demand; after the same time again it counts as failed [s]."""

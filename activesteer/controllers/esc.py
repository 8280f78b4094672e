"""Electronic stability control with the brakes of individual wheels (FMVSS 126).

S4 of the standard requires brake torques at single wheels that create a yaw moment; yaw rate, sideslip and the driver's
angle as inputs; and operation at all speeds above 20 km/h. Here the moment is

    M_z = J_z / T_r (error beyond its band) + J_z / T_b^2 (sideslip beyond its limit)

with the error of the yaw rate, desired minus actual. The controller acts only as far as the estimate is certain: the
friction that limits the desired yaw rate includes its standard deviation, and the limit of the sideslip angle is at
least six of its deviations. A turn at the measured acceleration, r = a_y / v, is never limited. The outer front wheel
creates a moment against the turn (oversteer), which also lowers its side force. The inner rear wheel creates a moment
with the turn (understeer):

    brake torque = |M_z| rolling radius / (half the track)

During an intervention the drive force is reduced by the brake force. The anti-lock system prevents locking.

Sources: 49 CFR 571.126 S4; A. van Zanten, Bosch ESP Systems: 5 Years of Experience, SAE 2000-01-1633. Band, limit and
times are our choice.
"""

from __future__ import annotations

from activesteer.controllers.corrector import MIN_SPEED_MPS
from activesteer.controllers.parameters import ControllerSetup, EscParameters
from activesteer.controllers.turn_reference import BorneTurnReference
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement


class Esc:
    """Stability control that creates yaw moments with the brakes."""

    interval_s = 0.005
    reads = ("esc", "estimator")
    gains = EscParameters

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one run."""
        self._parameters, self._estimator = setup.gains.esc, setup.estimator()
        self._reference = BorneTurnReference(setup.single_track, self._parameters, setup.timestep_s, reserve=False)
        self._yaw_inertia_kgm2, self._levers = setup.single_track.yaw_inertia_kgm2, brake_levers(setup)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the brake torques for the current yaw rate error and sideslip angle."""
        p, now = self._parameters, self._estimator.step(measurement)
        if now.speed_mps < MIN_SPEED_MPS:
            return ActuatorCommand(estimate=now)
        friction = now.friction + p.friction_deviations * now.friction_std
        desired = self._reference.borne(command.front_steer_demand_rad, now.speed_mps, friction, measurement.ay_mps2)
        if now.speed_mps < p.least_speed_mps:
            return ActuatorCommand(yaw_rate_desired_radps=desired, estimate=now)
        limit_rad = max(p.sideslip_limit_rad, p.sideslip_deviations * now.sideslip_std_rad)
        demand = stabilising(p, desired - now.yaw_rate_radps, beyond(now.sideslip_rad, limit_rad))
        moment = self._yaw_inertia_kgm2 * demand
        torques = wheel_torques(moment, now.yaw_rate_radps, self._levers, p.torque_limit_Nm)
        braked = max(torques)  # of the only wheel that brakes
        limited = braked >= p.torque_limit_Nm
        change = -min(max(command.drive_torque_demand_Nm, 0.0), braked)
        return ActuatorCommand(
            yaw_rate_desired_radps=desired,
            saturated=limited,
            brake_torque_demand_Nm=torques,
            drive_torque_change_Nm=change,
            estimate=now,
        )


def beyond(value: float, band: float) -> float:
    """Return the part of a value that is beyond a dead band around 0."""
    return value - band if value > band else value + band if value < -band else 0.0


def stabilising(p: EscParameters, error_radps: float, slide_rad: float) -> float:
    """Return the demanded yaw acceleration M_z / J_z, with the sideslip angle beyond its limit [rad/s2]."""
    return beyond(error_radps, p.yaw_rate_band_radps) / p.yaw_rate_time_s + slide_rad / p.sideslip_time_s**2


def brake_levers(setup: ControllerSetup) -> tuple[float, float]:
    """Return the brake torque of one wheel per yaw moment: rolling radius per half the track, front and rear [-]."""
    known = setup.estimation
    assert known is not None  # an estimator exists
    front_m, _, rear_m, _ = known.rolling_radius_m
    front_track_m, rear_track_m = known.two_track.tracks_m
    return 2.0 * front_m / front_track_m, 2.0 * rear_m / rear_track_m


def wheel_torques(
    moment_Nm: float, yaw_rate_radps: float, levers: tuple[float, float], limit_Nm: float
) -> tuple[float, float, float, float]:
    """Return the brake torques that create a yaw moment, left positive, with one wheel, in `CORNERS` order [Nm]."""
    front = moment_Nm * yaw_rate_radps <= 0.0
    torque = min(abs(moment_Nm) * levers[0 if front else 1], limit_Nm)
    # A brake on the left turns the car to the left.
    if moment_Nm > 0.0:
        return (torque, 0.0, 0.0, 0.0) if front else (0.0, 0.0, torque, 0.0)
    return (0.0, torque, 0.0, 0.0) if front else (0.0, 0.0, 0.0, torque)

"""The desired turn, limited by the friction, and a monitor of the estimator that provides the friction."""

from __future__ import annotations

import math

from activesteer.controllers.parameters import ControllerSetup, YawMomentParameters
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.estimation.records import AVERAGED_S, EXPLAINED, UNEXPLAINED
from activesteer.native.records import NativeBlock
from activesteer.native.shared_laws import shared
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters, yaw_rate_gain


class TurnReference(NativeBlock):
    """Desired yaw rate (eqs. 3 and 6) with the estimated friction, behind a first-order lag.

    The lag is a distance, like the lag of the tyres: at twice the speed the car responds in half the time. At low speed
    it is at most the longest lag of the single-track model, so that the car does not respond later than without
    control.
    """

    _single_track: SingleTrack
    _length_m: float
    _longest_s: float
    _interval_s: float
    _most_mps2: float
    _lagged_rad: float
    _driver_rad: float
    _speed_mps: float
    _limit_radps: float

    def __init__(
        self, single_track: SingleTrackParameters, length_m: float, friction_fraction: float, interval_s: float
    ) -> None:
        """Compute the constants, with `length_m` as the distance over which the yaw rate follows the driver."""
        self._single_track = SingleTrack(single_track)
        self._length_m, self._longest_s = length_m, self._single_track.longest_lag_s()
        self._interval_s = interval_s
        self._most_mps2 = friction_fraction * GRAVITY_MPS2
        self._lagged_rad = self._driver_rad = self._speed_mps = self._limit_radps = 0.0


@shared
def desired_turn(block: TurnReference, front_steer_rad: float, speed_mps: float, friction: float) -> float:
    """Return the desired yaw rate for the driver's angle at the road wheel, a speed > 0 and a friction [rad/s]."""
    block._driver_rad, block._speed_mps = front_steer_rad, speed_mps
    block._limit_radps = block._most_mps2 * friction / speed_mps
    block._lagged_rad = _followed(block, block._interval_s)
    return _desired(block, block._lagged_rad)


@shared
def desired_ahead(block: TurnReference, duration_s: float) -> float:
    """Return the desired yaw rate after a time, for a constant driver's angle and speed [rad/s]."""
    return _desired(block, _followed(block, duration_s))


@shared
def _followed(block: TurnReference, duration_s: float) -> float:
    lag_s = min(block._length_m / block._speed_mps, block._longest_s)
    fraction = -math.expm1(-duration_s / lag_s)
    return block._lagged_rad + fraction * (block._driver_rad - block._lagged_rad)


@shared
def _desired(block: TurnReference, angle_rad: float) -> float:
    desired = yaw_rate_gain(block._single_track, block._speed_mps) * angle_rad
    return min(max(desired, -block._limit_radps), block._limit_radps)


class BorneTurnReference(TurnReference):
    """Desired yaw rate that falls if the measured lateral acceleration is too small for it.

    A car turns at a_y / v while its sideslip angle is constant; any faster rotation is growing sideslip. If the
    measured |a_y| is short of v |r*| by more than D, the desired yaw rate r* falls by the rest over v, at most to zero.
    The compared r* passes a lag T_a, and does not exceed the current r*. Without this rule, a yaw moment turns a car
    whose front wheels have reached ice further in, and the car slides when its rear wheels reach the ice too: the
    estimated friction comes late, and it is one number for both axles.

    Source: R. Rajamani, Vehicle Dynamics and Control, 2012, section 8.3.3, on a_y = v (r + d beta/dt) and the desired
    yaw rate.
    """

    def __init__(
        self,
        single_track: SingleTrackParameters,
        parameters: YawMomentParameters,
        interval_s: float,
        *,
        reserve: bool = True,
    ) -> None:
        """Compute the constants; with `reserve`, `friction_fraction` limits a turn at the measured acceleration too."""
        super().__init__(single_track, parameters.reference_length_m, parameters.friction_fraction, interval_s)
        self._shown_mps2 = GRAVITY_MPS2 if reserve else self._most_mps2
        self._fraction = -math.expm1(-interval_s / parameters.acceleration_time_s)
        self._shortfall_mps2 = parameters.acceleration_shortfall_mps2
        self._expected_radps = 0.0

    def borne(self, front_steer_rad: float, speed_mps: float, friction: float, ay_mps2: float) -> float:
        """Return the desired yaw rate for a speed > 0 and a measured lateral acceleration, left positive [rad/s]."""
        # The road bears the present acceleration. Where wheels leave snow, the estimated friction comes later.
        shown = max(friction, abs(ay_mps2) / self._shown_mps2)
        desired_radps = desired_turn(self, front_steer_rad, speed_mps, shown)
        self._expected_radps += self._fraction * (desired_radps - self._expected_radps)
        side = math.copysign(1.0, self._expected_radps)
        # What has fallen meanwhile, by the friction or by the driver, does not fall twice.
        expected_radps = min(side * self._expected_radps, side * desired_radps)
        missing_mps2 = speed_mps * expected_radps - side * ay_mps2 - self._shortfall_mps2
        fall_radps = max(missing_mps2, 0.0) / speed_mps
        return side * max(side * desired_radps - fall_radps, min(side * desired_radps, 0.0))


_FALL_S, _RISE_S = 0.3, 2.0
"""Times in which the authority falls from 1 to 0, and rises again [s]."""


class ConfidenceMonitor(NativeBlock):
    """Monitor of an estimator's friction and innovations."""

    _prior: float
    _fraction: float
    _fall: float
    _rise: float
    _mean: float
    _authority: float

    def __init__(self, setup: ControllerSetup) -> None:
        """Compute the constants of the monitor."""
        self._prior = setup.gains.estimator.friction_std
        self._fraction = -math.expm1(-setup.timestep_s / AVERAGED_S)
        self._fall, self._rise = setup.timestep_s / _FALL_S, setup.timestep_s / _RISE_S
        self._mean, self._authority = 0.0, 1.0


@shared
def confidence(block: ConfidenceMonitor, innovation: float, friction_std: float) -> tuple[float, float]:
    """Return the confidence in the friction and in the model, 0 to 1 each."""
    # The first is the part of the variance of the assumed friction that the measurements have removed. The second is a
    # factor on the demands of the controller: 1 while the model explains the car.
    block._mean += block._fraction * (innovation - block._mean)
    if block._mean > EXPLAINED or block._authority < 1.0:
        wanted = min(max((UNEXPLAINED - block._mean) / (UNEXPLAINED - EXPLAINED), 0.0), 1.0)
        block._authority += min(max(wanted - block._authority, -block._fall), block._rise)
    left = friction_std / block._prior
    known = 1.0 - left * left
    return known if known > 0.0 else 0.0, block._authority

"""Corrector for the yaw rate error: desired yaw rate, tolerance function, PID, and direction of the angle."""

from __future__ import annotations

import math
from typing import Final

from activesteer.controllers.parameters import CorrectorParameters, DesiredYawRateParameters
from activesteer.native.records import NativeBlock
from activesteer.native.shared_laws import shared
from activesteer.theory.single_track import SingleTrack, yaw_rate_gain
from activesteer.theory.tolerance import tolerance


@shared
def rear_direction(error_radps: float) -> int:
    """Return the direction of the rear wheels: 1 left, -1 right, or 0.

    The front wheels turn the other way.

    With oversteer, the error of desired minus actual yaw rate has the sign against the turn, and the rear wheels turn
    in the direction of the yaw rate; with understeer they turn against it.

    Source: Dorsch 2012, Table I and Fig. 10.
    """
    if error_radps == 0.0:
        return 0
    return 1 if error_radps < 0.0 else -1


@shared
def cut_off(angle_rad: float, limit_rad: float) -> tuple[float, int]:
    """Limit an angle to either side [rad], and return the side of the active limit: 1, -1, or 0 for none."""
    if angle_rad > limit_rad:
        return limit_rad, 1
    if angle_rad < -limit_rad:
        return -limit_rad, -1
    return angle_rad, 0


class Corrector(NativeBlock):
    """PID controller for the yaw rate error beyond the tolerance band.

    With only the proportional gain it is the P corrector of the paper. The integral stops growing towards an active
    limit, and it fades with the tolerance function.
    """

    _deadband_start_radps: float
    _deadband_end_radps: float
    _proportional_gain_s: float
    _integral_fraction: float
    _derivative_fraction_s: float
    _filter_fraction: float
    _integral_rad: float
    _filtered_radps: float

    def __init__(self, parameters: CorrectorParameters, timestep_s: float) -> None:
        """Create the feedback of one run.

        Args:
            parameters: Gains and tolerance band.
            timestep_s: Time between two steps [s].
        """
        p = parameters
        self._deadband_start_radps, self._deadband_end_radps = p.deadband_start_radps, p.deadband_end_radps
        self._proportional_gain_s = p.proportional_gain_s
        self._integral_fraction = p.integral_gain * timestep_s
        self._derivative_fraction_s = p.derivative_gain_s2 / timestep_s
        self._filter_fraction = 1.0 - math.exp(-timestep_s / p.derivative_filter_s)
        self._integral_rad = 0.0
        self._filtered_radps = math.nan  # before the first error

    def step(self, error_radps: float, saturated: int = 0) -> float:
        """Return the angle of the corrector [rad].

        With only the proportional term it has the sign of the error.

        Args:
            error_radps: Desired minus actual yaw rate [rad/s].
            saturated: Active limit: 1 if a larger angle is cut off, -1 if a smaller angle is, otherwise 0. The integral
                then moves away from the limit only.
        """
        return corrected(self, error_radps, saturated)

    def reset(self) -> None:
        """Reset integral and derivative, for example while active steering is inactive."""
        reset(self)


shared(tolerance)


@shared
def corrected(block: Corrector, error_radps: float, saturated: int) -> float:
    """Computation of `Corrector.step`."""
    activity = tolerance(error_radps, block._deadband_start_radps, block._deadband_end_radps)
    angle = block._proportional_gain_s * error_radps
    if block._integral_fraction:
        if saturated * error_radps <= 0.0:
            block._integral_rad += block._integral_fraction * error_radps * activity
        angle += block._integral_rad
    if block._derivative_fraction_s:
        before = error_radps if math.isnan(block._filtered_radps) else block._filtered_radps
        block._filtered_radps = before + block._filter_fraction * (error_radps - before)
        angle += block._derivative_fraction_s * (block._filtered_radps - before)
    return activity * angle


@shared
def reset(block: Corrector) -> None:
    """Computation of `Corrector.reset`."""
    block._integral_rad = 0.0
    block._filtered_radps = math.nan


MIN_SPEED_MPS: Final = 3.0
"""Speed below which active steering is inactive, and the friction limit of the desired yaw rate is constant [m/s]."""


class DesiredYawRate(NativeBlock):
    """Desired yaw rate (eqs. 3 and 6) behind a first-order lag, discretised exactly.

    Source: Dorsch 2012, section V.
    """

    _single_track: SingleTrack
    _limit_mps2: float
    _fraction: float
    _state_radps: float

    def __init__(self, single_track: SingleTrack, parameters: DesiredYawRateParameters, timestep_s: float) -> None:
        """Compute the constants.

        Args:
            single_track: The reference model.
            parameters: Limit and delay.
            timestep_s: Time between two steps [s].
        """
        self._single_track = single_track
        self._limit_mps2 = parameters.max_lateral_acceleration_mps2
        self._fraction = 1.0 - math.exp(-timestep_s / parameters.delay_s)
        self._state_radps = 0.0

    def step(self, front_steer_rad: float, speed_mps: float) -> float:
        """Return the desired yaw rate, left positive [rad/s].

        Args:
            front_steer_rad: The driver's demand at the road wheel [rad].
            speed_mps: Speed [m/s]; negative backwards.
        """
        return desired_yaw_rate(self, front_steer_rad, speed_mps)


@shared
def desired_yaw_rate(block: DesiredYawRate, front_steer_rad: float, speed_mps: float) -> float:
    """Computation of `DesiredYawRate.step`: the lagged desired yaw rate."""
    target = yaw_rate_gain(block._single_track, speed_mps) * front_steer_rad
    limit = block._limit_mps2 / (speed_mps if speed_mps > MIN_SPEED_MPS else MIN_SPEED_MPS)
    if target > limit:
        target = limit
    elif target < -limit:
        target = -limit
    # The lag has followed the input held until now; the new demand acts from this instant.
    desired = block._state_radps
    block._state_radps += block._fraction * (target - desired)
    return desired

"""The desired yaw rate: steady state of the single-track model, friction limit, delay."""

from __future__ import annotations

import math
from typing import Final

from activesteer.controllers.parameters import DesiredYawRateParameters
from activesteer.native_blocks import NativeBlock
from activesteer.shared_laws import shared
from activesteer.theory.single_track import SingleTrack, yaw_rate_gain

MIN_SPEED_MPS: Final = 3.0
"""Below this speed active steering rests, and the friction limit of the desired yaw rate is constant [m/s]."""


class DesiredYawRate(NativeBlock):
    """Desired yaw rate, eqs. 3 and 6, behind a first-order lag, exact for an input that is held between steps.

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
    """Law of `DesiredYawRate.step`."""
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

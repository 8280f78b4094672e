"""The yaw rate that the driver asks for: single-track steady state, friction limit, delay."""

from __future__ import annotations

import math
from typing import Final

from activesteer.controllers.parameters import DesiredYawRateParameters
from activesteer.theory.single_track import SingleTrack

MIN_SPEED_MPS: Final = 3.0
"""Below this speed active steering rests, and the friction limit of the desired yaw rate rises no further [m/s]."""


class DesiredYawRate:
    """Desired yaw rate, eqs. 3 and 6, behind a first-order lag (exact for an input held between steps).

    Source: Dorsch 2012, section V.
    """

    def __init__(self, single_track: SingleTrack, parameters: DesiredYawRateParameters, timestep_s: float) -> None:
        """Computes the constants.

        Args:
            single_track: The reference model.
            parameters: Limit and delay.
            timestep_s: Time between two steps [s].
        """
        self._single_track = single_track
        self._limit_mps2 = parameters.max_lateral_acceleration_mps2
        self._share = 1.0 - math.exp(-timestep_s / parameters.delay_s)
        self._state_radps = 0.0

    def step(self, front_steer_rad: float, speed_mps: float) -> float:
        """The desired yaw rate now.

        Args:
            front_steer_rad: The driver's demand at the road wheel [rad].
            speed_mps: Speed [m/s]; negative backwards.

        Returns:
            Desired yaw rate [rad/s], left positive.
        """
        wanted = self._single_track.yaw_rate_gain(speed_mps) * front_steer_rad
        limit = self._limit_mps2 / (speed_mps if speed_mps > MIN_SPEED_MPS else MIN_SPEED_MPS)
        if wanted > limit:
            wanted = limit
        elif wanted < -limit:
            wanted = -limit
        # The lag answers to what was held until now: its value at this instant, before the new demand works on it.
        desired = self._state_radps
        self._state_radps += self._share * (wanted - desired)
        return desired

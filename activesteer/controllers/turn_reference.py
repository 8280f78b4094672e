"""The turn that a driver asks for: the car's own steady yaw rate, no further than the friction gives."""

from __future__ import annotations

import math

from activesteer.conventions import GRAVITY_MPS2
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters


class TurnReference:
    """Desired yaw rate, eqs. 3 and 6 with the estimated friction, behind a first-order lag of the driver's angle.

    The lag is a way, as that of the tyres is: at twice the speed the car answers in half the time.
    """

    def __init__(
        self, single_track: SingleTrackParameters, length_m: float, friction_fraction: float, interval_s: float
    ) -> None:
        """Computes the constants.

        Args:
            single_track: The car as it is known.
            length_m: Way over which the driver is followed [m].
            friction_fraction: Part of the friction that may be asked for [-].
            interval_s: Time between two steps [s].
        """
        self._gain = SingleTrack(single_track).yaw_rate_gain
        self._length_m, self._interval_s = length_m, interval_s
        self._most_mps2 = friction_fraction * GRAVITY_MPS2
        self._asked_rad = self._driver_rad = self._speed_mps = self._limit_radps = 0.0

    def step(self, front_steer_rad: float, speed_mps: float, friction: float) -> float:
        """The desired yaw rate now [rad/s].

        Args:
            front_steer_rad: The driver's angle at the road wheel [rad].
            speed_mps: Speed > 0 [m/s].
            friction: Friction of the road [-].
        """
        self._driver_rad, self._speed_mps = front_steer_rad, speed_mps
        self._limit_radps = self._most_mps2 * friction / speed_mps
        self._asked_rad = self._followed(self._interval_s)
        return self._desired(self._asked_rad)

    def ahead(self, duration_s: float) -> float:
        """The desired yaw rate a while after that, if driver and speed stay as they are [rad/s]."""
        return self._desired(self._followed(duration_s))

    def _followed(self, duration_s: float) -> float:
        share = -math.expm1(-duration_s * self._speed_mps / self._length_m)
        return self._asked_rad + share * (self._driver_rad - self._asked_rad)

    def _desired(self, asked_rad: float) -> float:
        desired = self._gain(self._speed_mps) * asked_rad
        return min(max(desired, -self._limit_radps), self._limit_radps)

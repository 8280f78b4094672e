"""The desired turn: the car's own steady-state yaw rate, limited by the friction."""

from __future__ import annotations

import math

from activesteer.conventions import GRAVITY_MPS2
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters


class TurnReference:
    """Desired yaw rate, eqs. 3 and 6 with the estimated friction, behind a first-order lag of the driver's angle.

    The lag is a distance, like the lag of the tyres: at twice the speed the car answers in half the time.
    """

    def __init__(
        self, single_track: SingleTrackParameters, length_m: float, friction_fraction: float, interval_s: float
    ) -> None:
        """Compute the constants.

        Args:
            single_track: The known car.
            length_m: Distance over which the yaw rate follows the driver [m].
            friction_fraction: Fraction of the friction that may be used [-].
            interval_s: Time between two steps [s].
        """
        self._gain = SingleTrack(single_track).yaw_rate_gain
        self._length_m, self._interval_s = length_m, interval_s
        self._most_mps2 = friction_fraction * GRAVITY_MPS2
        self._lagged_rad = self._driver_rad = self._speed_mps = self._limit_radps = 0.0

    def step(self, front_steer_rad: float, speed_mps: float, friction: float) -> float:
        """Return the desired yaw rate [rad/s].

        Args:
            front_steer_rad: The driver's angle at the road wheel [rad].
            speed_mps: Speed > 0 [m/s].
            friction: Friction of the road [-].
        """
        self._driver_rad, self._speed_mps = front_steer_rad, speed_mps
        self._limit_radps = self._most_mps2 * friction / speed_mps
        self._lagged_rad = self._followed(self._interval_s)
        return self._desired(self._lagged_rad)

    def ahead(self, duration_s: float) -> float:
        """Return the desired yaw rate after a time, for a constant driver's angle and speed [rad/s]."""
        return self._desired(self._followed(duration_s))

    def _followed(self, duration_s: float) -> float:
        fraction = -math.expm1(-duration_s * self._speed_mps / self._length_m)
        return self._lagged_rad + fraction * (self._driver_rad - self._lagged_rad)

    def _desired(self, angle_rad: float) -> float:
        desired = self._gain(self._speed_mps) * angle_rad
        return min(max(desired, -self._limit_radps), self._limit_radps)

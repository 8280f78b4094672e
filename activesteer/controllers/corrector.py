"""From the yaw rate error to a steer angle: tolerance function, PID, and the decision which way to turn."""

from __future__ import annotations

import math
from enum import Enum
from typing import Final, NamedTuple

from activesteer.controllers.parameters import CorrectorParameters
from activesteer.theory.tolerance import tolerance


class Situation(Enum):
    """What the car does compared with what the driver asks."""

    NEUTRAL = "neutral"
    OVERSTEER = "oversteer"
    UNDERSTEER = "understeer"


class Decision(NamedTuple):
    """Which way the corrector turns the wheels: +1 left, -1 right, 0 not at all."""

    situation: Situation
    rear: int
    front: int


_NEUTRAL: Final = Decision(Situation.NEUTRAL, rear=0, front=0)
# Table I: oversteer turns the rear wheels the way the car turns and the front ones against it, understeer the reverse.
_LEFT_OVERSTEER: Final = Decision(Situation.OVERSTEER, rear=1, front=-1)
_LEFT_UNDERSTEER: Final = Decision(Situation.UNDERSTEER, rear=-1, front=1)
_RIGHT_OVERSTEER: Final = Decision(Situation.OVERSTEER, rear=-1, front=1)
_RIGHT_UNDERSTEER: Final = Decision(Situation.UNDERSTEER, rear=1, front=-1)


def decide(yaw_rate_radps: float, error_radps: float) -> Decision:
    """Orientation of the additional steer angles.

    With the error defined as desired minus actual it comes out as: rear against the error, front with it, whichever way
    the car turns.

    Args:
        yaw_rate_radps: Yaw rate, left positive [rad/s].
        error_radps: Desired less actual yaw rate [rad/s], or the corrector's answer to it.

    Returns:
        The situation and both orientations.

    Source: Dorsch 2012, Table I and Fig. 10.
    """
    if error_radps == 0.0:
        return _NEUTRAL
    if yaw_rate_radps >= 0.0:
        return _LEFT_OVERSTEER if error_radps < 0.0 else _LEFT_UNDERSTEER
    return _RIGHT_OVERSTEER if error_radps > 0.0 else _RIGHT_UNDERSTEER


def cut_off(angle_rad: float, limit_rad: float) -> tuple[float, int]:
    """An angle within a limit to either side [rad], and which side cut it off: 1, -1, or 0 for none."""
    if angle_rad > limit_rad:
        return limit_rad, 1
    if angle_rad < -limit_rad:
        return -limit_rad, -1
    return angle_rad, 0


class Corrector:
    """PID on the yaw rate error behind the tolerance function; the size of the angle, without its orientation.

    With all gains but the proportional one at zero it is the paper's P corrector. The integral grows no further into a
    limit that is active, and it fades with the tolerance function.
    """

    def __init__(self, parameters: CorrectorParameters, timestep_s: float) -> None:
        """Makes the feedback of one run.

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
        self._filtered_radps: float | None = None

    def step(self, error_radps: float, saturated: int = 0) -> float:
        """Signed angle of the corrector; of the sign of the error where P acts alone.

        Args:
            error_radps: Desired less actual yaw rate [rad/s].
            saturated: Whether a limit is active: 1 where a larger angle would be cut off, -1 where a smaller one would
                be, 0 elsewhere. The integral then moves the other way only.

        Returns:
            Angle [rad].
        """
        activity = tolerance(error_radps, self._deadband_start_radps, self._deadband_end_radps)
        angle = self._proportional_gain_s * error_radps
        if self._integral_fraction:
            if saturated * error_radps <= 0.0:
                self._integral_rad += self._integral_fraction * error_radps * activity
            angle += self._integral_rad
        if self._derivative_fraction_s:
            before = error_radps if self._filtered_radps is None else self._filtered_radps
            self._filtered_radps = before + self._filter_fraction * (error_radps - before)
            angle += self._derivative_fraction_s * (self._filtered_radps - before)
        return activity * angle

    def reset(self) -> None:
        """Forgets integral and derivative, as where active steering rests."""
        self._integral_rad = 0.0
        self._filtered_radps = None

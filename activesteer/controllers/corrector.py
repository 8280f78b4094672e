"""From the yaw rate error to a steer angle: tolerance function, PID, and the direction of the angle."""

from __future__ import annotations

import math
from enum import Enum
from typing import Final, NamedTuple

from activesteer.controllers.parameters import CorrectorParameters
from activesteer.theory.tolerance import tolerance


class Situation(Enum):
    """Behaviour of the car compared with the driver's demand."""

    NEUTRAL = "neutral"
    OVERSTEER = "oversteer"
    UNDERSTEER = "understeer"


class Decision(NamedTuple):
    """Directions in which the corrector turns the wheels: +1 left, -1 right, 0 not at all."""

    situation: Situation
    rear: int
    front: int


_NEUTRAL: Final = Decision(Situation.NEUTRAL, rear=0, front=0)
# Table I: with oversteer the rear wheels turn in the direction of the yaw rate and the front wheels against it; with
# understeer vice versa.
_LEFT_OVERSTEER: Final = Decision(Situation.OVERSTEER, rear=1, front=-1)
_LEFT_UNDERSTEER: Final = Decision(Situation.UNDERSTEER, rear=-1, front=1)
_RIGHT_OVERSTEER: Final = Decision(Situation.OVERSTEER, rear=-1, front=1)
_RIGHT_UNDERSTEER: Final = Decision(Situation.UNDERSTEER, rear=1, front=-1)


def decide(yaw_rate_radps: float, error_radps: float) -> Decision:
    """Return the directions of the additional steer angles.

    For an error of desired less actual yaw rate, the rear wheels turn against the sign of the error and the front
    wheels with it, in turns to both sides.

    Args:
        yaw_rate_radps: Yaw rate, left positive [rad/s].
        error_radps: Desired less actual yaw rate [rad/s], or the angle of the corrector.

    Source: Dorsch 2012, Table I and Fig. 10.
    """
    if error_radps == 0.0:
        return _NEUTRAL
    if yaw_rate_radps >= 0.0:
        return _LEFT_OVERSTEER if error_radps < 0.0 else _LEFT_UNDERSTEER
    return _RIGHT_OVERSTEER if error_radps > 0.0 else _RIGHT_UNDERSTEER


def cut_off(angle_rad: float, limit_rad: float) -> tuple[float, int]:
    """Return an angle limited to either side [rad], and the side of the active limit: 1, -1, or 0 for none."""
    if angle_rad > limit_rad:
        return limit_rad, 1
    if angle_rad < -limit_rad:
        return -limit_rad, -1
    return angle_rad, 0


class Corrector:
    """PID on the yaw rate error behind the tolerance function.

    With the proportional gain alone it is the P corrector of the paper. The integral stops growing towards an active
    limit, and it fades with the tolerance function.
    """

    def __init__(self, parameters: CorrectorParameters, timestep_s: float) -> None:
        """Make the feedback of one run.

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
        """Return the angle of the corrector [rad]; with P alone it has the sign of the error.

        Args:
            error_radps: Desired less actual yaw rate [rad/s].
            saturated: Active limit: 1 if a larger angle is cut off, -1 if a smaller angle is, otherwise 0. The integral
                then moves away from the limit only.
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
        """Reset integral and derivative, as while active steering rests."""
        self._integral_rad = 0.0
        self._filtered_radps = None

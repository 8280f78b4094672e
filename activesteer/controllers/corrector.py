"""From the yaw rate error to a steer angle: tolerance function, PID, and the decision which way to turn."""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

from activesteer.controllers.parameters import CorrectorParameters


def tolerance(error_radps: float, off_radps: float, full_radps: float) -> float:
    """How much of the corrector is active: 0 up to c_off, 1 from c_in, a smooth cubic between (Fig. 9).

    Args:
        error_radps: Yaw rate error, either sign [rad/s].
        off_radps: c_off [rad/s].
        full_radps: c_in [rad/s].

    Returns:
        Activity, 0 to 1.

    Source: Dorsch 2012, Fig. 9; the cubic is ours, the figure shows no formula.
    """
    size = error_radps if error_radps >= 0.0 else -error_radps
    if size <= off_radps:
        return 0.0
    if size >= full_radps:
        return 1.0
    x = (size - off_radps) / (full_radps - off_radps)
    return x * x * (3.0 - 2.0 * x)


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


def decide(yaw_rate_radps: float, error_radps: float) -> Decision:
    """Orientation of the additional steer angles.

    Oversteer turns the rear wheels the way the car turns and the front wheels against it; understeer the reverse. With the
    error defined as desired minus actual this comes out as: rear against the error, front with it, whichever way the car turns.

    Args:
        yaw_rate_radps: Yaw rate, left positive [rad/s].
        error_radps: Desired less actual yaw rate [rad/s], or the corrector's answer to it.

    Returns:
        The situation and both orientations.

    Source: Dorsch 2012, Table I and Fig. 10.
    """
    if error_radps == 0.0:
        return Decision(Situation.NEUTRAL, 0, 0)
    turn = 1 if yaw_rate_radps >= 0.0 else -1
    if error_radps * turn < 0.0:
        return Decision(Situation.OVERSTEER, turn, -turn)
    return Decision(Situation.UNDERSTEER, -turn, turn)


class Corrector:
    """PID on the yaw rate error behind the tolerance function; the size of the angle, without its orientation.

    With all gains but the proportional one at zero it is the paper's P corrector. The integral stands still while the
    angle is at its limit, and it fades with the tolerance function.
    """

    def __init__(self, parameters: CorrectorParameters, timestep_s: float) -> None:
        """Takes gains.

        Args:
            parameters: Gains and tolerance band.
            timestep_s: Time between two steps [s].
        """
        self._p = parameters
        self._timestep_s = timestep_s
        self._filter_share = 1.0 - math.exp(-timestep_s / parameters.derivative_filter_s)
        self._integral_rad = 0.0
        self._filtered_radps: float | None = None

    def step(self, error_radps: float, *, hold_integral: bool = False) -> float:
        """Signed angle of the corrector, with the sign of the error.

        Args:
            error_radps: Desired less actual yaw rate [rad/s].
            hold_integral: Whether the integral must not grow, because a limit is active.

        Returns:
            Angle [rad].
        """
        p = self._p
        activity = tolerance(error_radps, p.off_radps, p.full_radps)
        angle = p.proportional_gain_s * error_radps
        if p.integral_gain:
            if not hold_integral:
                self._integral_rad += p.integral_gain * error_radps * activity * self._timestep_s
            angle += self._integral_rad
        if p.derivative_gain_s2:
            before = error_radps if self._filtered_radps is None else self._filtered_radps
            self._filtered_radps = before + self._filter_share * (error_radps - before)
            angle += p.derivative_gain_s2 * (self._filtered_radps - before) / self._timestep_s
        return activity * angle

"""Torque of an engine at its driven wheels, in the gear that suits the speed best.

The driver always uses the gear with the highest torque. Over all gears that is a constant torque, the first gear's, up
to the speed at which the engine reaches its highest power, and constant power above:

    T(u) = min(T_max, P / u)          u: mean speed of the driven wheels in the direction of the gear

The mean counts because a differential passes on equal torques and turns with the mean of the speeds behind it; so power
in is power out, whatever a single wheel does. At the speed limit (top gear, rev limiter) the torque fades to zero. With
the throttle released, the engine drags. The gear scales its drag as it does its torque, T_drag(u) = T_drag min(1, P /
(T_max u)), and near standstill the clutch opens. Against the gear, as when rolling back on a hill, the clutch slips:
the drive pulls with up to T_max and does not drag.

Engine and gears turn with the driven wheels and increase their inertia, except while the clutch is open.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from numba import types

from activesteer.compilation import compiled, compiled_call
from activesteer.shared_laws import shared
from activesteer.vehicle.parameters import Powertrain

CLUTCH_OPEN: Final = 0
"""The gear in which the engine is disconnected from the wheels, whose torques then do not depend on the engine."""

_FADE: Final = 0.02
"""Fraction of the speed limit over which the torque fades to zero."""
_CLUTCH_SLIPS_radps: Final = 6.0
"""Speed of the wheels below which the clutch slips, and the drag of the engine falls with the speed [rad/s]: that of
idling at 800 1/min in first gear."""


@compiled
def drive_limits(
    speed_radps: float, gear: int, torque_Nm: float, power_W: float, limit_radps: float, drag_Nm: float
) -> tuple[float, float]:
    """Return the least and the greatest torque of the drive."""
    speed = gear * speed_radps
    high, low = torque_Nm, 0.0
    if speed > 0.0:
        longer = power_W / (torque_Nm * speed)
        longer = longer if longer < 1.0 else 1.0
        left = (limit_radps - speed) / (_FADE * limit_radps)
        high *= longer * min(max(left, 0.0), 1.0)
        low = -drag_Nm * longer * min(speed / _CLUTCH_SLIPS_radps, 1.0)
    if gear > 0:
        return low, high
    return -high, -low


@compiled_call(
    types.UniTuple(types.float64, 2), types.float64, types.intp, types.UniTuple(types.float64, 4), others_run=False
)
def _limits_Nm(speed_radps, gear, numbers):
    """`drive_limits`, called from Python."""
    return drive_limits(speed_radps, gear, *numbers)


@shared
def engine_speed(fractions: Sequence[float], wheel_speeds_radps: Sequence[float]) -> float:
    """Return the mean speed of the driven wheels, weighted by their fractions of the torque [rad/s]."""
    f, w = fractions, wheel_speeds_radps
    return f[0] * w[0] + f[1] * w[1] + f[2] * w[2] + f[3] * w[3]


class PowertrainLimits:
    """The drive as its driver knows it: its torque limits at the present speed of the wheels.

    Attributes:
        fractions: Fraction of the torque that each wheel gets.
        numbers: Last four arguments of `drive_limits`.
    """

    def __init__(self, parameters: Powertrain) -> None:
        """Take limits and fractions from the parameters."""
        self.fractions = parameters.wheel_fractions
        self.numbers = (
            parameters.max_torque_Nm,
            parameters.max_power_W,
            parameters.max_wheel_speed_radps,
            parameters.engine_brake_torque_Nm,
        )

    def speed_radps(self, wheel_speeds_radps: tuple[float, float, float, float]) -> float:
        """Return the mean speed of the driven wheels [rad/s], weighted by their fractions of the torque."""
        return engine_speed(self.fractions, wheel_speeds_radps)

    def limits_Nm(self, speed_radps: float, gear: int) -> tuple[float, float]:
        """Return the least and the greatest torque at all wheels together, forward positive [N m]."""
        return _limits_Nm(speed_radps, gear, self.numbers)

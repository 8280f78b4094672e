"""How much side force an axle still gives for more slip angle, from the curves of its tyres."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from activesteer.controllers.parameters import ControllerSetup
from activesteer.conventions import GRAVITY_MPS2
from activesteer.signals import Estimate

LEAST: Final = 0.05
"""Slope that is left where the curve is level or falls, so that steering is never without any effect [-]."""


class Axle(NamedTuple):
    """What an axle does; all to the left positive.

    Attributes:
        slope: Slope of its curve, as a fraction of that at no slip angle [-].
        force_rad: Side force over its stiffness [rad].
        slip_angle_rad: Slip angle that makes it [rad].
        secant: Force over slip angle, as a fraction of that at no slip angle [-].
    """

    slope: float
    force_rad: float
    slip_angle_rad: float
    secant: float


class AxleSlopes:
    """Slopes of both axles' side forces at a motion, as fractions of those at no slip angle.

    The curve is that of a tyre under the load of standing still; on a road of other friction mu it is
    mu F(alpha / mu), which leaves the slope at no slip angle as it is.

    Attributes:
        loads_N: Load of one wheel of each axle, standing still [N].
    """

    def __init__(self, setup: ControllerSetup) -> None:
        """Reads the curves.

        Args:
            setup: What a controller may know of the car.
        """
        self._car, known = setup.single_track, setup.estimation
        assert known is not None  # whoever asks has an estimator
        wheelbase_m = self._car.cg_to_front_m + self._car.cg_to_rear_m
        half = 0.5 * self._car.mass_kg * GRAVITY_MPS2 / wheelbase_m
        self.loads_N = half * self._car.cg_to_rear_m, half * self._car.cg_to_front_m
        self._step_rad = known.tyres[0].slip_angle_step_rad
        self._curves: list[list[float]] = []
        for tyre, load_N in zip(known.tyres, self.loads_N, strict=True):
            loads = tyre.load_step_N * np.arange(len(tyre.force_N))
            curve = np.array([np.interp(load_N, loads, column) for column in np.array(tyre.force_N).T])
            self._curves.append((curve / (curve[1] / self._step_rad)).tolist())

    def at(self, now: Estimate, front_rad: float, rear_rad: float) -> tuple[float, float]:
        """Slopes of front and rear axle [-].

        Args:
            now: The motion, faster than walking.
            front_rad: Angle of the front wheels [rad].
            rear_rad: Angle of the rear wheels [rad].
        """
        front, rear = self.axles(now, front_rad, rear_rad)
        return front.slope, rear.slope

    def axles(self, now: Estimate, front_rad: float, rear_rad: float) -> tuple[Axle, Axle]:
        """Front and rear axle at a motion; arguments as in `at`."""
        turning = now.yaw_rate_radps / now.speed_mps
        front = front_rad - now.sideslip_rad - self._car.cg_to_front_m * turning
        rear = rear_rad - now.sideslip_rad + self._car.cg_to_rear_m * turning
        return self._axle(0, front, now.friction), self._axle(1, rear, now.friction)

    def peak_rad(self, axle: int, friction: float) -> float:
        """Slip angle of the largest force of an axle [rad]: 0 the front, 1 the rear one."""
        curve = self._curves[axle]
        return friction * self._step_rad * curve.index(max(curve))

    def _axle(self, axle: int, slip_angle_rad: float, friction: float) -> Axle:
        curve, place = self._curves[axle], abs(slip_angle_rad) / friction / self._step_rad
        index = min(int(place), len(curve) - 2)
        rise = curve[index + 1] - curve[index]
        force = friction * (curve[index] + rise * min(place - index, 1.0))
        slope = max(rise / self._step_rad, LEAST)
        secant = force / abs(slip_angle_rad) if slip_angle_rad else 1.0
        return Axle(slope, math.copysign(force, slip_angle_rad), slip_angle_rad, secant)

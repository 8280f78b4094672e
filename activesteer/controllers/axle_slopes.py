"""How much side force an axle still gives for more slip angle, from the curves of its tyres."""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.controllers.parameters import ControllerSetup
from activesteer.conventions import GRAVITY_MPS2
from activesteer.signals import Estimate

LEAST: Final = 0.05
"""Slope that is left where the curve is level or falls, so that steering is never without any effect [-]."""


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
        self._slopes: list[list[float]] = []
        for tyre, load_N in zip(known.tyres, self.loads_N, strict=True):
            loads = tyre.load_step_N * np.arange(len(tyre.force_N))
            grid = np.array(tyre.force_N)
            curve = np.array([np.interp(load_N, loads, column) for column in grid.T])
            slopes = np.diff(curve)
            self._slopes.append(np.maximum(slopes / slopes[0], LEAST).tolist())

    def at(self, now: Estimate, front_rad: float, rear_rad: float) -> tuple[float, float]:
        """Slopes of front and rear axle.

        Args:
            now: The motion, faster than walking.
            front_rad: Angle of the front wheels [rad].
            rear_rad: Angle of the rear wheels [rad].
        """
        turning = now.yaw_rate_radps / now.speed_mps
        front = front_rad - now.sideslip_rad - self._car.cg_to_front_m * turning
        rear = rear_rad - now.sideslip_rad + self._car.cg_to_rear_m * turning
        return self._slope(0, front / now.friction), self._slope(1, rear / now.friction)

    def _slope(self, axle: int, slip_angle_rad: float) -> float:
        slopes = self._slopes[axle]
        return slopes[min(int(abs(slip_angle_rad) / self._step_rad), len(slopes) - 1)]

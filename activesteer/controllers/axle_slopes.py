"""Side forces of the axles from the curves of their tyres: what more slip angle still gives, and what a force needs."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from activesteer.controllers.parameters import ControllerSetup
from activesteer.conventions import GRAVITY_MPS2
from activesteer.estimation import KnownTyre
from activesteer.signals import Estimate

LEAST: Final = 0.05
"""Slope that is left where the curve is level or falls, so that steering is never without any effect [-]."""

_AY_STEP_MPS2: Final = 0.2
"""Step of the lateral accelerations for which slip angles are kept [m/s2]."""
_ROUNDS: Final = 8
"""Rounds in which force and load of a wheel agree to a thousandth."""
_MOST: Final = 0.95
"""Part of an axle's largest force up to which they are: at it one percent of force is 0.3 deg of slip
angle by the compact's tyre, at 0.99 it is 0.7 deg, and the friction is not known to a percent [-]."""


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
        more = known.two_track
        shares = more.front_load_transfer_fraction, 1.0 - more.front_load_transfer_fraction
        shifts_kg = (
            self._car.mass_kg * more.load_height_m * share / track_m
            for share, track_m in zip(shares, (more.front_track_m, more.rear_track_m), strict=True)
        )
        self._excesses = [
            _excesses(tyre, load_N, shift_kg)
            for tyre, load_N, shift_kg in zip(known.tyres, self.loads_N, shifts_kg, strict=True)
        ]

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

    def excess_rad(self, ay_mps2: float, friction: float) -> tuple[float, float]:
        """Slip angles that both axles need in a steady turn beyond those of straight curves, the turn's side positive.

        Args:
            ay_mps2: Lateral acceleration; beyond what the road gives it is that [m/s2].
            friction: Friction of the road [-].

        Returns:
            Of the front and of the rear axle [rad].
        """
        place = abs(ay_mps2) / friction / _AY_STEP_MPS2
        size = math.copysign(friction, ay_mps2)
        front, rear = self._excesses
        return size * _between(front, place), size * _between(rear, place)

    def _axle(self, axle: int, slip_angle_rad: float, friction: float) -> Axle:
        curve, place = self._curves[axle], abs(slip_angle_rad) / friction / self._step_rad
        index = min(int(place), len(curve) - 2)
        rise = curve[index + 1] - curve[index]
        force = friction * (curve[index] + rise * min(place - index, 1.0))
        slope = max(rise / self._step_rad, LEAST)
        secant = force / abs(slip_angle_rad) if slip_angle_rad else 1.0
        return Axle(slope, math.copysign(force, slip_angle_rad), slip_angle_rad, secant)


def _excesses(tyre: KnownTyre, load_N: float, shift_kg: float) -> list[float]:
    """Slip angles of an axle beyond those of a straight curve, at lateral accelerations from 0 on [rad].

    Args:
        tyre: Of both its wheels.
        load_N: Load of each, standing still [N].
        shift_kg: What the outer one has more per lateral acceleration [N/(m/s2)].
    """
    grid, loads_N = np.array(tyre.force_N), tyre.load_step_N * np.arange(len(tyre.force_N))
    mass_kg = 2.0 * load_N / GRAVITY_MPS2  # an axle carries as much of the side force as of the weight
    angles_rad, ay_mps2 = tyre.slip_angle_step_rad * np.arange(grid.shape[1]), np.zeros(grid.shape[1])
    for _ in range(_ROUNDS):  # the load goes over by the force, and the force depends on it
        wheels_N = [
            [
                float(np.interp(load_N + side * shift_kg * ay, loads_N, column))
                for ay, column in zip(ay_mps2, grid.T, strict=True)
            ]
            for side in (-1.0, 1.0)
        ]
        ay_mps2 = np.sum(wheels_N, axis=0) / mass_kg
    rising = int(ay_mps2.argmax()) + 1
    wanted = np.arange(0.0, _MOST * ay_mps2[rising - 1], _AY_STEP_MPS2)
    straight = wanted * angles_rad[1] / ay_mps2[1]
    return (np.interp(wanted, ay_mps2[:rising], angles_rad[:rising]) - straight).tolist()


def _between(values: list[float], place: float) -> float:
    """A value between two of a row, the last one beyond its end."""
    index = min(int(place), len(values) - 2)
    return values[index] + min(place - index, 1.0) * (values[index + 1] - values[index])

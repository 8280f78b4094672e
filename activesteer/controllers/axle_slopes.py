"""Side forces of the axles from the curves of their tyres: slopes, and slip angles for a force."""

from __future__ import annotations

import math
from array import array
from typing import Final

import numpy as np

from activesteer.controllers.parameters import ControllerSetup
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.core.signals import Estimate
from activesteer.estimation import KnownTyre
from activesteer.native.records import NativeBlock, Table, table
from activesteer.native.shared_laws import shared

LEAST: Final = 0.05
"""Smallest slope, for a curve that is level or falls: steering always keeps some effect [-]."""

_AY_STEP_MPS2: Final = 0.2
"""Step of the tabulated lateral accelerations [m/s2]."""
_ROUNDS: Final = 8
"""Iterations after which force and load of a wheel agree to a thousandth."""
_SPEED, _SIDESLIP, _YAW_RATE, _FRICTION = map(
    Estimate._fields.index, ("speed_mps", "sideslip_rad", "yaw_rate_radps", "friction")
)
_MOST: Final = 0.95
"""Fraction of the largest axle force up to which slip angles are tabulated [-]. At this fraction, one percent of force
is 0.3 deg of slip angle for the compact's tyre; at 0.99 it is 0.7 deg, and the friction is not known to a percent."""


class AxleSlopes(NativeBlock):
    """Side force curves mu F(alpha / mu) of both axles on a road of friction mu, with F of a tyre under static load."""

    _front_excess_rad: Table
    _rear_excess_rad: Table
    _front_slip_rad: Table
    _rear_slip_rad: Table
    _front_curve: Table
    _rear_curve: Table
    _step_rad: float
    _cg_to_front_m: float
    _cg_to_rear_m: float

    def __init__(self, setup: ControllerSetup) -> None:
        """Read the curves."""
        self._car, known = setup.single_track, setup.estimation
        assert known is not None  # an estimator exists
        loads_N = self._car.wheel_loads_N
        self._step_rad = known.tyres[0].slip_angle_step_rad
        self._cg_to_front_m, self._cg_to_rear_m = self._car.cg_to_front_m, self._car.cg_to_rear_m
        curves = []
        for tyre, load_N in zip(known.tyres, loads_N, strict=True):
            curve = np.array([np.interp(load_N, tyre.loads_N, column) for column in np.array(tyre.force_N).T])
            curves.append(array("d", (curve / (curve[1] / self._step_rad)).tolist()))
        self._front_curve, self._rear_curve = curves
        self._front_excess_rad, self._rear_excess_rad = (
            array("d", _excesses(tyre, load_N, shift_kg))
            for tyre, load_N, shift_kg in zip(known.tyres, loads_N, known.load_shifts_kg, strict=True)
        )
        stiffness_Nprad = self._car.front_stiffness_Nprad, self._car.rear_stiffness_Nprad
        self._front_slip_rad, self._rear_slip_rad = (
            array("d", (2.0 * load_N / GRAVITY_MPS2 * _AY_STEP_MPS2 / each * np.arange(len(more)) + more).tolist())
            for load_N, each, more in zip(
                loads_N, stiffness_Nprad, (self._front_excess_rad, self._rear_excess_rad), strict=True
            )
        )


def _excesses(tyre: KnownTyre, load_N: float, shift_kg: float) -> list[float]:
    """Return how far an axle's slip angle exceeds the linear one, at rising lateral accelerations [rad]."""
    grid, loads_N = np.array(tyre.force_N), tyre.loads_N
    mass_kg = 2.0 * load_N / GRAVITY_MPS2  # an axle carries the same fraction of side force and weight
    angles_rad, ay_mps2 = tyre.slip_angle_step_rad * np.arange(grid.shape[1]), np.zeros(grid.shape[1])
    for _ in range(_ROUNDS):  # load transfer and force depend on each other
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


@shared
def slopes(block: AxleSlopes, now: Estimate, front_rad: float, rear_rad: float) -> tuple[float, float]:
    """Return the slopes of both axles relative to zero slip angle [-]; negative for a side force to the right."""
    speed, sideslip, turning, friction = now[_SPEED], now[_SIDESLIP], now[_YAW_RATE], now[_FRICTION]
    turning /= speed
    front = front_rad - sideslip - block._cg_to_front_m * turning
    rear = rear_rad - sideslip + block._cg_to_rear_m * turning
    return (
        _slope(table(block._front_curve), block._step_rad, front, friction),
        _slope(table(block._rear_curve), block._step_rad, rear, friction),
    )


@shared
def _slope(curve: Table, step_rad: float, slip_angle_rad: float, friction: float) -> float:
    # Slopes between the points, at their middles; a jump from one to the next would move the wheels.
    place = max(abs(slip_angle_rad) / friction / step_rad - 0.5, 0.0)
    index = min(int(place), len(curve) - 3)
    part = min(place - index, 1.0)
    near, far = curve[index + 1] - curve[index], curve[index + 2] - curve[index + 1]
    return math.copysign(max((near + part * (far - near)) / step_rad, LEAST), slip_angle_rad)


@shared
def excess(block: AxleSlopes, ay_mps2: float, friction: float) -> tuple[float, float]:
    """Return the slip angles that the nonlinear axles add in a steady turn, positive to the side of the turn [rad]."""
    place = abs(ay_mps2) / friction / _AY_STEP_MPS2
    size = math.copysign(friction, ay_mps2)
    return size * _between(table(block._front_excess_rad), place), size * _between(table(block._rear_excess_rad), place)


@shared
def axle_forces(
    block: AxleSlopes, now: Estimate, front_rad: float, rear_rad: float
) -> tuple[float, float, float, float]:
    """Return the slip angles of both axles [rad], and their side forces per unit of the mass on the axle [m/s2]."""
    # Beyond the table a force keeps its last value, as a sliding tyre keeps most of its force.
    speed, sideslip, turning, friction = now[_SPEED], now[_SIDESLIP], now[_YAW_RATE], now[_FRICTION]
    front = front_rad - sideslip - block._cg_to_front_m * turning / speed
    rear = rear_rad - sideslip + block._cg_to_rear_m * turning / speed
    return (
        front,
        rear,
        _borne_mps2(table(block._front_slip_rad), front, friction),
        _borne_mps2(table(block._rear_slip_rad), rear, friction),
    )


@shared
def front_slip(block: AxleSlopes, force_mps2: float, friction: float) -> float:
    """Return the slip angle of the front axle for a side force per unit of the mass that it carries [rad]."""
    slip = _between(table(block._front_slip_rad), abs(force_mps2) / friction / _AY_STEP_MPS2)
    return math.copysign(friction * slip, force_mps2)


@shared
def _borne_mps2(slips: Table, slip_angle_rad: float, friction: float) -> float:
    """Return the side force of an axle at a slip angle, per unit of the mass that it carries [m/s2]."""
    wanted, low, high = abs(slip_angle_rad) / friction, 0, len(slips) - 1
    if wanted >= slips[high]:
        return math.copysign(friction * _AY_STEP_MPS2 * high, slip_angle_rad)
    while high - low > 1:
        middle = (low + high) // 2
        if slips[middle] <= wanted:
            low = middle
        else:
            high = middle
    part = (wanted - slips[low]) / (slips[high] - slips[low])
    return math.copysign(friction * _AY_STEP_MPS2 * (low + part), slip_angle_rad)


@shared
def _between(values: Table, place: float) -> float:
    """Interpolate in a row at a fractional index, with the last value held beyond the end of the row."""
    index = min(int(place), len(values) - 2)
    return values[index] + min(place - index, 1.0) * (values[index + 1] - values[index])

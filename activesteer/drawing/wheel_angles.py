"""Wedges that enlarge the angles of the wheels, so that 2 deg of rear steering is visible.

Points are in the axes of the car: x forward and y left, the origin on the road below the middle of its front axle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from activesteer.core.conventions import CORNERS, Array
from activesteer.core.units import quantity_of
from activesteer.recording import Recording
from activesteer.road.course import Footprint

CHANNELS: Final = tuple(f"{corner}_steer_rad" for corner in CORNERS)
RADIUS_M: Final = 1.2
"""Distance from the tip of a wedge to its arc [m]."""
SLICES: Final = 12
"""Number of triangles of a wedge."""
_FACTORS: Final = (10, 5, 2, 1)
_WIDEST_RAD: Final = math.radians(90.0)
"""Widest wedge [rad]; a larger angle lowers the factor of its axle."""
_BESIDE_M: Final = 0.4
"""Distance from the side of the body to the tips of the wedges, which the body would hide [m]."""
_WHEEL_M: Final = 0.36, 0.13
"""Half length and half width of a wheel in plan view [m]."""
_NOTHING_RAD: Final = math.radians(0.05)
"""Smallest angle that a label gives [rad]."""


def factors(recordings: Sequence[Recording]) -> tuple[int, ...]:
    """Return the enlargement factor of each wheel's angle in one view: ten, or less for steer angles above 9 deg."""
    found: list[int] = []
    for axle in (CHANNELS[:2], CHANNELS[2:]):
        angles = [np.abs(run[name]) for run in recordings for name in axle if name in run]
        largest = max((float(np.max(values[np.isfinite(values)], initial=0.0)) for values in angles), default=0.0)
        found += [next((factor for factor in _FACTORS if factor * largest <= _WIDEST_RAD), 1)] * 2
    return tuple(found)


def angles_at(recording: Recording, time_s: Array | float) -> Array:
    """Return the steer angles of the wheels at sample times [rad], shape (..., 4), interpolated between the rows."""
    return np.stack(
        [
            np.interp(time_s, recording.time_s, recording[name]) if name in recording else np.full_like(time_s, np.nan)
            for name in CHANNELS
        ],
        axis=-1,
    )


def wedges(angle_rad: Array, factor: Sequence[int]) -> Array:
    """Return wedges from straight ahead to the enlarged steer angles [m], tips at 0, shape (..., 4, SLICES + 2, 2)."""
    shown = np.nan_to_num(np.asarray(angle_rad, np.float64) * factor)
    along = shown[..., None] * np.linspace(0.0, 1.0, SLICES + 1)
    arc = RADIUS_M * np.stack([np.cos(along), np.sin(along)], axis=-1)
    return np.concatenate([np.zeros((*shown.shape, 1, 2)), arc], axis=-2)


def wheel_centres(size: Footprint) -> Array:
    """Return the positions of the wheels [m], shape (4, 2)."""
    half = 0.5 * size.width_m - _WHEEL_M[1]
    return np.array([(x, side * half) for x in (0.0, -size.wheelbase_m) for side in (1.0, -1.0)])


def tips_beside(size: Footprint) -> Array:
    """Return the tips of wedges next to the car [m], shape (4, 2)."""
    beside = 0.5 * size.width_m + _BESIDE_M
    return np.array([(x, side * beside) for x in (0.0, -size.wheelbase_m) for side in (1.0, -1.0)])


class Plan(NamedTuple):
    """A plan view of a car, with every part as a closed line in the axes of the car."""

    body: Array  # outline of the body [m], shape (points, 2)
    wheels: Array  # outlines of the wheels [m], turned by the enlarged angles, shape (..., 4, 4, 2)
    wedges: Array  # the enlarged angles, their tips at the wheels [m], shape (..., 4, SLICES + 2, 2)


def plan(size: Footprint, angle_rad: Array, factor: Sequence[int]) -> Plan:
    """Return the plan view of a car with enlarged wheel angles."""
    front, rear, half = size.front_m, size.rear_m, 0.5 * size.width_m
    body = np.array(
        [
            *((front, 0.5 * half), (front - 0.35, half), (rear + 0.2, half), (rear, 0.75 * half)),
            *((rear, -0.75 * half), (rear + 0.2, -half), (front - 0.35, -half), (front, -0.5 * half)),
        ]
    )
    at = wheel_centres(size)[:, None]
    shown = np.nan_to_num(np.asarray(angle_rad, np.float64) * factor)[..., None]
    x, y = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)]).T * np.array(_WHEEL_M)[:, None]
    cos, sin = np.cos(shown), np.sin(shown)
    wheels = np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
    return Plan(body, at + wheels, at + wedges(angle_rad, factor))


def words(angle_rad: float) -> str:
    """Return the label of a wedge: its true angle and side, empty for an unknown or negligible angle."""
    if not abs(angle_rad) >= _NOTHING_RAD:
        return ""
    side = " left" if angle_rad > 0.0 else " right"
    unit = quantity_of(CHANNELS[0]).unit
    return f"{abs(angle_rad) * unit.factor:.1f} {unit.name}{side}"

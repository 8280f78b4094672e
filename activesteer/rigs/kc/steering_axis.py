"""The axis about which a wheel steers, from two positions of the wheel; no joint needs to lie on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from activesteer.conventions import Array
from activesteer.rigs.kc.held_car import WheelPose


@dataclass(frozen=True)
class SteeringAxis:
    """A steering axis, and its distances from the wheel of the standing car."""

    point_m: Array
    """Point of the axis at the height of the contact point, vehicle axes, shape (3,)."""
    direction: Array
    """Unit vector along it, upwards, shape (3,)."""
    caster_rad: float
    """Angle to the vertical in side view, positive with the top to the rear (ISO 8855)."""
    inclination_rad: float
    """Angle to the vertical in front view, positive with the top towards the middle of the car (ISO 8855)."""
    trail_m: float
    """Distance from the contact point forwards to the axis on the ground: positive if the axis is ahead."""
    scrub_radius_m: float
    """Distance from the axis on the ground outwards to the contact point: positive if the axis is inside."""
    centre_trail_m: float
    """Distance from the wheel centre forwards to the axis, at the height of the wheel centre."""
    centre_offset_m: float
    """Distance from the axis outwards to the wheel centre, at the height of the wheel centre (disturbing force
    lever)."""


def steering_axis(right: WheelPose, left: WheelPose, standing: WheelPose, inwards: float) -> SteeringAxis:
    """Return the axis of the screw motion that takes a wheel from one position to another.

    Args:
        right: The wheel steered slightly to the right, vehicle axes.
        left: The wheel steered by the same angle to the left.
        standing: The wheel straight ahead.
        inwards: Sign of y towards the middle of the car.

    Source: Chasles' theorem; the point is the solution of least norm of (I - R) p = t.
    """
    turn = left.rotation @ right.rotation.T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    axis /= np.linalg.norm(axis)
    axis *= math.copysign(1.0, axis[2])
    shift = left.centre_m - turn @ right.centre_m
    point = np.linalg.lstsq(np.eye(3) - turn, shift - axis * (axis @ shift), rcond=1e-9)[0]

    def at_height(height_m: float) -> Array:
        return point + axis * ((height_m - point[2]) / axis[2])

    ground, beside = at_height(standing.contact_m[2]), at_height(standing.centre_m[2])
    return SteeringAxis(
        ground,
        axis,
        math.atan2(-axis[0], axis[2]),
        math.atan2(inwards * axis[1], axis[2]),
        float(ground[0] - standing.contact_m[0]),
        float(inwards * (ground[1] - standing.contact_m[1])),
        float(beside[0] - standing.centre_m[0]),
        float(inwards * (beside[1] - standing.centre_m[1])),
    )

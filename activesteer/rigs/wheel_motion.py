"""Imposed motion of a wheel, and its measured forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Imposed position and orientation of the wheel, and their rates."""

    centre_height_m: float
    """Height of the wheel centre above the road."""
    velocity_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Velocity of the wheel centre, world frame."""
    spin_radps: float = 0.0
    """Rotation about the axis relative to the carrier, positive rolling forward."""
    heading_rad: float = 0.0
    """Angle of the wheel's heading about the world's z axis, from x."""
    inclination_rad: float = 0.0
    """Rotation of the wheel plane about its heading; positive leans the top to the right."""
    heading_rate_radps: float = 0.0
    """Rate of the heading."""
    inclination_rate_radps: float = 0.0
    """Rate of the inclination."""


@dataclass(frozen=True)
class RigForces:
    """Force of the road on the wheel, read from the engine, and its contact point.

    `force_N` and `moment_Nm` are in the world frame, the moment about the contact point; shape (3,), or (n, 3) for n
    operating points. The other members have the shape (n,).
    """

    force_N: Vector
    moment_Nm: Vector
    contact_point_m: Vector
    heading_rad: Vector
    loaded_radius_m: Vector
    spin_radps: Vector
    deflection_x_m: Vector
    """Relaxation state along the heading."""
    deflection_y_m: Vector
    """Relaxation state across the heading."""
    limited: Vector
    """1 if the tyre was outside the range of validity of its file."""


def turned(vectors: Vector, angle_rad: Vector) -> Vector:
    """Return vectors, shape (..., 3), turned about z."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1)


def stacked(forces: list[RigForces]) -> RigForces:
    """Return several operating points as one record of arrays."""
    names = RigForces.__dataclass_fields__
    return RigForces(**{name: np.stack([getattr(one, name) for one in forces]) for name in names})

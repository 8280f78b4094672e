"""Rotations of many points at once; quaternions are w x y z as in recordings unless stated otherwise."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from activesteer.conventions import Array


def rotated(quaternions: Array, point: ArrayLike) -> Array:
    """Rotate one point of a body by the orientations of that body.

    Args:
        quaternions: Orientations of the body over time, shape (n, 4).
        point: The point in the frame of the body, shape (3,).

    Returns:
        Rotated point, shape (n, 3).
    """
    vector = np.asarray(point, np.float64)
    w, axis = quaternions[:, :1], quaternions[:, 1:]
    cross = 2.0 * np.cross(axis, vector)
    return vector + w * cross + np.cross(axis, cross)


def about_vertical(angle_rad: Array) -> Array:
    """Return quaternions x y z w of rotations about the vertical, shape (n, 4)."""
    zero = np.zeros_like(angle_rad)
    return np.stack([zero, zero, np.sin(0.5 * angle_rad), np.cos(0.5 * angle_rad)], axis=-1)


def xyzw(quaternions: ArrayLike) -> Array:
    """Reorder quaternions w x y z to the viewer's order x y z w, shape (..., 4)."""
    return np.asarray(quaternions, np.float64)[..., [1, 2, 3, 0]]


def between(start_m: Array, end_m: Array) -> tuple[Array, Array, Array]:
    """Place a solid along the line between two points, with its own z axis on that line.

    Args:
        start_m: One end over time [m], shape (n, 3).
        end_m: The other end [m], shape (n, 3).

    Returns:
        Length [m], shape (n,); centre [m], shape (n, 3); quaternion x y z w of the shortest rotation from the
        vertical, shape (n, 4).
    """
    if end_m[0, 2] < start_m[0, 2]:  # point upwards: close to straight down, the shortest rotation has no definite axis
        start_m, end_m = end_m, start_m
    along = end_m - start_m
    length = np.linalg.norm(along, axis=1)
    x, y, z = (along / np.maximum(length, 1e-9)[:, None]).T
    turn = np.stack([-y, x, np.zeros_like(x), 1.0 + z], axis=1)
    turn[turn[:, 3] < 1e-9] = (1.0, 0.0, 0.0, 0.0)
    return length, 0.5 * (start_m + end_m), turn / np.linalg.norm(turn, axis=1, keepdims=True)

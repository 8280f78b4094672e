"""Rotation of the whole car on the road."""

from __future__ import annotations

import math
from typing import Final

import mujoco
import numpy as np

YAW_DOF: Final = 5
"""Place of the yaw rate among the velocities, in a model whose first joint is the free joint of the chassis."""


def turn_chassis_back(data: mujoco.MjData, half_rad: float) -> None:
    """Turn orientation and velocity of the chassis about the world's z axis; its position stays.

    Args:
        data: State of the car, whose first joint is the free joint of the chassis; changed.
        half_rad: Half the angle, positive clockwise [rad].
    """
    turned = np.empty(4)
    mujoco.mju_mulQuat(turned, np.array([math.cos(half_rad), 0.0, 0.0, -math.sin(half_rad)]), data.qpos[3:7])
    data.qpos[3:7] = turned
    vx, vy = data.qvel[:2]
    cos, sin = math.cos(2 * half_rad), math.sin(2 * half_rad)
    data.qvel[:2] = cos * vx + sin * vy, cos * vy - sin * vx

"""Motion of the centre of gravity in the axes of ISO 8855, from the engine's sensors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from activesteer.conventions import Array, yaw_of

_STANDSTILL_MPS: Final = 0.2
"""Below this speed a sideslip angle has no meaning and is recorded as 0 [m/s]."""
_ROCKS_BACK_MPS: Final = 1.0
"""Likewise backwards below this speed, as where a car that has stopped swings back on suspension and tyres [m/s]."""

MOTION_SENSORS: Final = (
    "cg_position", "front_axle_position", "chassis_orientation", "cg_velocity", "cg_accelerometer", "cg_gyro",
)  # fmt: skip
"""What `CarMotion` reads."""


class CarMotion:
    """Motion of the centre of gravity in the axes of ISO 8855, from sensors in world and body axes."""

    def __init__(self, sensordata: Array, sensor: Callable[[str], slice], gravity: Array, last_yaw_rad: float) -> None:
        """Evaluates all of it; the members are called as the channels.

        Args:
            sensordata: What the engine's sensors say, shape (n, all sensors).
            sensor: Name of one of `MOTION_SENSORS` -> its columns.
            gravity: Acceleration of gravity in the world [m/s2].
            last_yaw_rad: Yaw angle of the row before the first one, which the angle is unwrapped from [rad].
        """

        def columns(name: str) -> list[Array]:
            part = sensor(name)
            return [sensordata[:, column] for column in range(part.start, part.stop)]

        self.x_m, self.y_m, self.z_m = columns("cg_position")
        self.front_axle_x_m, self.front_axle_y_m, _ = columns("front_axle_position")
        w, x, y, z = columns("chassis_orientation")
        # Body axes in the world: yaw, pitch, roll in this order (ISO 8855).
        yaw = yaw_of(sensordata[:, sensor("chassis_orientation")])
        turned = np.diff(yaw, prepend=last_yaw_rad)
        # Unwrapping takes longer than all the rest; where no jump is to be taken out, it adds 0.
        jumps = not np.abs(turned).max() < np.pi
        self.yaw_rad = np.unwrap(np.concatenate(([last_yaw_rad], yaw)))[1:] if jumps else yaw + 0.0
        self.pitch_rad = np.arcsin(np.clip(2 * (w * y - x * z), -1.0, 1.0))
        self.roll_rad = np.arctan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
        cos, sin = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        vx, vy, self.vz_mps = columns("cg_velocity")
        self.vx_mps = vx * cos + vy * sin
        self.vy_mps = vy * cos - vx * sin
        self.speed_mps = np.hypot(vx, vy)
        slowest = np.where(self.vx_mps < 0.0, _ROCKS_BACK_MPS, _STANDSTILL_MPS)
        self.sideslip_rad = np.where(self.speed_mps > slowest, np.arctan2(self.vy_mps, self.vx_mps), 0.0)
        ax, ay, az = columns("cg_accelerometer")
        cp, sp = np.cos(self.pitch_rad), np.sin(self.pitch_rad)
        cr, sr = np.cos(self.roll_rad), np.sin(self.roll_rad)
        # An accelerometer measures the specific force: turned into the road plane, gravity (which has a part there on a
        # grade) is added to get the acceleration.
        self.ax_mps2 = cp * ax + sp * (sr * ay + cr * az) + gravity[0] * cos
        self.ay_mps2 = cr * ay - sr * az - gravity[0] * sin
        self.az_mps2 = -sp * ax + cp * (sr * ay + cr * az) + gravity[2]
        self.roll_rate_radps, self.pitch_rate_radps, body_yaw = columns("cg_gyro")
        # Euler angle rate about the road's normal, not the body's z axis.
        self.yaw_rate_radps = (sr * self.pitch_rate_radps + cr * body_yaw) / cp

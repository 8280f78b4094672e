"""Motion of the centre of gravity in the axes of ISO 8855, from the engine's sensors."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from activesteer.conventions import Array, yaw_of
from activesteer.signals import Channel
from activesteer.vehicle.channels.raw_rows import Column, sensor

_STANDSTILL_MPS: Final = 0.2
"""Below this speed a sideslip angle has no meaning and is recorded as 0 [m/s]."""
_ROCKS_BACK_MPS: Final = 1.0
"""Likewise backwards below this speed, as where a car that has stopped swings back on suspension and tyres [m/s]."""

_EXACT: Final = ("x_m", "y_m", "yaw_rad", "front_axle_x_m", "front_axle_y_m")
"""Channels that grow with the way, and so need more than 32 bit in a file."""
MOTION_CHANNELS: Final = tuple(
    Channel(name, unit, meaning, "vehicle", name not in _EXACT)
    for name, unit, meaning in (
        ("x_m", "m", "position of the centre of gravity, world x"),
        ("y_m", "m", "position of the centre of gravity, world y (left)"),
        ("z_m", "m", "height of the centre of gravity above the road"),
        ("yaw_rad", "rad", "yaw angle, left positive, unwrapped"),
        ("roll_rad", "rad", "roll angle, positive to the right"),
        ("pitch_rad", "rad", "pitch angle, positive nose down"),
        ("vx_mps", "m/s", "longitudinal velocity of the centre of gravity, in the road plane"),
        ("vy_mps", "m/s", "lateral velocity of the centre of gravity, in the road plane, left positive"),
        ("vz_mps", "m/s", "vertical velocity of the centre of gravity"),
        ("speed_mps", "m/s", "speed of the centre of gravity over the road"),
        ("yaw_rate_radps", "rad/s", "yaw rate, left positive"),
        ("roll_rate_radps", "rad/s", "roll rate, body-fixed"),
        ("pitch_rate_radps", "rad/s", "pitch rate, body-fixed"),
        ("ax_mps2", "m/s2", "longitudinal acceleration, in the road plane"),
        ("ay_mps2", "m/s2", "lateral acceleration, in the road plane, left positive"),
        ("az_mps2", "m/s2", "vertical acceleration"),
        ("sideslip_rad", "rad", "sideslip angle at the centre of gravity, atan(vy/vx)"),
        ("front_axle_x_m", "m", "position of the middle of the front axle, world x"),
        ("front_axle_y_m", "m", "position of the middle of the front axle, world y"),
    )
)
"""Those that are worked out are members of a `CarMotion`."""


def motion_copied(model: mujoco.MjModel) -> dict[str, Column]:
    """Channels of `MOTION_CHANNELS` that the engine's sensors say as they are.

    Raises:
        ModelError: a sensor is missing.
    """
    x, y, z = sensor(model, "cg_position")
    front_x, front_y, _ = sensor(model, "front_axle_position")
    _, _, vertical = sensor(model, "cg_velocity")
    roll_rate, pitch_rate, _ = sensor(model, "cg_gyro")
    return {
        "x_m": x, "y_m": y, "z_m": z, "front_axle_x_m": front_x, "front_axle_y_m": front_y, "vz_mps": vertical,
        "roll_rate_radps": roll_rate, "pitch_rate_radps": pitch_rate,
    }  # fmt: skip


def motion_inputs(model: mujoco.MjModel) -> tuple[Column, ...]:
    """What the others are worked out from: orientation, velocity, acceleration, and two of the body's angular rates.

    Raises:
        ModelError: a sensor is missing.
    """
    orientation, velocity, acceleration, rates = (
        sensor(model, name) for name in ("chassis_orientation", "cg_velocity", "cg_accelerometer", "cg_gyro")
    )
    return *orientation, *velocity[:2], *acceleration, *rates[1:]


class CarMotion:
    """Motion of the centre of gravity in the axes of ISO 8855, from sensors in world and body axes."""

    def __init__(self, columns: Array, gravity: Array, last_yaw_rad: float) -> None:
        """Evaluates all of it; the members are called as the channels.

        Args:
            columns: Those of `motion_inputs`, shape (n, 11).
            gravity: Acceleration of gravity in the world [m/s2].
            last_yaw_rad: Yaw angle of the row before the first one, which the angle is unwrapped from [rad].
        """
        w, x, y, z, vx, vy, ax, ay, az, pitch_rate, body_yaw = columns.T
        # Body axes in the world: yaw, pitch, roll in this order (ISO 8855).
        yaw = yaw_of(columns[:, :4])
        turned = np.diff(yaw, prepend=last_yaw_rad)
        # Unwrapping takes longer than all the rest; where no jump is to be taken out, it adds 0.
        jumps = not np.abs(turned).max() < np.pi
        self.yaw_rad = np.unwrap(np.concatenate(([last_yaw_rad], yaw)))[1:] if jumps else yaw + 0.0
        self.pitch_rad = np.arcsin(np.clip(2 * (w * y - x * z), -1.0, 1.0))
        self.roll_rad = np.arctan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
        cos, sin = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        self.vx_mps = vx * cos + vy * sin
        self.vy_mps = vy * cos - vx * sin
        self.speed_mps = np.hypot(vx, vy)
        slowest = np.where(self.vx_mps < 0.0, _ROCKS_BACK_MPS, _STANDSTILL_MPS)
        self.sideslip_rad = np.where(self.speed_mps > slowest, np.arctan2(self.vy_mps, self.vx_mps), 0.0)
        cp, sp = np.cos(self.pitch_rad), np.sin(self.pitch_rad)
        cr, sr = np.cos(self.roll_rad), np.sin(self.roll_rad)
        # An accelerometer measures the specific force: turned into the road plane, gravity (which has a part there on a
        # grade) is added to get the acceleration.
        self.ax_mps2 = cp * ax + sp * (sr * ay + cr * az) + gravity[0] * cos
        self.ay_mps2 = cr * ay - sr * az - gravity[0] * sin
        self.az_mps2 = -sp * ax + cp * (sr * ay + cr * az) + gravity[2]
        # Euler angle rate about the road's normal, not the body's z axis.
        self.yaw_rate_radps = (sr * pitch_rate + cr * body_yaw) / cp

"""Motion of a measured car: path from speed and yaw rate if no position was measured, and poses of the body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from activesteer.conventions import Array
from activesteer.recording import Poses, Recording
from activesteer.vehicle import Vehicle

_MOVING_MPS: Final = 1.0
"""Speed below which a sideslip angle is not defined [m/s]."""


def with_motion(time_s: Array, channels: Mapping[str, Array]) -> dict[str, Array]:
    """Add derived channels: speed, sideslip angle, yaw angle and path.

    Without a position, the path starts at the origin along x. Its direction is the yaw angle, plus the sideslip angle
    if measured.

    Args:
        time_s: Time, uniform [s], shape (n,).
        channels: Measured values by channel name, SI.

    Returns:
        The channels, with `speed_mps`, `sideslip_rad`, `yaw_rad`, `x_m` and `y_m` where they can be derived.
    """
    found = dict(channels)
    if "speed_mps" not in found and "vx_mps" in found:
        found["speed_mps"] = np.hypot(found["vx_mps"], found.get("vy_mps", 0.0))
    if "sideslip_rad" not in found and {"vx_mps", "vy_mps"} <= set(found):
        moving = np.abs(found["vx_mps"]) > _MOVING_MPS
        found["sideslip_rad"] = np.where(moving, np.arctan2(found["vy_mps"], np.abs(found["vx_mps"])), 0.0)
    if "yaw_rad" not in found and "yaw_rate_radps" in found:
        found["yaw_rad"] = _integral(time_s, found["yaw_rate_radps"])
    if not {"x_m", "y_m"} <= set(found) and {"speed_mps", "yaw_rad"} <= set(found):
        course = found["yaw_rad"] + found.get("sideslip_rad", 0.0)
        found["x_m"] = _integral(time_s, found["speed_mps"] * np.cos(course))
        found["y_m"] = _integral(time_s, found["speed_mps"] * np.sin(course))
    return found


def _integral(time_s: Array, values: Array) -> Array:
    """Integrate by trapezoids from zero."""
    return np.append(0.0, np.cumsum(np.diff(time_s) * 0.5 * (values[1:] + values[:-1])))


def at_sensor(run: Recording) -> Recording:
    """Return the run with the motion of the point that `sensor_ahead_m` of its manoeuvre names.

    The point is on the centre line of a rigid body, ahead of the centre of gravity by x: v_y + x r, a_y + x dr/dt,
    a_x - x r^2 with the yaw rate r.

    Args:
        run: A simulated run. Without the key, or with zero, it is returned itself.
    """
    ahead_m = run.metadata.get("maneuver", {}).get("sensor_ahead_m", 0.0)
    if ahead_m == 0.0:
        return run
    rate = run["yaw_rate_radps"]
    vx, vy = run["vx_mps"], run["vy_mps"] + ahead_m * rate
    moved = {
        "vy_mps": vy,
        "speed_mps": np.hypot(vx, vy),
        "sideslip_rad": np.where(np.abs(vx) > _MOVING_MPS, np.arctan2(vy, np.abs(vx)), 0.0),
        "ay_mps2": run["ay_mps2"] + ahead_m * np.gradient(rate, run.time_s),
        "ax_mps2": run["ax_mps2"] - ahead_m * rate**2,
    }
    values = [moved.get(channel.name, run[channel.name]) for channel in run.channels]
    return Recording(run.channels, run.time_s, np.column_stack(values), metadata=run.metadata)


def moved_car(vehicle: Vehicle, time_s: Array, channels: Mapping[str, Array]) -> Poses | None:
    """Return poses of a car in its design position, moved along the path, for replay; None without a path.

    Args:
        vehicle: Vehicle whose bodies are shown.
        time_s: Time [s], shape (n,).
        channels: Values by channel name.
    """
    if not {"x_m", "y_m", "yaw_rad"} <= set(channels):
        return None
    rows = np.arange(0, len(time_s), max(1, round(0.01 / float(time_s[1] - time_s[0]))))
    half = 0.5 * channels["yaw_rad"][rows]
    turn = np.column_stack([np.cos(half), 0.0 * half, 0.0 * half, np.sin(half)])
    cos, sin = np.cos(2.0 * half), np.sin(2.0 * half)
    centre = vehicle.data.site("cg").xpos
    at = np.array([vehicle.data.body(name).xpos for name in vehicle.body_names]) - [centre[0], centre[1], 0.0]
    how = np.array([vehicle.data.body(name).xquat for name in vehicle.body_names])
    x_m, y_m = channels["x_m"][rows, None], channels["y_m"][rows, None]
    positions = np.stack(
        [
            x_m + cos[:, None] * at[:, 0] - sin[:, None] * at[:, 1],
            y_m + sin[:, None] * at[:, 0] + cos[:, None] * at[:, 1],
            np.broadcast_to(at[:, 2], (len(rows), len(at))),
        ],
        axis=-1,
    )
    return Poses(time_s[rows], vehicle.body_names, positions, _product(turn[:, None], how[None]))


def _product(one: Array, other: Array) -> Array:
    """Return the product of quaternions w x y z."""
    w, x, y, z = np.moveaxis(one, -1, 0)
    W, X, Y, Z = np.moveaxis(other, -1, 0)
    return np.stack(
        [
            w * W - x * X - y * Y - z * Z, w * X + x * W + y * Z - z * Y,
            w * Y - x * Z + y * W + z * X, w * Z + x * Y - y * X + z * W,
        ],
        axis=-1,
    )  # fmt: skip

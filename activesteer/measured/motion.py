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
    from scipy.integrate import cumulative_trapezoid  # noqa: PLC0415 - slow to import

    found = dict(channels)
    if "speed_mps" not in found and "vx_mps" in found:
        found["speed_mps"] = np.hypot(found["vx_mps"], found.get("vy_mps", 0.0))
    if "sideslip_rad" not in found and {"vx_mps", "vy_mps"} <= set(found):
        found["sideslip_rad"] = _sideslip(found["vx_mps"], found["vy_mps"])
    if "yaw_rad" not in found and "yaw_rate_radps" in found:
        found["yaw_rad"] = cumulative_trapezoid(found["yaw_rate_radps"], time_s, initial=0.0)
    if not {"x_m", "y_m"} <= set(found) and {"speed_mps", "yaw_rad"} <= set(found):
        course = found["yaw_rad"] + found.get("sideslip_rad", 0.0)
        found["x_m"] = cumulative_trapezoid(found["speed_mps"] * np.cos(course), time_s, initial=0.0)
        found["y_m"] = cumulative_trapezoid(found["speed_mps"] * np.sin(course), time_s, initial=0.0)
    return found


def _sideslip(vx: Array, vy: Array) -> Array:
    return np.where(np.abs(vx) > _MOVING_MPS, np.arctan2(vy, np.abs(vx)), 0.0)


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
        "sideslip_rad": _sideslip(vx, vy),
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
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 - slow to import

    rows = np.arange(0, len(time_s), max(1, round(0.01 / float(time_s[1] - time_s[0]))))
    turns = Rotation.from_euler("z", channels["yaw_rad"][rows, None])
    centre = vehicle.data.site("cg").xpos
    bodies = [vehicle.data.body(name) for name in vehicle.body_names]
    path = np.column_stack([channels["x_m"][rows], channels["y_m"][rows], np.zeros(len(rows))])
    positions = [path + turns.apply(body.xpos - [centre[0], centre[1], 0.0]) for body in bodies]
    turned = [(turns * Rotation.from_quat(body.xquat, scalar_first=True)).as_quat(scalar_first=True) for body in bodies]
    return Poses(time_s[rows], vehicle.body_names, np.stack(positions, axis=1), np.stack(turned, axis=1))

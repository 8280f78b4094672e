"""Conversion of a recording to the quantities, columns and signs of the reference runs."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from activesteer.core.conventions import CORNERS, Array
from activesteer.recording import Recording

_ACCELERATION_INTERVAL_S: Final = 0.005
"""Interval over which the reference averages its accelerations [s]."""
_WHEEL: Final = {
    "Fx": "tyre_fx_N", "Fy": "tyre_fy_N", "Fz": "tyre_fz_N", "Mz": "tyre_mz_Nm", "alpha": "slip_angle_rad",
    "kappa": "slip_ratio", "travel": "travel_m", "omega": "wheel_speed_radps",
}  # fmt: skip
"""Column of the reference without the wheel -> channel of the recording."""


def reference_columns(recording: Recording, point_from_cg_m: tuple[float, float, float]) -> dict[str, Array]:
    """Return the columns of the reference's CSV files from a recording.

    Args:
        recording: The run.
        point_from_cg_m: Point of the motion, from the `cg` site, chassis axes [m].

    Returns:
        Column -> values at every recorded step: `t`, velocities `vx`, `vy` and accelerations `ax`, `ay` of the point in
        the heading frame, `r`, `beta`, `roll`, `pitch`, `x`, `y`, `z`, `psi`, `rack` (negative steers left), and of
        each wheel `delta` (heading on the ground less psi), `incl`, `Fx`, `Fy`, `Fz`, `Mz`, `alpha`, `kappa`, `travel`,
        `omega`.
    """
    r = recording
    t = r.time_s
    yaw, pitch, roll = r["yaw_rad"], r["pitch_rad"], r["roll_rad"]
    to_heading = Rotation.from_euler("YX", np.column_stack([pitch, roll])).as_matrix()  # from chassis axes
    arm = to_heading @ np.asarray(point_from_cg_m)
    sin_roll, cos_roll = np.sin(roll), np.cos(roll)
    p, q = r["roll_rate_radps"], r["pitch_rate_radps"]
    # The channel is the rate of the Euler angle; the rate about the body's z axis is this.
    body_yaw = (r["yaw_rate_radps"] * np.cos(pitch) - sin_roll * q) / cos_roll
    spin = np.einsum("nij,nj->ni", to_heading, np.column_stack([p, q, body_yaw]))
    velocity = np.column_stack([r["vx_mps"], r["vy_mps"], r["vz_mps"]]) + np.cross(spin, arm)
    cos, sin = np.cos(yaw), np.sin(yaw)
    vx, vy = velocity[:, 0], velocity[:, 1]
    columns = {
        "t": t, "vx": vx, "vy": vy, "r": r["yaw_rate_radps"],
        **_accelerations(t, yaw, vx * cos - vy * sin, vx * sin + vy * cos),
        "beta": np.arctan2(vy, vx), "roll": np.arcsin(np.cos(pitch) * sin_roll), "pitch": pitch,
        "x": r["x_m"] + cos * arm[:, 0] - sin * arm[:, 1], "y": r["y_m"] + sin * arm[:, 0] + cos * arm[:, 1],
        "z": r["z_m"] + arm[:, 2], "psi": yaw, "rack": -r["rack_m"],
    }  # fmt: skip
    for axis in ("x", "y"):
        columns[axis] = columns[axis] - columns[axis][0]
    for corner in CORNERS:
        steer, camber = r[f"{corner}_steer_rad"], r[f"{corner}_camber_rad"]
        across = np.cos(camber)
        axle = np.column_stack([-np.sin(steer) * across, np.cos(steer) * across, np.sin(camber)])
        turned = np.einsum("nij,nj->ni", to_heading, axle)
        columns[f"delta_{corner.upper()}"] = np.arctan2(-turned[:, 0], turned[:, 1])
        columns[f"incl_{corner.upper()}"] = np.arcsin(turned[:, 2])
        for name, channel in _WHEEL.items():
            columns[f"{name}_{corner.upper()}"] = r[f"{corner}_{channel}"]
    return columns


def _accelerations(t: Array, yaw: Array, east: Array, north: Array) -> dict[str, Array]:
    """Return mean accelerations over the interval before each instant, in the heading at its middle."""
    before = t - _ACCELERATION_INTERVAL_S
    # The first interval of the recording also stands for the time before it.
    before = np.maximum(before, t[0])
    span = np.maximum(t - before, 1e-12)
    ax, ay = ((v - np.interp(before, t, v)) / span for v in (east, north))
    middle = np.interp(0.5 * (t + before), t, yaw)
    cos, sin = np.cos(middle), np.sin(middle)
    along, across = ax * cos + ay * sin, ay * cos - ax * sin
    first = int(np.searchsorted(t, t[0] + _ACCELERATION_INTERVAL_S))
    along[:first], across[:first] = along[first], across[first]
    return {"ax": along, "ay": across}

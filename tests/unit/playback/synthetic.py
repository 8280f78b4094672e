"""A synthetic car: a chassis and four wheels on a left-hand circle, one link and one spring at each wheel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import Channel
from activesteer.recording import Link, Poses, Primitive, Recording, ScenePart

SPEED_MPS, RADIUS_M, WHEEL_RADIUS_M = 10.0, 50.0, 0.3
WHEELS = {"fl": (0.0, 0.76), "fr": (0.0, -0.76), "rl": (-2.6, 0.76), "rr": (-2.6, -0.76)}
FY_N, USE, STEER_RAD = 1500.0, 0.5, 0.1


def scene() -> list[ScenePart]:
    parts: list[ScenePart] = [Primitive("chassis", "box", (4.0, 1.7, 0.5), (-1.3, 0.0, 0.5), rgba=(0.1, 0.3, 0.6, 0.2))]
    for corner, (x, y) in WHEELS.items():
        wheel = f"{corner}_wheel"
        parts.append(Primitive(wheel, "cylinder", (0.6, 0.6, 0.2), quaternion=(0.7071, 0.7071, 0.0, 0.0)))
        inner = ("chassis", (x, 0.5 * y, 0.25))
        parts.append(Link(f"{corner}_arm", "link", (inner, (wheel, (0.0, 0.0, 0.0))), 0.012))
        top = ("chassis", (x, 0.8 * y, 0.8))
        parts.append(Link(f"{corner}_spring", "spring", (top, (wheel, (0.0, 0.0, 0.0))), 0.045))
    return parts


def circle(duration_s: float = 3.0, metadata: Mapping[str, Any] | None = None, controller: str = "ars") -> Recording:
    """Return one run at 1 kHz, with poses at 100 Hz."""
    time_s = np.arange(round(duration_s * 1000)) * 1e-3
    yaw = SPEED_MPS / RADIUS_M * time_s
    x, y = RADIUS_M * np.sin(yaw), RADIUS_M * (1.0 - np.cos(yaw))
    columns: dict[str, np.ndarray | float] = {
        "x_m": x, "y_m": y, "yaw_rad": yaw, "yaw_rate_radps": SPEED_MPS / RADIUS_M, "yaw_rate_desired_radps": 0.19,
        "ay_mps2": SPEED_MPS**2 / RADIUS_M, "sideslip_rad": -0.01, "steering_wheel_rad": 1.0,
        "rear_steer_rad": 0.02, "rear_steer_demand_rad": 0.02,
        "superposition_rad": 1e-6, "superposition_demand_rad": 0.0,
    }  # fmt: skip
    cos, sin = np.cos(yaw), np.sin(yaw)
    for corner, (ahead, left) in WHEELS.items():
        columns |= {
            f"{corner}_tyre_fx_N": 0.0, f"{corner}_tyre_fy_N": FY_N, f"{corner}_tyre_fz_N": 3500.0,
            f"{corner}_friction_utilisation": USE, f"{corner}_steer_rad": STEER_RAD if corner[0] == "f" else 0.0,
            f"{corner}_contact_x_m": x + cos * ahead - sin * left,
            f"{corner}_contact_y_m": y + sin * ahead + cos * left,
            f"{corner}_arm_force_N": 800.0,
        }  # fmt: skip
    values = np.column_stack([np.broadcast_to(column, time_s.shape) for column in columns.values()])
    table = [Channel(name, "", "", "links" if name.endswith("_arm_force_N") else "vehicle") for name in columns]
    return Recording(
        table,
        time_s,
        values,
        poses=_poses(time_s[::10], x[::10], y[::10], yaw[::10]),
        metadata={"maneuver": {"name": "circle", "title": "A circle"}, "controller": controller, **(metadata or {})},
        metrics={"yaw_rate_peak_radps": 0.2, "lag_s": float("nan")},
        scene=scene(),
    )


def _poses(time_s: np.ndarray, x: np.ndarray, y: np.ndarray, yaw: np.ndarray) -> Poses:
    names = ("chassis", *(f"{corner}_wheel" for corner in CORNERS))
    at = np.zeros((len(time_s), len(names), 3))
    turn = np.zeros((len(time_s), len(names), 4))
    heading = Rotation.from_euler("z", yaw[:, None])
    at[:, 0] = np.column_stack([x, y, np.zeros_like(x)])
    turn[:, 0] = heading.as_quat(scalar_first=True)
    spin = Rotation.from_euler("y", SPEED_MPS / WHEEL_RADIUS_M * time_s[:, None])
    for index, (corner, (ahead, left)) in enumerate(WHEELS.items(), start=1):
        at[:, index] = at[:, 0] + heading.apply((ahead, left, WHEEL_RADIUS_M))
        steer = Rotation.from_euler("z", STEER_RAD if corner[0] == "f" else 0.0)
        turn[:, index] = (heading * steer * spin).as_quat(scalar_first=True)
    return Poses(time_s, names, at, turn)


COURSE: dict[str, Any] = {
    "path": {"x_m": [0.0, 10.0, 20.0, 300.0], "y_m": [0.0, 1.0, 4.0, 4.0]},
    "lanes": [{"name": "side", "start_x_m": 5.0, "end_x_m": 15.0, "right_y_m": -1.0, "left_y_m": 3.0}],
    "cones": [[5.0, -1.0], [5.0, 3.0]],
    "last_gate_x_m": 15.0,
}

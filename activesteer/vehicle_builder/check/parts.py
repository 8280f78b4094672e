"""Parts that a car must have, by name."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import mujoco

from activesteer.conventions import CORNERS
from activesteer.errors import nearest_names
from activesteer.vehicle_builder.check.findings import Finding

_KINDS: Final = {
    "body": (mujoco.mjtObj.mjOBJ_BODY, "nbody"),
    "joint": (mujoco.mjtObj.mjOBJ_JOINT, "njnt"),
    "site": (mujoco.mjtObj.mjOBJ_SITE, "nsite"),
    "tendon": (mujoco.mjtObj.mjOBJ_TENDON, "ntendon"),
    "actuator": (mujoco.mjtObj.mjOBJ_ACTUATOR, "nu"),
    "sensor": (mujoco.mjtObj.mjOBJ_SENSOR, "nsensor"),
}


def _each(*parts: str) -> tuple[str, ...]:
    return tuple(f"{corner}_{part}" for part in parts for corner in CORNERS)


_NEEDED: Final = {
    "body": ("chassis", "rack", *_each("knuckle", "wheel")),
    "joint": ("root", "rack", "steering_wheel", "superposition", "rl_steer", "rr_steer", *_each("spin")),
    "site": ("origin", "cg", "front_axle", *_each("wheel_centre")),
    "tendon": ("steering_column", *_each("damper", "spring")),
    "actuator": (
        "steering_wheel", "superposition", "rl_steer", "rr_steer",
        *_each("drive", "brake", "slip_x", "slip_y", "slip_z"),
    ),
    "sensor": (
        "cg_accelerometer", "cg_gyro", "cg_velocimeter", "cg_position", "chassis_orientation", "cg_velocity",
        "front_axle_position", "steering_wheel_angle", "superposition_angle", "rack_travel", "rl_steer_angle",
        "rr_steer_angle", *_each("wheel_speed", "wheel_position", "wheel_axis"),
    ),
}  # fmt: skip
"""Parts that loader, callback, recorder and rig look up."""


def missing_parts(model: mujoco.MjModel) -> Iterator[Finding]:
    """Return one error for each missing part, or one line if none is missing."""
    complete = True
    for word, (kind, count) in _KINDS.items():
        there = [mujoco.mj_id2name(model, kind, index) or "" for index in range(getattr(model, count))]
        for name in _NEEDED[word]:
            if name not in there:
                complete = False
                words = nearest_names(name, [other for other in there if other and other not in _NEEDED[word]])
                yield Finding("parts", f"{word} {name}", "error", "missing", "", f"add it to the MJCF; {words}")
    if complete:
        total = sum(len(names) for names in _NEEDED.values())
        yield Finding("parts", "bodies, joints, sites, tendons, actuators, sensors", "ok", f"all {total} there")

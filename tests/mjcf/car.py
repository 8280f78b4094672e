"""Shared parts of the MJCF tests: the contract of names, and ways to load the car."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from activesteer.core.conventions import CORNERS, GRAVITY_MPS2

FOLDER = Path(__file__).resolve().parents[2] / "models" / "mjcf" / "compact"

TYRE_RADIUS_M = 0.316
TYRE_STIFFNESS_NPM = 220e3

FRONT, REAR = CORNERS[:2], CORNERS[2:]
FRONT_LINKS = ("lca_front", "lca_rear", "tie_rod")
REAR_LINKS = ("spring_link", "toe_link", "camber_link", "trailing_lower", "trailing_upper")

LINKS = [f"{c}_{link}" for c in FRONT for link in FRONT_LINKS] + [f"{c}_{link}" for c in REAR for link in REAR_LINKS]

BODIES = (
    ["chassis"]
    + [f"{c}_{part}" for c in FRONT for part in ("strut", "knuckle", "wheel")]
    + [f"{c}_{part}" for c in REAR for part in ("damper_rod", "knuckle", "carrier", "wheel")]
    + ["rack", "steering_wheel", "superposition"]
)
JOINTS = (
    ["root"]
    + [f"{c}_{joint}" for c in FRONT for joint in ("mount_x", "mount_y", "mount_z", "topmount", "jounce", "spin")]
    + [f"{c}_{joint}" for c in REAR for joint in ("mount_z", "x", "y", "z", "rot", "steer", "spin")]
    + ["rack", "steering_wheel", "superposition"]
)
MOUNTS = [f"{c}_mount_{axis}" for c in FRONT for axis in "xyz"] + [f"{c}_mount_z" for c in REAR]
TENDONS = (
    LINKS
    + MOUNTS
    + [f"{c}_{part}" for part in ("spring", "damper") for c in CORNERS]
    + ["front_anti_roll_bar", "rear_anti_roll_bar", "steering_column"]
)
ACTUATORS = (
    ["steering_wheel", "superposition", "rl_steer", "rr_steer"]
    + [f"{c}_{part}" for part in ("drive", "brake") for c in CORNERS]
    + [f"{c}_damper_friction" for c in CORNERS]
    + ["rack_friction"]
    + [f"{c}_slip_{axis}" for c in CORNERS for axis in "xyz"]
)
SENSORS = (
    ["cg_accelerometer", "cg_gyro", "cg_velocimeter", "cg_position", "chassis_orientation", "cg_velocity"]
    + ["front_axle_position"]
    + ["steering_wheel_angle", "superposition_angle", "rack_travel", "rl_steer_angle", "rr_steer_angle"]
    + [f"{c}_{part}" for part in ("wheel_speed", "wheel_position", "wheel_axis") for c in CORNERS]
)


def car() -> mujoco.MjModel:
    """Return the car as simulations load it."""
    return mujoco.MjModel.from_xml_path(str(FOLDER / "compact.xml"))


def held_car() -> mujoco.MjModel:
    """Return the car with its chassis fixed to the world, without the free joint and the keyframes."""
    spec = mujoco.MjSpec.from_file(str(FOLDER / "compact.xml"))
    spec.delete(spec.joint("root"))
    for key in spec.keys:
        spec.delete(key)
    return spec.compile()


def names(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> list[str]:
    """Return the names of all objects of a kind, in the order of the model."""
    return [mujoco.mj_id2name(model, kind, i) for i in range(count)]


def warnings(data: mujoco.MjData) -> int:
    """Return the number of MuJoCo warnings of this simulation."""
    return int(sum(warning.number for warning in data.warning))


def put_on_tyre_springs(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Set the vertical force of four linear tyres on a level road at z = 0.

    Args:
        model: The car.
        data: Its state; `xfrc_applied` of the wheels is overwritten.

    Returns:
        Wheel loads [N], shape (4,), >= 0, by corner.
    """
    loads_N = np.zeros(4)
    for i, corner in enumerate(CORNERS):
        wheel = model.body(f"{corner}_wheel").id
        axis = data.xmat[wheel].reshape(3, 3)[:, 1]
        across = np.hypot(axis[0], axis[1])  # cosine of the camber angle
        loads_N[i] = max(0.0, TYRE_STIFFNESS_NPM * (TYRE_RADIUS_M - data.xpos[wheel, 2] / across))
        # The lowest point of the tilted wheel lies beside the wheel centre: the force has a moment about it.
        contact = data.xpos[wheel] - (TYRE_RADIUS_M - loads_N[i] / TYRE_STIFFNESS_NPM) * np.array(
            [-axis[0] * axis[2] / across, -axis[1] * axis[2] / across, across]
        )
        force_N = np.array([0.0, 0.0, loads_N[i]])
        data.xfrc_applied[wheel] = np.concatenate([force_N, np.cross(contact - data.xipos[wheel], force_N)])
    return loads_N


def weight_N(model: mujoco.MjModel) -> float:
    """Return the weight of the whole car [N]."""
    return float(model.body_mass.sum()) * GRAVITY_MPS2


def wheel_angles_deg(model: mujoco.MjModel, data: mujoco.MjData, corner: str) -> tuple[float, float]:
    """Return steer angle [deg], left positive, and camber [deg], top inwards negative, of a wheel."""
    axis = data.xmat[model.body(f"{corner}_wheel").id].reshape(3, 3)[:, 1]
    inwards = 1.0 if corner.endswith("l") else -1.0
    return float(np.degrees(np.arctan2(-axis[0], axis[1]))), float(-inwards * np.degrees(np.arcsin(axis[2])))

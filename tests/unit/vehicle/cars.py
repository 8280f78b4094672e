"""Cars for the unit tests: as shipped, lifted off the road, and with a changed model file."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from activesteer.core.conventions import CORNERS
from activesteer.scenario import load_car
from activesteer.vehicle import Vehicle
from activesteer.vehicle import force_block as fb


def standing(overrides: Mapping[str, Any] | None = None) -> Vehicle:
    """Return the car in static ride."""
    return load_car(overrides=overrides).on()


def floating(overrides: Mapping[str, Any] | None = None) -> Vehicle:
    """Return the car a metre above the road, without weight and at rest, with unloaded springs in equilibrium."""
    vehicle = standing(overrides)
    model, data = vehicle.model, vehicle.data
    model.opt.gravity[:] = 0.0
    for index in range(model.ntendon):
        name = model.tendon(index).name
        if name.endswith("_spring"):
            model.tendon_stiffness[index] = 0.0
    mujoco.mj_resetData(model, data)
    data.qpos[2] = 1.0
    mujoco.mj_forward(model, data)
    return vehicle


def changed_model(folder: Path, file: str, old: str, new: str) -> Path:
    """Copy the car's model with one text replaced; return its main file."""
    source = load_car().mjcf
    target = folder / "model"
    shutil.copytree(source.parent, target)
    text = (target / file).read_text(encoding="utf-8")
    assert old in text
    (target / file).write_text(text.replace(old, new), encoding="utf-8")
    # Its length would not fit a model with other joints.
    (target / "keyframes.xml").write_text("<mujocoinclude><keyframe/></mujocoinclude>", encoding="utf-8")
    return target / source.name


def record(vehicle: Vehicle, corner: str, field: str) -> float:
    """Return the values of one wheel that the callback provides for the recorder."""
    return float(vehicle.data.userdata[fb.output_slot(CORNERS.index(corner), field)])


def dof(vehicle: Vehicle, joint: str) -> int:
    return int(vehicle.model.jnt_dofadr[vehicle.model.joint(joint).id])


def actuator(vehicle: Vehicle, name: str) -> int:
    return int(vehicle.model.actuator(name).id)


def activation(vehicle: Vehicle, name: str) -> float:
    return float(vehicle.data.act[vehicle.model.actuator_actadr[actuator(vehicle, name)]])


def step(vehicle: Vehicle, count: int) -> None:
    for _ in range(count):
        mujoco.mj_step(vehicle.model, vehicle.data)


def tilted_and_moving(vehicle: Vehicle, rng: np.random.Generator) -> None:
    """A pose that no symmetry helps: yawed, pitched, rolled, steered, every joint and carcass moving.

    Pressed into the road by some centimetres, so that all wheels touch it.
    """
    model, data = vehicle.model, vehicle.data
    mujoco.mju_euler2Quat(data.qpos[3:7], np.array([0.7, 0.012, 0.016]), "zyx")
    mujoco.mj_integratePos(model, data.qpos, 0.003 * rng.normal(size=model.nv), 1.0)
    mujoco.mj_kinematics(model, data)
    heights = [data.xpos[model.body(f"{corner}_wheel").id, 2] for corner in CORNERS]
    data.qpos[2] += 0.29 - max(heights)
    data.qvel[:] = 0.2 * rng.normal(size=model.nv)
    data.qvel[:2] += 15.0 * np.array([np.cos(0.65), np.sin(0.65)])
    for corner in CORNERS:
        data.qvel[dof(vehicle, f"{corner}_spin")] = 50.0 + rng.normal()
        for axis in "xy":
            address = model.actuator_actadr[actuator(vehicle, f"{corner}_slip_{axis}")]
            data.act[address] = 0.01 * rng.normal()

"""Checks of the car at rest on its tyres: loads, height, tyres, dampers, and stability."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import mujoco
import numpy as np

from activesteer.conventions import CORNERS, GRAVITY_MPS2
from activesteer.errors import SimulationDiverged
from activesteer.scenario import CarSpec
from activesteer.signals import ActuatorCommand, DriverCommand
from activesteer.vehicle import Vehicle, engine_warnings_held
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.statics import mass_properties
from activesteer.vehicle_builder.check.findings import Finding, judged

_STEPS: Final = 500
_STILL_MPS: Final = 0.01


def standing(vehicle: Vehicle, car: CarSpec) -> Iterator[Finding]:
    """Return all findings about the car at rest."""
    model, data = vehicle.model, vehicle.data
    load = fb.wheel_outputs(data, 4)["fz_N"].copy()
    body = mass_properties(model)
    yield Finding("standing", "static equilibrium", "ok", "found")
    yield from _loads(load, body.mass_kg)
    yield from _height(vehicle)
    yield from _stability(vehicle, float(data.subtree_com[0, 2]))
    yield from _inertia(model)
    yield from _dampers(car)
    yield from _brakes(vehicle, car, body.mass_kg)
    yield from _controllers_view(car, body.mass_kg, float(body.inertia_kgm2[2, 2]))
    yield from _stays(vehicle)
    yield from _tyres(car, load)


def _loads(load_N: np.ndarray, mass_kg: float) -> Iterator[Finding]:
    yield judged("mass", mass_kg)
    yield judged("front_share", 100.0 * load_N[:2].sum() / load_N.sum())
    for axle, left, right in (("front", 0, 1), ("rear", 2, 3)):
        difference = 100.0 * abs(load_N[left] - load_N[right]) / load_N[left : right + 1].mean()
        yield judged("wheel_load_difference", difference, axle=axle)


def _height(vehicle: Vehicle) -> Iterator[Finding]:
    """Check the distance of the wheels from their design position."""
    model, data = vehicle.model, vehicle.data
    design = mujoco.MjData(model)
    mujoco.mj_kinematics(model, design)
    chassis = model.body("chassis").id
    turn = data.xmat[chassis].reshape(3, 3).T
    for axle, corners in (("front", CORNERS[:2]), ("rear", CORNERS[2:])):
        travel = 0.0
        for corner in corners:
            wheel = model.body(f"{corner}_wheel").id
            now = (turn @ (data.xpos[wheel] - data.xpos[chassis]))[2]
            travel += 500.0 * float(now - (design.xpos[wheel, 2] - design.xpos[chassis, 2]))
        yield judged("wheel_travel", travel, axle=axle)
    w, x, y, z = data.qpos[3:7]
    pitch = math.degrees(math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))))
    roll = math.degrees(2.0 * math.atan2(x, w))
    yield judged("pitch", pitch)
    yield judged("roll", roll)


def _stability(vehicle: Vehicle, height_m: float) -> Iterator[Finding]:
    wheels = [vehicle.data.xpos[vehicle.model.body(f"{corner}_wheel").id, 1] for corner in CORNERS]
    track = 0.5 * (wheels[0] - wheels[1] + wheels[2] - wheels[3])
    yield judged("cg_height", height_m)
    yield judged("stability_factor", track / (2.0 * height_m))


def _inertia(model: mujoco.MjModel) -> Iterator[Finding]:
    body = mass_properties(model)
    front, rear = (model.body(f"{corner}_wheel").id for corner in ("fl", "rl"))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    to_front, to_rear = data.xpos[front, 0] - body.cg_m[0], body.cg_m[0] - data.xpos[rear, 0]
    yield judged("yaw_inertia", float(body.inertia_kgm2[2, 2] / (body.mass_kg * to_front * to_rear)))


def _tyres(car: CarSpec, load_N: np.ndarray) -> Iterator[Finding]:
    for axle, tyre, load in zip(("front", "rear"), car.tyres, (load_N[:2].mean(), load_N[2:].mean()), strict=True):
        yield judged("tyre_load", float(load) / float(tyre["FNOMIN"]), axle=axle)
        yield judged("tyre_reserve", float(tyre["FZMAX"]) / float(load), axle=axle)


def _dampers(car: CarSpec) -> Iterator[Finding]:
    for axle, curve in (("front", car.config.dampers.front), ("rear", car.config.dampers.rear)):
        pushes = [force * speed < 0.0 for speed, force in zip(curve.velocity_mps, curve.force_N, strict=True)]
        bad = any(pushes) or float(np.interp(0.0, curve.velocity_mps, curve.force_N)) != 0.0
        yield Finding(
            "standing", f"{axle} damper resists its motion", "error" if bad else "ok", "no" if bad else "yes", "",
            "force_N has the sign of velocity_mps, both positive in compression, and is 0 at rest" if bad else "",
        )  # fmt: skip
        slope = np.abs(np.diff(curve.force_N) / np.diff(curve.velocity_mps)).max()
        yield judged("damper_slope", float(slope), axle=axle)


def _brakes(vehicle: Vehicle, car: CarSpec, mass_kg: float) -> Iterator[Finding]:
    brakes = car.config.brakes
    radius = vehicle.data.xpos[vehicle.model.body("fl_wheel").id, 2]
    maximum = 2.0 * (brakes.front_torque_Nm + brakes.rear_torque_Nm) / radius / (mass_kg * GRAVITY_MPS2)
    yield judged("deceleration", float(maximum))


def _controllers_view(car: CarSpec, mass_kg: float, yaw_inertia: float) -> Iterator[Finding]:
    track = car.config.single_track
    for what, known, real in (("mass", track.mass_kg, mass_kg), ("yaw inertia", track.yaw_inertia_kgm2, yaw_inertia)):
        yield judged("known", 100.0 * (known / real - 1.0), what=what)


def _stays(vehicle: Vehicle) -> Iterator[Finding]:
    """Check the stability during half a second at rest."""
    try:
        with engine_warnings_held():
            for _ in range(_STEPS):
                vehicle.step(DriverCommand(), ActuatorCommand())
        speed = float(np.abs(vehicle.data.qvel[:6]).max())
        warned = int(sum(warning.number for warning in vehicle.data.warning))
    except SimulationDiverged:
        speed, warned = math.inf, 0
    good = math.isfinite(speed) and speed < _STILL_MPS and not warned
    words = "yes" if good else f"no: {speed:.3g} m/s, rad/s"
    yield Finding(
        "standing", "stands still for 0.5 s", "ok" if good else "error", words, "",
        "" if good else "look for a part without stiffness or damping, or with a stiffness too large for the time step",
    )  # fmt: skip

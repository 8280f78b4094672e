"""Match an axle of curves to its measurements on our own rig, by removing the deflection under load from its curves.

A measured curve belongs to the loaded axle, the curve of the guide to the unloaded axle. They differ by a few
hundredths of a degree, the effect of the wheel load at its small lever arms. The curves are corrected by the difference
that the rig measures.
"""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline

from activesteer.conventions import Array
from activesteer.rigs.kc.held_car import Case, HeldCar
from activesteer.rigs.kc.sweep import INWARDS
from activesteer.vehicle.curve_axles import OVER_RACK, OVER_TRAVEL, AxleCurves
from activesteer.vehicle_builder.design import Axle
from activesteer.vehicle_builder.trimmed import TrimmedAxle

NEAR_ENOUGH: Final = 5e-6
"""Smallest correction of a curve [m, rad]; 50 times as much for caster, which moves no contact point."""
_CASTER: Final = 0.02


def match_travel(axles: tuple[Axle, ...], trimmed: dict[str, TrimmedAxle], held: HeldCar) -> float:
    """Correct the curves over travel of all guided axles, and return the largest correction [m, rad].

    Args:
        axles: The guided axles.
        trimmed: Their curves; changed.
        held: The car on the rig.
    """
    heights = np.zeros((len(_measured_curves(axles[0]).travel_m), 4))
    for axle in axles:
        heights[:, _wheels(axle)] = np.array(_measured_curves(axle).travel_m)[:, None]
    cases = [Case(height_m=row) for row in heights]
    poses, loads, standing, standing_loads = _swept(held, cases, heights[:, _wheels(axles[0])][:, 0])
    greatest = 0.0
    for axle in axles:
        measured, curves = _measured_curves(axle), trimmed[axle.name].curves
        assert curves is not None
        assert axle.measured is not None
        wheels = _wheels(axle)
        now = _mean(poses[:, wheels], wheels)
        at_rest = _mean(standing[None, wheels], wheels)[0]
        now[:, [0, 1, 3]] -= at_rest[[0, 1, 3]]
        changes = {}
        for column, name in enumerate(OVER_TRAVEL):
            missing = np.array(getattr(measured, name)) - now[:, column]
            greatest = max(greatest, _size(name, missing))
            changes[name] = _corrected(curves, name, missing)
        if axle.measured.wheel_load_N is not None:
            rise = (loads[:, wheels] - standing_loads[wheels]).mean(axis=1)
            changes["load_N"] = _corrected(curves, "load_N", np.array(axle.measured.wheel_load_N) - rise)
        trimmed[axle.name].curves = dataclasses.replace(curves, **changes)
    return greatest


def match_steering(axle: Axle, trimmed: TrimmedAxle, held: HeldCar, pinion_m: float) -> float:
    """Correct the curves over the rack, and return the largest correction [m, rad].

    Args:
        axle: The front axle, guided.
        trimmed: Its curves; changed.
        held: The car on the rig.
        pinion_m: Rack travel per steering wheel angle [m/rad].
    """
    measured, curves = _measured_curves(axle), trimmed.curves
    assert curves is not None
    rack = np.array(measured.rack_m)
    cases = [Case("contact", steering_wheel_rad=float(at / pinion_m)) for at in rack]
    there = np.empty(len(rack))
    poses, _, standing, _ = _swept(held, cases, rack, there)
    # The column deflects slightly, so the rack is not exactly at the position of the steering wheel.
    there = 0.5 * (there - there[::-1])
    # The left wheel at s and the right wheel at -s are mirror images.
    both = np.stack([_left(poses[:, 0], 0), _left(poses[::-1, 1], 1)])
    rest = np.stack([_left(standing[None, 0], 0), _left(standing[None, 1], 1)])
    now = (both - rest).mean(axis=0)
    lifted, travel = now[:, 5], np.array(measured.travel_m)
    greatest, changes = 0.0, {}
    for column, (name, by_travel) in enumerate(zip(OVER_RACK, OVER_TRAVEL, strict=True)):
        over = np.array(getattr(measured, by_travel))
        change = now[:, column] - np.interp(lifted, travel, over) + np.interp(0.0, travel, over)
        target = CubicSpline(rack, getattr(measured, name))(there)
        missing = np.interp(rack, there, target - (-change if name == "rack_steer_rad" else change))
        greatest = max(greatest, _size(name, missing))
        changes[name] = _corrected(curves, name, missing)
    trimmed.curves = dataclasses.replace(curves, **changes)
    return greatest


def _measured_curves(axle: Axle) -> AxleCurves:
    assert axle.measured is not None
    return axle.measured.curves


def _wheels(axle: Axle) -> list[int]:
    return [0, 1] if axle.name == "front" else [2, 3]


def _swept(
    held: HeldCar, cases: list[Case], order: Array, rack: Array | None = None
) -> tuple[Array, Array, Array, Array]:
    """Return poses (n, 4, 6) and loads (n, 4) of a sweep, from its middle outwards, and those of the standing car.

    `rack` is filled with the travel of the rack [m].
    """
    held.reset()
    standing, standing_loads = _poses(held), held.load_N.copy()
    poses, loads = np.empty((len(cases), 4, 6)), np.empty((len(cases), 4))
    middle = int(np.abs(order).argmin())
    for side in (range(middle, len(cases)), range(middle - 1, -1, -1)):
        held.reset()
        for index in side:
            held.equilibrium(cases[index])
            poses[index], loads[index] = _poses(held), held.load_N
            if rack is not None:
                rack[index] = _rack(held)
    held.reset()
    return poses, loads, standing, standing_loads


def _poses(held: HeldCar) -> Array:
    """Return forwards, left, camber, caster, toe, upwards of each wheel, with the signs of the rig; shape (4, 6)."""
    rows = []
    for corner in range(4):
        pose = held.wheel(corner)
        x, y, z = pose.rotation[:, 1]
        caster = np.arctan2(pose.rotation[2, 0], pose.rotation[0, 0])
        rows.append([
            pose.centre_m[0], pose.centre_m[1], np.arcsin(z) * INWARDS[corner], caster,
            np.arctan2(-x, y) * INWARDS[corner], pose.centre_m[2],
        ])  # fmt: skip
    return np.array(rows)


def _rack(held: HeldCar) -> float:
    return float(held.data.qpos[int(held.model.joint("rack").qposadr[0])])


def _left(poses: Array, corner: int) -> Array:
    """Return the poses of a wheel as for the left wheel: outwards instead of left."""
    return poses * np.array([1.0, -INWARDS[corner], 1.0, 1.0, 1.0, 1.0])


def _mean(poses: Array, wheels: list[int]) -> Array:
    return np.mean([_left(poses[:, index], wheel) for index, wheel in enumerate(wheels)], axis=0)


def _size(name: str, missing: Array) -> float:
    return float(np.abs(missing).max()) * (_CASTER if name.endswith("caster_rad") else 1.0)


def _corrected(curves: AxleCurves, name: str, missing: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.7g}") for value in np.array(getattr(curves, name)) + missing)

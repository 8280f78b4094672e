"""Makes an axle of curves give on our own rig what was measured of it: what load bends is taken out of its curves.

A measured curve is that of the loaded axle; the guide's own is the one without load. They differ by a few hundredths of
a degree, by what the wheel load does at its small levers. The rig measures, the difference goes into the curves.
"""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline

from activesteer.conventions import Array
from activesteer.rigs.kc.held_car import Case, HeldCar
from activesteer.rigs.kc.sweep import INWARDS
from activesteer.vehicle.axle_curves import OVER_RACK, OVER_TRAVEL, AxleCurves
from activesteer.vehicle_builder.design import Axle
from activesteer.vehicle_builder.trimmed import TrimmedAxle

NEAR_ENOUGH: Final = 5e-6
"""Correction of a curve below which it stays [m, rad]; of caster 50 times as much, which moves no contact."""
_CASTER: Final = 0.02


def match_travel(axles: tuple[Axle, ...], found: dict[str, TrimmedAxle], held: HeldCar) -> float:
    """Corrects the curves over travel of all guided axles.

    Args:
        axles: The guided axles.
        found: Their curves; changed.
        held: The car on the rig.

    Returns:
        Greatest correction [m, rad].
    """
    heights = np.zeros((len(_asked(axles[0]).travel_m), 4))
    for axle in axles:
        heights[:, _wheels(axle)] = np.array(_asked(axle).travel_m)[:, None]
    cases = [Case(height_m=row) for row in heights]
    poses, loads, standing, standing_loads = _swept(held, cases, heights[:, _wheels(axles[0])][:, 0])
    greatest = 0.0
    for axle in axles:
        asked, curves = _asked(axle), found[axle.name].curves
        assert curves is not None
        assert axle.measured is not None
        wheels = _wheels(axle)
        now = _mean(poses[:, wheels], wheels)
        at_rest = _mean(standing[None, wheels], wheels)[0]
        now[:, [0, 1, 3]] -= at_rest[[0, 1, 3]]
        changes = {}
        for column, name in enumerate(OVER_TRAVEL):
            missing = np.array(getattr(asked, name)) - now[:, column]
            greatest = max(greatest, _size(name, missing))
            changes[name] = _corrected(curves, name, missing)
        if axle.measured.wheel_load_N is not None:
            rise = (loads[:, wheels] - standing_loads[wheels]).mean(axis=1)
            changes["load_N"] = _corrected(curves, "load_N", np.array(axle.measured.wheel_load_N) - rise)
        found[axle.name].curves = dataclasses.replace(curves, **changes)
    return greatest


def match_steering(axle: Axle, found: TrimmedAxle, held: HeldCar, pinion_m: float) -> float:
    """Corrects the curves over the rack.

    Args:
        axle: The front axle, guided.
        found: Its curves; changed.
        held: The car on the rig.
        pinion_m: Rack travel per steering wheel angle [m/rad].

    Returns:
        Greatest correction [m, rad].
    """
    asked, curves = _asked(axle), found.curves
    assert curves is not None
    rack = np.array(asked.rack_m)
    cases = [Case("contact", steering_wheel_rad=float(at / pinion_m)) for at in rack]
    there = np.empty(len(rack))
    poses, _, standing, _ = _swept(held, cases, rack, there)
    # The column gives way a little: the rack is not quite where the steering wheel asks for it.
    there = 0.5 * (there - there[::-1])
    # The left wheel at s and the right one at -s are mirror images.
    both = np.stack([_left(poses[:, 0], 0), _left(poses[::-1, 1], 1)])
    rest = np.stack([_left(standing[None, 0], 0), _left(standing[None, 1], 1)])
    now = (both - rest).mean(axis=0)
    lifted, travel = now[:, 5], np.array(asked.travel_m)
    greatest, changes = 0.0, {}
    for column, (name, by_travel) in enumerate(zip(OVER_RACK, OVER_TRAVEL, strict=True)):
        over = np.array(getattr(asked, by_travel))
        change = now[:, column] - np.interp(lifted, travel, over) + np.interp(0.0, travel, over)
        wanted = CubicSpline(rack, getattr(asked, name))(there)
        missing = np.interp(rack, there, wanted - (-change if name == "rack_steer_rad" else change))
        greatest = max(greatest, _size(name, missing))
        changes[name] = _corrected(curves, name, missing)
    found.curves = dataclasses.replace(curves, **changes)
    return greatest


def _asked(axle: Axle) -> AxleCurves:
    assert axle.measured is not None
    return axle.measured.curves


def _wheels(axle: Axle) -> list[int]:
    return [0, 1] if axle.name == "front" else [2, 3]


def _swept(
    held: HeldCar, cases: list[Case], order: Array, rack: Array | None = None
) -> tuple[Array, Array, Array, Array]:
    """Poses (n, 4, 6) and loads (n, 4) of a sweep, from its middle outwards; and those of the standing car.

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
    """Forwards, left, camber, caster, toe, upwards of each wheel, signs as the rig's; shape (4, 6)."""
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
    """Poses of a wheel as those of the left one: outwards instead of left."""
    return poses * np.array([1.0, -INWARDS[corner], 1.0, 1.0, 1.0, 1.0])


def _mean(poses: Array, wheels: list[int]) -> Array:
    return np.mean([_left(poses[:, index], wheel) for index, wheel in enumerate(wheels)], axis=0)


def _size(name: str, missing: Array) -> float:
    return float(np.abs(missing).max()) * (_CASTER if name.endswith("caster_rad") else 1.0)


def _corrected(curves: AxleCurves, name: str, missing: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.7g}") for value in np.array(getattr(curves, name)) + missing)

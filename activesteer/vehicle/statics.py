"""The car at rest: static equilibrium, mass properties, load, and position on the road."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable
from typing import Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from activesteer.core.conventions import Array
from activesteer.errors import ModelError

_ITERATIONS: Final = 40
_DIFFERENCE: Final = 1e-7
"""Step of the finite differences [m, rad]: links of 1e7 N/m change their force by 1 N."""
_LARGEST_STEP: Final = 0.02
"""Largest change of a coordinate in one iteration [m, rad], so that stops are approached from outside."""
_ROUNDING_N: Final = 1e-4
"""Residual force below which a step without improvement ends the search [N, N m]."""
_TOLERANCE_N: Final = 1e-7
"""Residual force at which the search ends [N, N m]. Weight is 1.4e4."""


def static_ride(model: mujoco.MjModel, data: mujoco.MjData, held: NDArray[np.intp]) -> None:
    """Move the car, which stands near it, into static equilibrium by Newton's method on the forces at rest."""
    # The tyres carry their load, and no lateral force except from their own asymmetry.
    free = np.setdiff1d(np.arange(model.nv), held)
    data.qvel[:] = 0.0
    if model.na:
        data.act[:] = 0.0
    residual = _residual(model, data, free)
    for _ in range(_ITERATIONS):
        if np.abs(residual).max() < _TOLERANCE_N:
            return
        stiffness = slopes(model, data, free, residual, lambda: _residual(model, data, free))
        try:
            step = np.linalg.lstsq(stiffness, -residual, rcond=None)[0]
        except np.linalg.LinAlgError as reason:
            bad = free[~np.isfinite(residual + stiffness.sum(axis=1))]
            joint = model.joint(int(model.dof_jntid[bad[0]])).name if bad.size else "unknown"
            raise ModelError(f"no static equilibrium: the force at joint {joint!r} is not finite") from reason
        largest = np.abs(step).max()
        step *= min(1.0, _LARGEST_STEP / largest) if largest > 0.0 else 0.0
        move_by(model, data, free, step)
        smaller = _residual(model, data, free)
        if np.abs(residual).max() < _ROUNDING_N and (
            largest < 1e-12 or np.abs(smaller).max() >= np.abs(residual).max()
        ):
            # Only rounding is left; no step improves the result.
            return
        residual = smaller
    worst = int(free[np.abs(residual).argmax()])
    joint = model.joint(int(model.dof_jntid[worst])).name
    raise ModelError(
        f"no static equilibrium found in {_ITERATIONS} iterations: {np.abs(residual).max():.3g} N (or N m) remain at "
        f"joint {joint!r}; are the springs' free lengths right for the car's weight?",
        value=joint,
    )


def move_by(model: mujoco.MjModel, data: mujoco.MjData, dofs: list[int] | NDArray[np.intp], change: ArrayLike) -> None:
    """Change the position along some degrees of freedom."""
    move = np.zeros(model.nv)
    move[dofs] = change
    mujoco.mj_integratePos(model, data.qpos, move, 1.0)


def slopes(
    model: mujoco.MjModel, data: mujoco.MjData, dofs: Iterable[int], present: Array, value: Callable[[], Array]
) -> Array:
    """Return finite differences of a vector with respect to each degree of freedom, shape (present, dofs)."""
    start, columns = data.qpos.copy(), []
    for dof in dofs:
        move_by(model, data, [dof], _DIFFERENCE)
        columns.append((value() - present) / _DIFFERENCE)
        data.qpos[:] = start
    return np.array(columns).T.copy()


def _residual(model: mujoco.MjModel, data: mujoco.MjData, free: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the unbalanced generalised force at rest, shape (free.size,)."""
    mujoco.mj_forward(model, data)
    return data.qfrc_smooth[free].copy()


class MassProperties(NamedTuple):
    """Mass, centre of gravity and inertia tensor, in world axes."""

    mass_kg: float
    cg_m: Array
    inertia_kgm2: Array


def mass_properties(
    model: mujoco.MjModel, data: mujoco.MjData | None = None, *, without: Collection[str] = ()
) -> MassProperties:
    """Return the mass properties of a car."""
    placed = mujoco.MjData(model) if data is None else data
    if data is None:
        mujoco.mj_fwdPosition(model, placed)
    places, frames = placed.xipos, placed.ximat
    left_out = {0, *(model.body(name).id for name in without)}
    bodies = [body for body in range(model.nbody) if body not in left_out]
    mass = float(sum(model.body_mass[body] for body in bodies))
    cg = np.sum([model.body_mass[body] * places[body] for body in bodies], axis=0) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        axes = frames[body].reshape(3, 3)
        inertia += axes @ np.diag(model.body_inertia[body]) @ axes.T
        inertia += float(model.body_mass[body]) * point_mass_inertia(places[body] - cg)
    return MassProperties(mass, cg, inertia)


def point_mass_inertia(offset_m: Array) -> Array:
    """Return the inertia tensor of a point mass, per unit mass [m2] (Steiner)."""
    return np.asarray(offset_m @ offset_m * np.eye(3) - np.outer(offset_m, offset_m))


YAW_DOF: Final = 5
"""Place of the yaw rate among the velocities, in a model whose first joint is the free joint of the chassis."""


def turn_chassis_back(data: mujoco.MjData, half_rad: float) -> None:
    """Rotate orientation and velocity of the chassis about the vertical axis at its position."""
    turned = np.empty(4)
    mujoco.mju_mulQuat(turned, np.array([math.cos(half_rad), 0.0, 0.0, -math.sin(half_rad)]), data.qpos[3:7])
    data.qpos[3:7] = turned
    vx, vy = data.qvel[:2]
    cos, sin = math.cos(2 * half_rad), math.sin(2 * half_rad)
    data.qvel[:2] = cos * vx + sin * vy, cos * vy - sin * vx

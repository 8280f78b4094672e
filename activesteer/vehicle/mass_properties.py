"""Mass, centre of gravity and inertia of the whole car as the sum of its bodies."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import mujoco
import numpy as np

from activesteer.conventions import Array


class MassProperties(NamedTuple):
    """Mass properties of a group of bodies.

    Attributes:
        mass_kg: Mass [kg].
        cg_m: Centre of gravity in the world frame, shape (3,) [m].
        inertia_kgm2: Inertia tensor about it, world axes, shape (3, 3) [kg m2].
    """

    mass_kg: float
    cg_m: Array
    inertia_kgm2: Array


def mass_properties(
    model: mujoco.MjModel, data: mujoco.MjData | None = None, *, without: Collection[str] = ()
) -> MassProperties:
    """Return the mass properties of a car.

    Args:
        model: The car.
        data: State with the positions of its bodies; default the design position.
        without: Names of bodies that are left out.

    Returns:
        Mass properties of the other bodies together.
    """
    placed = _in_design_position(model) if data is None else data
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
    """Return the inertia tensor, per mass, of a point mass at a distance `offset_m` from a point [m2] (Steiner)."""
    return np.asarray(offset_m @ offset_m * np.eye(3) - np.outer(offset_m, offset_m))


def _in_design_position(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    return data

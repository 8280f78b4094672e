"""What the car looks like, taken from the geoms of its model, for viewers of recordings."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from activesteer.recording import Primitive

_KINDS: Final = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "sphere",
}


def primitives_of(model: mujoco.MjModel) -> tuple[Primitive, ...]:
    """The visible geoms of all bodies but the world, as simple solids.

    Args:
        model: The car. A capsule becomes a cylinder of the same length; meshes and planes are left out.

    Returns:
        The solids, in the frames of their bodies.
    """
    solids = []
    for index in range(model.ngeom):
        body = int(model.geom_bodyid[index])
        kind = int(model.geom_type[index])
        if body == 0 or kind not in _KINDS:
            continue
        size = model.geom_size[index]
        if _KINDS[kind] == "box" or kind == int(mujoco.mjtGeom.mjGEOM_ELLIPSOID):
            extents = 2.0 * size
        elif _KINDS[kind] == "sphere":
            extents = np.full(3, 2.0 * size[0])
        else:
            extents = np.array([2.0 * size[0], 2.0 * size[0], 2.0 * size[1]])
        solids.append(
            Primitive(
                model.body(body).name,
                _KINDS[kind],
                tuple(extents.tolist()),
                tuple(model.geom_pos[index].tolist()),
                tuple(model.geom_quat[index].tolist()),
                tuple(model.geom_rgba[index].tolist()),
            )
        )
    return tuple(solids)

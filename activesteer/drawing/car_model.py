"""Appearance of a car, from its model: solids, links, springs and dampers."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from activesteer.recording import Link, Primitive, ScenePart

_KINDS: Final = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "sphere",
}


def scene_of(model: mujoco.MjModel) -> tuple[ScenePart, ...]:
    """Return the drawable parts of a car: solids in the frames of their bodies, and links between bodies."""
    return (*primitives_of(model), *links_of(model))


def primitives_of(model: mujoco.MjModel) -> tuple[Primitive, ...]:
    """Return the visible geoms, except meshes and planes, as solids in body frames. Capsules become cylinders."""
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


def links_of(model: mujoco.MjModel) -> tuple[Link, ...]:
    """Return the tendons that run straight from site to site, in the order of the model."""
    # A tendon named `..._spring` or `..._damper` is a spring or damper; others are links. A fixed tendon has no shape,
    # as front springs and dampers along the strut. It is drawn between the sites `NAME_inner` and `NAME_outer`, if any.
    links = []
    for index in range(model.ntendon):
        name = model.tendon(index).name
        first = int(model.tendon_adr[index])
        wraps = slice(first, first + int(model.tendon_num[index]))
        if (model.wrap_type[wraps] == int(mujoco.mjtWrap.mjWRAP_SITE)).all():
            sites = [int(site) for site in model.wrap_objid[wraps]]
        else:
            ends = (f"{name}_inner", f"{name}_outer")
            sites = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, end) for end in ends]
            if -1 in sites:
                continue
        kind = name.rpartition("_")[2]
        links.append(
            Link(
                name,
                kind if kind in ("spring", "damper") else "link",
                tuple(
                    (model.body(model.site_bodyid[site]).name, tuple(model.site_pos[site].tolist())) for site in sites
                ),
                float(model.tendon_width[index]),
                tuple(model.tendon_rgba[index].tolist()),
            )
        )
    return tuple(links)

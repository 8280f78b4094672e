"""First-order motion of a corner at the design position: its travel, and the shortening of its tendons."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ModelError

_ROTATION_M = 0.3
"""Length that makes a rotation comparable with a displacement: the size of a knuckle."""


@dataclass(frozen=True)
class CornerMotion:
    """Motion of one corner.

    Attributes:
        links: Names of its links.
        firmness: Smallest singular value of the directions of the links: 0 if two links constrain the same direction,
            0.05 to 0.5 in cars.
        per_travel: Tendon to shortening per wheel travel in bump, rigid links.
    """

    links: tuple[str, ...]
    firmness: float
    per_travel: dict[str, float]


def corner_motion(model: mujoco.MjModel, corner: str) -> CornerMotion:
    """Return the motion of a corner with held chassis and rack, without springs."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    dofs, scale = _freedoms(model, corner)
    rows = {name: row[dofs] for name, row in _tendon_rows(model, data, corner).items()}
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{corner}_camber") >= 0:
        # Curves guide the wheel: springs and dampers act along the travel, and all else follows it.
        travel = dofs.index(int(model.joint(f"{corner}_z").dofadr[0]))
        return CornerMotion((), 1.0, {name: -float(row[travel]) for name, row in rows.items()})
    links = tuple(name for name in rows if not name.endswith(("_spring", "_damper")))
    jacobian = np.array([rows[name] for name in links]).reshape(len(links), len(dofs)) / scale
    lengths = np.linalg.norm(jacobian, axis=1, keepdims=True)
    _, values, vectors = np.linalg.svd(jacobian / np.where(lengths > 0.0, lengths, 1.0))
    free = len(dofs) - int(np.sum(values > 1e-6))
    if free != 1:
        many = "no way" if free < 1 else f"{free} ways"
        counts = f"{len(dofs)} degrees of freedom and {len(links)} links"
        raise ModelError(f"{counts} leave the wheel {many} to travel; 1 is needed", key=corner)
    direction = vectors[-1] / scale
    along = np.zeros((3, model.nv))
    wheel = model.body(f"{corner}_wheel").id
    mujoco.mj_jac(model, data, along, None, data.xpos[wheel], wheel)
    rise = float(along[2, dofs] @ direction)
    if abs(rise) < 0.05 * float(np.linalg.norm(along[:, dofs] @ direction)):
        raise ModelError(
            "the links let the wheel move, but not up and down; are two of their points exchanged?", key=corner
        )
    per_travel = {name: -float(row @ direction) / rise for name, row in rows.items()}
    return CornerMotion(links, float(values[-1]), per_travel)


def _freedoms(model: mujoco.MjModel, corner: str) -> tuple[list[int], Array]:
    """Return the degrees of freedom of a corner's bodies without spin and steering, and a length for each [m]."""
    dofs, scale = [], []
    for dof in range(model.nv):
        joint = model.joint(int(model.dof_jntid[dof]))
        if not joint.name.startswith(f"{corner}_") or joint.name.endswith(("_spin", "_steer")):
            continue
        dofs.append(dof)
        slide = int(joint.type[0]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
        scale.append(1.0 if slide else _ROTATION_M)
    return dofs, np.array(scale)


def _tendon_rows(model: mujoco.MjModel, data: mujoco.MjData, corner: str) -> dict[str, Array]:
    """Return the Jacobians of a corner's tendons, each of shape (nv,)."""
    rows = {}
    for tendon in range(model.ntendon):
        name = model.tendon(tendon).name
        if name.startswith(f"{corner}_"):
            start, count = int(model.ten_J_rowadr[tendon]), int(model.ten_J_rownnz[tendon])
            row = np.zeros(model.nv)
            row[model.ten_J_colind[start : start + count]] = data.ten_J.ravel()[start : start + count]
            rows[name] = row
    return rows

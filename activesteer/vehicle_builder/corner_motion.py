"""Motion of a corner about the design position, and from there to the standing car."""

from __future__ import annotations

import mujoco
import numpy as np

from activesteer.core.conventions import CORNERS, Array
from activesteer.errors import ModelError
from activesteer.vehicle import Vehicle

_ROTATION_M = 0.3
"""Length that makes a rotation comparable with a displacement: the size of a knuckle."""


def wheel_travel_m(vehicle: Vehicle) -> Array:
    """Return the travel of each wheel from the design position to the standing car [m], shape (4,)."""
    model, data, design = vehicle.model, vehicle.data, mujoco.MjData(vehicle.model)
    mujoco.mj_kinematics(model, design)
    chassis, wheels = model.body("chassis").id, [model.body(f"{corner}_wheel").id for corner in CORNERS]
    turn = data.xmat[chassis].reshape(3, 3).T
    now = [(turn @ (data.xpos[wheel] - data.xpos[chassis]))[2] for wheel in wheels]
    return np.array(now) - (design.xpos[wheels, 2] - design.xpos[chassis, 2])


def corner_motion(model: mujoco.MjModel, corner: str) -> tuple[dict[str, float], float]:
    """Return the shortening of each tendon per wheel travel, and how firmly rigid links hold the wheel."""
    # The firmness is the smallest singular value of the directions of the links: 0 if two links constrain the same
    # direction, 0.05 to 0.5 in cars. Chassis and rack are held, and springs are left out.
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    dofs, lengths = [], []
    for dof in range(model.nv):
        joint = model.joint(int(model.dof_jntid[dof]))
        if joint.name.startswith(f"{corner}_") and not joint.name.endswith(("_spin", "_steer")):
            dofs.append(dof)
            lengths.append(1.0 if int(joint.type[0]) == int(mujoco.mjtJoint.mjJNT_SLIDE) else _ROTATION_M)
    scale = np.array(lengths)
    rows = {name: row[dofs] for name, row in _tendon_rows(model, data, corner).items()}
    if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{corner}_camber") >= 0:
        # Curves guide the wheel: springs and dampers act along the travel, and all else follows it.
        travel = dofs.index(int(model.joint(f"{corner}_z").dofadr[0]))
        return {name: -float(row[travel]) for name, row in rows.items()}, 1.0
    links = tuple(name for name in rows if not name.endswith(("_spring", "_damper")))
    jacobian = np.array([rows[name] for name in links]).reshape(len(links), len(dofs)) / scale
    lengths = np.linalg.norm(jacobian, axis=1, keepdims=True)
    _, values, vectors = np.linalg.svd(jacobian / np.where(lengths > 0.0, lengths, 1.0))
    free = len(dofs) - int(np.sum(values > 1e-6))
    if free != 1:
        many = "no degree of freedom" if free < 1 else f"{free} degrees of freedom"
        counts = f"{len(dofs)} coordinates and {len(links)} links"
        raise ModelError(f"{counts} leave the wheel {many}; exactly 1 is required", key=corner)
    direction = vectors[-1] / scale
    along = np.zeros((3, model.nv))
    wheel = model.body(f"{corner}_wheel").id
    mujoco.mj_jac(model, data, along, None, data.xpos[wheel], wheel)
    rise = float(along[2, dofs] @ direction)
    if abs(rise) < 0.05 * float(np.linalg.norm(along[:, dofs] @ direction)):
        raise ModelError(
            "the links let the wheel move, but not up and down; are two of their points swapped?", key=corner
        )
    return {name: -float(row @ direction) / rise for name, row in rows.items()}, float(values[-1])


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

"""The suspension with rigid links, solved on its own: no engine, nothing of the rig. Constraint equations by scipy.

Read from the MJCF are the hardpoints (sites), the axes of the struts, and the wheels' static angles. A corner is one
rigid body, the knuckle with its wheel, and has six unknowns: the rotation vector of its turn from the design position
and the motion of its wheel centre. Six equations: the lengths of the links; for a strut two more, as the top mount
stays on the strut's axis; and the height of the wheel centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from activesteer.core.conventions import Array

FRONT_LINKS = ("lca_front", "lca_rear", "tie_rod")
REAR_LINKS = ("spring_link", "toe_link", "camber_link", "trailing_lower", "trailing_upper")


@dataclass(frozen=True)
class Pose:
    """Pose of a knuckle in chassis axes."""

    rotation: Array
    centre_m: Array
    axle: Array

    @property
    def steer_deg(self) -> float:
        return float(np.degrees(np.arctan2(-self.axle[0], self.axle[1])))

    def contact_m(self, radius_m: float) -> Array:
        up = np.array([0.0, 0.0, 1.0]) - self.axle[2] * self.axle
        return self.centre_m - radius_m * up / np.linalg.norm(up)


class RigidCorner:
    """One corner with rigid links."""

    def __init__(self, model: mujoco.MjModel, corner: str) -> None:
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        chassis = data.xpos[model.body("chassis").id].copy()

        def site(name: str) -> Array:
            return data.site_xpos[model.site(f"{corner}_{name}").id] - chassis

        wheel = model.body(f"{corner}_wheel").id
        self.centre_m = data.xpos[wheel] - chassis
        self.axle = data.xmat[wheel].reshape(3, 3)[:, 1].copy()
        self.strut: tuple[Array, Array] | None = None
        links = REAR_LINKS
        if corner.startswith("f"):
            links = FRONT_LINKS
            top = model.joint(f"{corner}_topmount").pos.copy()
            axis = model.joint(f"{corner}_jounce").axis.copy()
            self.strut = top, axis / np.linalg.norm(axis)
        self.inner = np.array([site(f"{link}_inner") for link in links])
        self.outer = np.array([site(f"{link}_outer") for link in links])
        self.lengths = np.linalg.norm(self.outer - self.inner, axis=1)

    def moved(self, point_m: Array, unknown: Array) -> Array:
        """Return the displaced position of a point of the knuckle."""
        turn = Rotation.from_rotvec(unknown[:3]).as_matrix()
        return self.centre_m + unknown[3:] + (point_m - self.centre_m) @ turn.T

    def _equations(self, unknown: Array, height_m: float) -> Array:
        rows = list(np.linalg.norm(self.moved(self.outer, unknown) - self.inner, axis=1) - self.lengths)
        if self.strut is not None:
            top, axis = self.strut
            turn = Rotation.from_rotvec(unknown[:3]).as_matrix()
            off_axis = turn.T @ (top - self.moved(top, unknown))
            rows += [float(off_axis @ normal) for normal in _normals(axis)]
        rows.append(unknown[5] + self.centre_m[2] - height_m)
        return np.array(rows)

    def solve(self, heights_m: Sequence[float] | Array) -> list[Pose]:
        """Return poses at heights of the wheel centre [m], chassis axes; each search starts from the previous pose."""
        unknown = np.zeros(6)
        poses = []
        for height in heights_m:
            found = root(self._equations, unknown, args=(height,), tol=1e-13)
            if np.abs(found.fun).max() > 1e-10:
                raise AssertionError(found.message)
            unknown = np.asarray(found.x)
            turn = Rotation.from_rotvec(unknown[:3]).as_matrix()
            poses.append(Pose(turn, self.centre_m + unknown[3:], turn @ self.axle))
        return poses

    def point(self, pose: Pose, point_m: Array) -> Array:
        """Return the position in a pose of a point of the knuckle that is given in the design position."""
        return pose.centre_m + pose.rotation @ (point_m - self.centre_m)


def _normals(axis: Array) -> tuple[Array, Array]:
    first = np.cross(axis, [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)

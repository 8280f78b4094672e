"""The car with a held chassis and wheels on pads, in equilibrium by Newton's method.

The rig uses the model of the simulations. The search leaves out the six coordinates of the chassis and the rotation of
the wheels. The chassis is held 1 m above its standing position, so that the tyre forces vanish and pads replace them.
Each pad holds the height of its wheel, pushes straight up at the contact point, and applies a given horizontal force or
moment. A wheel is fastened to its pad, which can also pull.

The wheel is rigid, with its loaded radius in the standing car: the rig measures the suspension. Joint limits are
constraints of the engine and play no part. The rig removes dry friction from the car (see `result`).
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple

import mujoco
import numpy as np

from activesteer.core.conventions import CORNERS, Array
from activesteer.errors import ModelError
from activesteer.vehicle import Vehicle

Springs = Literal["in", "out", "locked"]
Hold = Literal["centre", "contact", "nothing"]

_LIFT_M: Final = 1.0
"""Height by which the chassis is lifted [m]."""
_DIFFERENCE: Final = 1e-7
"""Step of the finite differences [m, rad]: a link of 1e7 N/m changes its force by 1 N."""
_LARGEST_STEP: Final = 0.02
"""Largest step of a coordinate in one iteration [m, rad], so that the search approaches stops from outside."""
_ITERATIONS: Final = 60
_SMALLEST_STEP: Final = 1e-11
"""Newton step below which the search ends if rounding keeps the forces from vanishing [m, rad]."""
_TOLERANCE: Final = 1e-6
"""Residual at which the search ends [N, N m], heights in units of 0.1 mm."""
_ROUNDING: Final = 1e-2
"""Largest residual that rounding may leave. Links of 1e9 N/m leave 1e-4."""
_HEIGHT_SCALE_NPM: Final = 1e4
"""Factor of the heights, which gives their residual the size of the forces."""
_STALE: Final = 0.3
"""Fraction of the residual left by a step above which the stiffness is computed again."""
_LOCK_NPM: Final = 1e9
_NO_MOMENT: Final = np.zeros(3)
_SPRING_ENDINGS: Final = ("_spring", "_damper", "_anti_roll_bar")
"""Endings of the names of the tendons that carry the car."""
MOUNT_ENDINGS: Final = ("_mount_x", "_mount_y", "_mount_z")
"""Endings of the names of top mounts, across (x, y) and along (z) a strut or damper."""


class WheelPose(NamedTuple):
    """Pose of a wheel in world axes. Its rotation about the axle is locked to the knuckle."""

    centre_m: Array
    rotation: Array
    contact_m: Array


@dataclass
class Case:
    """Imposed loads and positions at one point of a sweep, in arrays by corner."""

    hold: Hold = "centre"  # what the pads hold: heights of the wheel centres, heights of the contact points, or nothing
    # Height above the height in the standing car [m], shape (4,)
    height_m: Array = field(default_factory=lambda: np.zeros(4))
    # Force at the contact points in addition to the vertical force of the pads [N], shape (4, 3)
    patch_N: Array = field(default_factory=lambda: np.zeros((4, 3)))
    centre_N: Array = field(default_factory=lambda: np.zeros((4, 3)))  # force at the wheel centres [N], shape (4, 3)
    moment_Nm: Array = field(default_factory=lambda: np.zeros((4, 3)))  # moment on the wheels [N m], shape (4, 3)
    steering_wheel_rad: float = 0.0
    rear_steer_rad: float = 0.0


class HeldCar:
    """A car on the rig: chassis held, wheels on pads."""

    def __init__(self, vehicle: Vehicle, springs: Springs = "in") -> None:
        """Put the car on the rig, in its standing attitude."""
        self.model = model = copy.copy(vehicle.model)
        # The rig stays within the torque of the servo, but a step of the search may leave it, where there is no
        # stiffness.
        model.actuator_forcelimited[model.actuator("superposition").id] = False
        self.data = data = mujoco.MjData(model)
        self._wheels = [model.body(f"{corner}_wheel").id for corner in CORNERS]
        self._bind(vehicle)
        standing = vehicle.data.xpos[self._wheels, 2]
        lean = vehicle.data.xmat[self._wheels, 7]
        self.radius_m = standing / np.sqrt(1.0 - lean * lean)
        self._radii = self.radius_m.tolist()
        self._reference_m = {"centre": standing + _LIFT_M, "contact": np.full(4, _LIFT_M)}
        data.qpos[:] = vehicle.data.qpos if springs == "in" else model.qpos0
        data.qpos[self._root : self._root + 7] = vehicle.data.qpos[self._root : self._root + 7]
        data.qpos[self._root + 2] += _LIFT_M
        self.origin_m = data.qpos[self._root : self._root + 3].copy()
        self._inverse: Array = np.empty((0, 0))
        self._held: Hold = "nothing"
        self.load_N = np.zeros(4)
        if springs != "in":
            self._take_out_springs(lock_dampers=springs == "locked")
        self.equilibrium(Case("nothing" if springs == "locked" else "centre"))
        self._start = data.qpos.copy(), self.load_N.copy(), self._inverse.copy(), self._held

    def _bind(self, vehicle: Vehicle) -> None:
        model = self.model
        root = model.joint("root")
        self._root = int(root.qposadr[0])
        held = [*range(int(root.dofadr[0]), int(root.dofadr[0]) + 6)]
        held += [int(model.joint(f"{corner}_spin").dofadr[0]) for corner in CORNERS]
        self._free = np.setdiff1d(np.arange(model.nv), held)
        self._steering_wheel = int(model.actuator("steering_wheel").id)
        self._rear = [int(model.actuator(f"{corner}_steer").id) for corner in CORNERS[2:]]
        self._rear_states_at = vehicle.actuators.rear_states_at

    def _take_out_springs(self, *, lock_dampers: bool) -> None:
        model, data = self.model, self.data
        model.opt.gravity[:] = 0.0
        mujoco.mj_fwdPosition(model, data)
        for tendon in range(model.ntendon):
            name = model.tendon(tendon).name
            if name.endswith(_SPRING_ENDINGS):
                lock = lock_dampers and name.endswith("_damper")
                model.tendon_stiffness[tendon] = _LOCK_NPM if lock else 0.0
                model.tendon_stiffnesspoly[tendon] = 0.0
            if name.endswith(_SPRING_ENDINGS + MOUNT_ENDINGS):
                model.tendon_lengthspring[tendon] = data.ten_length[tendon]

    def reset(self) -> None:
        """Restore the first equilibrium bit-identically."""
        qpos, load, inverse, self._held = self._start
        self.data.qpos[:] = qpos
        self.load_N, self._inverse = load.copy(), inverse.copy()
        self.data.ctrl[:] = 0.0
        self.data.act[:] = 0.0
        mujoco.mj_fwdPosition(self.model, self.data)

    def wheel(self, corner: int) -> WheelPose:
        """Return the pose of a wheel and its contact point, the lowest point of the rigid circle."""
        body = self._wheels[corner]
        centre = self.data.xpos[body].copy()
        return WheelPose(centre, self.data.xmat[body].reshape(3, 3).copy(), centre + self._down(corner))

    def _down(self, corner: int) -> Array:
        """Return the vector from a wheel centre to its contact point, in world axes [m]."""
        _, x, _, _, y, _, _, z, _ = self.data.xmat[self._wheels[corner]].tolist()
        across = math.sqrt(1.0 - z * z)
        scale = self._radii[corner] / across
        return np.array([scale * x * z, scale * y * z, -self._radii[corner] * across])

    def equilibrium(self, case: Case) -> None:
        """Move the car from its current position into equilibrium."""
        self._command(case)
        residual = self._residual(case)
        size = np.abs(residual).max()
        if self._inverse.size == 0 or self._held != case.hold:
            self._renew(case, residual)
        for _ in range(_ITERATIONS):
            if size < _TOLERANCE:
                return
            step = -self._inverse @ residual
            largest = np.abs(step[:-4]).max()
            if largest < _SMALLEST_STEP and size < _ROUNDING:
                return
            step *= min(1.0, _LARGEST_STEP / largest if largest > 0.0 else 1.0)
            move = np.zeros(self.model.nv)
            move[self._free] = step[:-4]
            mujoco.mj_integratePos(self.model, self.data.qpos, move, 1.0)
            self.load_N += step[-4:]
            residual = self._residual(case)
            before, size = size, np.abs(residual).max()
            if size > _STALE * before and size > _TOLERANCE:
                self._renew(case, residual)
        dofs = [*(self.model.joint(int(self.model.dof_jntid[dof])).name for dof in self._free), *CORNERS]
        raise ModelError(
            f"kinematics and compliance rig: no equilibrium found in {_ITERATIONS} iterations; {size:.3g} N (or N m) "
            f"remain at {dofs[int(np.abs(residual).argmax())]!r}; do the links leave each wheel one degree of freedom?"
        )

    def _command(self, case: Case) -> None:
        """Command the servos, and start at their targets. Far from its target, a servo would saturate."""
        model, data = self.model, self.data
        commands = [(self._steering_wheel, case.steering_wheel_rad)]
        commands += [(actuator, case.rear_steer_rad) for actuator in self._rear]
        for actuator, angle in commands:
            if data.ctrl[actuator] == angle:
                continue
            data.ctrl[actuator] = angle
            if actuator in self._rear:
                # Servos at their targets.
                for state, value in self._rear_states_at(angle).items():
                    data.act[state] = value
            if model.actuator_trntype[actuator] == int(mujoco.mjtTrn.mjTRN_JOINT):
                data.qpos[int(model.jnt_qposadr[model.actuator_trnid[actuator, 0]])] = angle

    def _residual(self, case: Case) -> Array:
        """Return unbalanced forces [N, N m] and scaled height errors, shape (free + 4,)."""
        model, data = self.model, self.data
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        forces = data.qfrc_passive - data.qfrc_bias + data.qfrc_actuator
        pushes = case.patch_N.copy()
        pushes[:, 2] += self.load_N
        at_centre = case.centre_N.any()
        missing = self.load_N.copy()
        for index, body in enumerate(self._wheels):
            centre = data.xpos[body]
            contact = centre + self._down(index)
            mujoco.mj_applyFT(model, data, pushes[index], case.moment_Nm[index], contact, body, forces)
            if at_centre:
                mujoco.mj_applyFT(model, data, case.centre_N[index], _NO_MOMENT, centre, body, forces)
            if case.hold != "nothing":
                height = centre[2] if case.hold == "centre" else contact[2]
                wanted = self._reference_m[case.hold][index] + case.height_m[index]
                missing[index] = (height - wanted) * _HEIGHT_SCALE_NPM
        return np.concatenate([forces[self._free], missing])

    def _renew(self, case: Case, residual: Array) -> None:
        """Compute and invert the stiffness of the car with its pads, at the current position."""
        data, count = self.data, self._free.size
        matrix = np.empty((count + 4, count + 4))
        start, load = data.qpos.copy(), self.load_N.copy()
        move = np.zeros(self.model.nv)
        for column, dof in enumerate(self._free):
            move[:] = 0.0
            move[dof] = _DIFFERENCE
            mujoco.mj_integratePos(self.model, data.qpos, move, 1.0)
            matrix[:, column] = (self._residual(case) - residual) / _DIFFERENCE
            data.qpos[:] = start
        for corner in range(4):
            self.load_N[corner] += 1.0
            matrix[:, count + corner] = self._residual(case) - residual
            self.load_N[:] = load
        self._residual(case)
        try:
            self._inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
        except np.linalg.LinAlgError as reason:
            raise ModelError(
                "kinematics and compliance rig: a part of the car moves without a force; is a link missing?"
            ) from reason
        self._held = case.hold

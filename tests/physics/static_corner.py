"""The stiffness matrix of a corner's links, by hand: compliance without the rig and without the engine's forces."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from activesteer.core.conventions import CORNERS, Array
from activesteer.rigs.kc.held_car import HeldCar
from tests.physics.rigid_links import FRONT_LINKS, REAR_LINKS

PINION_M = 0.0074
"""Radius of the pinion of the compact."""


class StaticCorner:
    """Statics of one knuckle: the forces of its links, strut or spring, and pad, as functions of its pose.

    Coordinates: motion of the wheel centre (3), rotation vector (3), and one more: in front the rack, which both tie
    rods pull the same way, at the rear the steering hinge against its servo. The pad holds the height of the wheel
    centre. From the engine come positions and parameters, no forces but the pad's static one.
    """

    def __init__(self, held: HeldCar, corner: str) -> None:
        self.model, self.data = held.model, held.data
        self.corner, self.front = corner, corner.startswith("f")
        index = CORNERS.index(corner)
        pose = held.wheel(index)
        self.centre, self.axle, self.radius = pose.centre_m, pose.rotation[:, 1], float(held.radius_m[index])
        self.load_N = float(held.load_N[index])
        self.links = [self._link(name) for name in ((*FRONT_LINKS,) if self.front else (*REAR_LINKS, "spring"))]

    def _link(self, name: str) -> tuple[str, Array, Array, float, float, float]:
        tendon = self.model.tendon(f"{self.corner}_{name}").id
        ends = [
            self.data.site_xpos[self.model.site(f"{self.corner}_{name}_{end}").id].copy() for end in ("inner", "outer")
        ]
        rate, cubic = float(self.model.tendon_stiffness[tendon]), float(self.model.tendon_stiffnesspoly[tendon, 1])
        return name, ends[0], ends[1], rate, cubic, float(self.model.tendon_lengthspring[tendon, 0])

    def forces(self, x: Array, side_N: float) -> Array:
        """Return the generalised forces on the knuckle and the seventh coordinate, shape (7,), at constant pad load."""
        turn = Rotation.from_rotvec(x[3:6]).as_matrix()
        centre = self.centre + x[:3]
        force, moment, extra = np.zeros(3), np.zeros(3), 0.0
        for name, inner, outer, rate, cubic, rest in self.links:
            start = inner + (np.array([0.0, x[6], 0.0]) if name == "tie_rod" else 0.0)
            end = centre + turn @ (outer - self.centre)
            length = float(np.linalg.norm(end - start))
            pull = (rate * (length - rest) + cubic * (length - rest) ** 3) * (start - end) / length
            force, moment = force + pull, moment + np.cross(end - centre, pull)
            if name == "tie_rod":
                extra -= float(pull[1])
        if self.front:
            push, top = self._strut(centre, turn)
            force, moment = force + push, moment + np.cross(top - centre, push)
            extra -= 0.5 * self._column_Npm() * x[6]
            axis, point, wheel, wheel_turn = np.zeros(3), centre, centre, turn
        else:
            axis, point = turn @ self._hinge()[0], centre + turn @ (self._hinge()[1] - self.centre)
            wheel_turn = Rotation.from_rotvec(x[6] * axis).as_matrix() @ turn
            wheel = point + Rotation.from_rotvec(x[6] * axis).as_matrix() @ (centre - point)
        axle = wheel_turn @ self.axle
        up = np.array([0.0, 0.0, 1.0]) - axle[2] * axle
        contact = wheel - self.radius * up / np.linalg.norm(up)
        pad = np.array([0.0, side_N, self.load_N])
        force, moment = force + pad, moment + np.cross(contact - centre, pad)
        if not self.front:
            extra = float(axis @ np.cross(contact - point, pad)) - float(self._servo_Nmprad()) * x[6]
        return np.concatenate([force, moment, [extra]])

    def _strut(self, centre: Array, turn: Array) -> tuple[Array, Array]:
        """Return the force of the top mount on strut and knuckle, and the point at which it acts.

        Along the strut, spring and mount are in series; the strut extends by what balances them.
        """
        top = self.data.xanchor[self.model.joint(f"{self.corner}_topmount").id]
        axis = turn @ self.data.xaxis[self.model.joint(f"{self.corner}_jounce").id]
        tendon = self.model.tendon(f"{self.corner}_spring").id
        offset = top - (centre + turn @ (top - self.centre))
        stiffness, static = np.zeros((3, 3)), np.zeros(3)
        for name in "xyz":
            direction = self.data.xaxis[self.model.joint(f"{self.corner}_mount_{name}").id]
            mount = self.model.tendon(f"{self.corner}_mount_{name}").id
            rate = float(self.model.tendon_stiffness[mount])
            stiffness += rate * np.outer(direction, direction)
            stretched = float(self.data.ten_length[mount] - self.model.tendon_lengthspring[mount, 0])
            static -= rate * stretched * direction
        rate = float(self.model.tendon_stiffness[tendon])
        spring = rate * float(self.data.ten_length[tendon] - self.model.tendon_lengthspring[tendon, 0])
        longer = (axis @ (static + stiffness @ offset) - spring) / (rate + axis @ stiffness @ axis)
        moved = longer * axis - offset
        return static - stiffness @ moved, top + moved

    def _column_Npm(self) -> float:
        """Return the stiffness of column and steering wheel servo in series, at the rack."""
        column = float(self.model.tendon_stiffness[self.model.tendon("steering_column").id])
        servo = float(self.model.actuator_gainprm[self.model.actuator("steering_wheel").id, 0]) / PINION_M**2
        return column * servo / (column + servo)

    def _hinge(self) -> tuple[Array, Array]:
        joint = self.model.joint(f"{self.corner}_steer").id
        return self.data.xaxis[joint], self.data.xanchor[joint]

    def _servo_Nmprad(self) -> float:
        return float(self.model.actuator_gainprm[self.model.actuator(f"{self.corner}_steer").id, 0])

    def under_side_force(self) -> tuple[float, float, float]:
        """Return wheel centre motion [mm/kN] and toe and camber changes [deg/kN] under a side force to the right."""
        step = 1e-6
        matrix = np.column_stack(
            [(self.forces(-step * unit, 0.0) - self.forces(step * unit, 0.0)) / (2.0 * step) for unit in np.eye(7)]
        )
        push = self.forces(np.zeros(7), -1.0) - self.forces(np.zeros(7), 0.0)
        self.load_N += 1.0
        lift = self.forces(np.zeros(7), 0.0)
        self.load_N -= 1.0
        lift -= self.forces(np.zeros(7), 0.0)
        turn = np.zeros((3, 7))
        turn[:, 3:6] = np.eye(3)
        shift = np.eye(3, 7)
        if not self.front:
            axis, point = self._hinge()
            turn[:, 6], shift[:, 6] = axis, np.cross(axis, self.centre - point)
        # The pad's force changes so that the wheel centre stays at its height.
        bordered = np.block([[matrix, -lift[:, None]], [shift[2:3], np.zeros((1, 1))]])
        moved = 1e3 * np.linalg.solve(bordered, np.append(push, 0.0))[:7]
        about = np.degrees(turn @ moved)
        axle = self.axle
        tilted = np.cross(about, axle)
        toe = (tilted[0] * axle[1] - tilted[1] * axle[0]) / (axle[0] ** 2 + axle[1] ** 2)
        return -1e3 * float((shift @ moved)[1]), float(toe), -float(tilted[2]) / math.hypot(axle[0], axle[1])

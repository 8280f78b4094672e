"""The state of a rolling car without its cyclic coordinates, independent of position and heading.

On a level, even road the forces do not depend on position, heading or the rotation angles of the wheels. Without these
coordinates, and with velocities in axes along the heading, straight driving is an equilibrium about which the car can
be linearised.
"""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from activesteer.conventions import CORNERS, Array, yaw_of
from activesteer.errors import ParameterError
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.car import Vehicle
from activesteer.vehicle.chassis_heading import turn_chassis_back

_AXES: Final = ("x", "y", "z", "roll", "pitch", "yaw")
_JOINT_DOFS: Final = {0: _AXES, 1: ("_x", "_y", "_z"), 2: ("",), 3: ("",)}
"""MuJoCo's kind of joint (free, ball, slide, hinge) -> suffixes of the joint's name, one for each of its dofs."""


_WIND_UP: Final = ("_brake", "rack_friction")
"""Suffixes of actuators whose activation is a wind-up before slipping."""


class LocalState:
    """The state of a vehicle as one vector of differences from a reference state.

    The vector holds coordinates (roll and pitch as rotations about the chassis' axes), velocities (of the chassis'
    origin along heading, left, up; rotations about the chassis' axes), and activations (servos, carcass deflections of
    the tyres).

    It leaves out the position on the road, the heading, the rotation angles of the wheels, and the wind-up of parts
    that hold or slip. The brake pads of a rolling wheel slip and have no motion of their own; for the rack see
    `linearisation`. The friction of damper seals, if any, is included, because excitation by the road makes it smooth.

    Attributes:
        names: Names of the elements: a coordinate has the name of its joint, its velocity starts with `d_`.
        vehicle: The car.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        """Take the present state of the vehicle, which rolls along the world's x axis, as the reference.

        Raises:
            ParameterError: the road is uneven or banked.
        """
        self.vehicle = vehicle
        model = vehicle.model
        if model.opt.gravity[1] != 0.0 or fb.header_of(model)["n_surfaces"][0] != 0.0:
            raise ParameterError(
                "straight driving is no equilibrium on an uneven or banked road; linear analyses need a road without "
                "bank, obstacles and surfaces",
                key="road",
            )
        dof_names = []
        for joint in range(model.njnt):
            free = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
            name = "" if free else model.joint(joint).name
            dof_names += [name + end for end in _JOINT_DOFS[int(model.jnt_type[joint])]]
        spins = {f"{corner}_spin" for corner in CORNERS}
        cyclic = {"x", "y", "yaw"} | spins
        self._coordinates = np.array([dof for dof, name in enumerate(dof_names) if name not in cyclic])
        self._spins = np.array([int(model.joint(name).qposadr[0]) for name in sorted(spins)])
        actuators = {
            int(model.actuator_actadr[index]): model.actuator(index).name
            for index in range(model.nu)
            if model.actuator_actadr[index] >= 0
        }
        self._activations = np.array(
            [
                address
                for address, name in sorted(actuators.items())
                if not (name.endswith(_WIND_UP) or (name.endswith("_friction") and not model.actuator(name).gainprm[0]))
            ]
        )
        self.names = (
            *(dof_names[dof] for dof in self._coordinates),
            *(f"d_{name}" for name in dof_names),
            *(f"act_{actuators[int(adr)]}" for adr in self._activations),
        )
        self.take_reference()

    def take_reference(self) -> None:
        """Move the car to the origin, heading along x, and take its state as the reference."""
        self._turn_home()
        data = self.vehicle.data
        self._qpos, self._qvel, self._act = data.qpos.copy(), data.qvel.copy(), data.act.copy()
        self._state = self.vehicle.save_state()

    def read(self) -> Array:
        """Move the car to the origin, and return its difference from the reference, shape (len(names),)."""
        self._turn_home()
        data, model = self.vehicle.data, self.vehicle.model
        difference = np.empty(model.nv)
        mujoco.mj_differentiatePos(model, difference, 1.0, self._qpos, data.qpos)
        return np.concatenate(
            [difference[self._coordinates], data.qvel - self._qvel, (data.act - self._act)[self._activations]]
        )

    def write(self, difference: Array) -> None:
        """Set the vehicle to the reference plus a difference, shape (len(names),)."""
        vehicle = self.vehicle
        data, model = vehicle.data, vehicle.model
        vehicle.restore_state(self._state)
        count = len(self._coordinates)
        move = np.zeros(model.nv)
        move[self._coordinates] = difference[:count]
        mujoco.mj_integratePos(model, data.qpos, move, 1.0)
        data.qvel += difference[count : count + model.nv]
        data.act[self._activations] += difference[count + model.nv :]

    def _turn_home(self) -> None:
        """Put the car at the origin of the road with heading 0 and unturned wheels; its motion stays."""
        data = self.vehicle.data
        # The heading of the chassis' x axis (ISO 8855) does not change with a rotation about that axis.
        turn_chassis_back(data, 0.5 * float(yaw_of(data.qpos[3:7])))
        data.qpos[:2] = 0.0
        data.qpos[self._spins] = 0.0

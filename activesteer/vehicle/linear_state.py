"""A linearised car: its state without cyclic coordinates, and its modes.

On a level, even road the forces do not depend on position, heading or the rotation angles of the wheels. Without these
coordinates, and with velocities in axes along the heading, straight driving is an equilibrium about which the car can
be linearised.

The participation of state i in mode k is |w_ki v_ik|, with the left and right eigenvectors w and v, divided by the sum
over all states; it does not depend on the units of the states. Bounce, roll and pitch each name the one mode in which
they take part most. Every other mode has the name of another part, the one that takes part most. If two modes are
close, such as roll and yaw/sideslip of a fast car, they mix and exchange their names.

Source: Perez-Arriaga, Verghese and Schweppe, Selective modal analysis, IEEE Trans. Power Apparatus and Systems 101
(1982), participation factors.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS, Array, yaw_of
from activesteer.errors import ModelError, ParameterError
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.car import Vehicle
from activesteer.vehicle.statics import turn_chassis_back

_AXES: Final = ("x", "y", "z", "roll", "pitch", "yaw")
_JOINT_DOFS: Final = {0: _AXES, 1: ("_x", "_y", "_z"), 2: ("",), 3: ("",)}
"""Suffixes of a joint's name, one for each degree of freedom, by MuJoCo's kind of joint (free, ball, slide, hinge)."""


_WIND_UP: Final = ("_brake", "rack_friction")
"""Suffixes of actuators whose activation is a wind-up before slipping."""


class LocalState:
    """State of a vehicle as a vector of differences from a reference state.

    The vector holds coordinates (roll and pitch as rotations about the chassis' axes), velocities (of the chassis'
    origin along heading, left, up; rotations about the chassis' axes), and activations (servos, carcass deflections of
    the tyres).

    It leaves out the position on the road, the heading, the rotation angles of the wheels, and the wind-up of parts
    that hold or slip. The brake pads of a rolling wheel slip and have no separate motion; for the rack see
    `linearisation`. The friction of damper seals, if any, is included, because excitation by the road makes it smooth.

    Attributes:
        names: Names of the elements: a coordinate has the name of its joint, its velocity starts with `d_`.
        vehicle: The car.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        """Set the current state of the vehicle, which rolls along the world's x axis, as the reference."""
        self.vehicle = vehicle
        model = vehicle.model
        if model.opt.gravity[1] != 0.0 or fb.header_of(model)["n_surfaces"][0] != 0.0:
            raise ParameterError(
                "straight driving is not an equilibrium on an uneven or banked road; linear analyses need a road "
                "without bank, obstacles and surfaces",
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
        """Move the car to the origin, heading along x, and set its state as the reference."""
        self._turn_home()
        data = self.vehicle.data
        self._qpos, self._qvel, self._act = data.qpos.copy(), data.qvel.copy(), data.act.copy()
        self._state = self.vehicle.save_state()

    def read(self) -> Array:
        """Move the car to the origin, and return its difference from the reference."""
        self._turn_home()
        data, model = self.vehicle.data, self.vehicle.model
        difference = np.empty(model.nv)
        mujoco.mj_differentiatePos(model, difference, 1.0, self._qpos, data.qpos)
        return np.concatenate(
            [difference[self._coordinates], data.qvel - self._qvel, (data.act - self._act)[self._activations]]
        )

    def write(self, difference: Array) -> None:
        """Set the vehicle to the reference plus a difference."""
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
        """Move the car to the origin of the road with heading 0 and unturned wheels, and keep its motion."""
        data = self.vehicle.data
        # The heading of the chassis' x axis (ISO 8855) does not change with a rotation about that axis.
        turn_chassis_back(data, 0.5 * float(yaw_of(data.qpos[3:7])))
        data.qpos[:2] = 0.0
        data.qpos[self._spins] = 0.0


_PARTS: Final = (
    ("speed", r"d_x"),
    ("yaw/sideslip", r"d_y|d_yaw"),
    ("bounce", r"(d_)?z"),
    ("roll", r"(d_)?roll"),
    ("pitch", r"(d_)?pitch"),
    ("front wheel hop", r"(d_)?f[lr]_(jounce|z)"),
    ("rear wheel hop", r"(d_)?r[lr]_z"),
    ("front wheel steer", r"(d_)?(f[lr]_(topmount_z|rot_z|toe)|rack)"),
    ("front wheel fore-aft", r"(d_)?f[lr]_(topmount_y|mount_x|x|rot_y|caster)"),
    ("front wheel camber", r"(d_)?f[lr]_(topmount_x|mount_y|y|rot_x|camber)"),
    ("rear wheel steer", r"(d_)?r[lr]_(rot_z|toe|steer)"),
    ("rear wheel fore-aft", r"(d_)?r[lr]_(x|rot_y|caster)"),
    ("rear wheel camber", r"(d_)?r[lr]_(y|rot_x|camber)"),
    ("front wheel rotation", r"d_f[lr]_spin|act_f[lr]_slip_x"),
    ("rear wheel rotation", r"d_r[lr]_spin|act_r[lr]_slip_x"),
    ("front tyre lateral", r"act_f[lr]_slip_y"),
    ("rear tyre lateral", r"act_r[lr]_slip_y"),
    ("front tyre turn slip", r"act_f[lr]_slip_z"),
    ("rear tyre turn slip", r"act_r[lr]_slip_z"),
    ("front damper", r"act_f[lr]_damper_friction|(d_)?f[lr]_mount_z"),
    ("rear damper", r"act_r[lr]_damper_friction|(d_)?r[lr]_mount_z"),
    ("drive", r"act_[fr][lr]_drive"),
    ("rear steering servo", r"act_r[lr]_steer"),
    ("superposition servo", r"act_superposition"),
    ("superposition gear", r"(d_)?superposition"),
    ("steering wheel", r"(d_)?steering_wheel"),
)
"""Parts of a car and their states (see `LocalState`). Each other state is its own part."""

_BODY_PARTS: Final = ("bounce", "roll", "pitch")
"""Motions of the body that have one mode each."""

_MIN_LIKENESS: Final = 0.9
"""Least similarity of left and right for a mode to count as parallel or opposite."""


@dataclass(frozen=True)
class Mode:
    """One mode of the linearised car, a real pole or a conjugate pair, named after the part that participates most."""

    name: str
    eigenvalue_1ps: complex  # no negative imaginary part
    participation: dict[str, float]  # factors, largest first, with the sum 1
    shape: NDArray[np.complex128]  # right eigenvector; its product with the left one is 1
    left: NDArray[np.complex128]

    @property
    def natural_frequency_Hz(self) -> float:
        """Undamped natural frequency |s|/2pi [Hz]."""
        return abs(self.eigenvalue_1ps) / (2.0 * math.pi)

    @property
    def damping_ratio(self) -> float:
        """Damping ratio [-], 1 for a mode that decays without oscillation."""
        return -self.eigenvalue_1ps.real / abs(self.eigenvalue_1ps)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, without the vectors."""
        s = self.eigenvalue_1ps
        return {
            "name": self.name, "natural_frequency_Hz": self.natural_frequency_Hz, "damping_ratio": self.damping_ratio,
            "real_1ps": s.real, "imaginary_1ps": s.imag, "participation": self.participation,
        }  # fmt: skip


def find_modes(a: NDArray[np.float64], states: tuple[str, ...], timestep_s: float) -> list[Mode]:
    """Return the modes of a discrete-time system."""
    try:
        values, right = np.linalg.eig(a)
        left = np.linalg.inv(right)
    except np.linalg.LinAlgError as reason:
        raise ModelError(f"the car's motion has no full set of modes: {reason}") from reason
    participation = np.abs(right * left.T)
    participation /= participation.sum(axis=0)
    parts = [_part_of(state) for state in states]
    by_mode: dict[int, dict[str, float]] = {}
    for index in np.flatnonzero(np.imag(values) >= 0.0):
        sums = dict.fromkeys(parts, 0.0)
        for part, amount in zip(parts, participation[:, index], strict=True):
            sums[part] += float(amount)
        by_mode[int(index)] = dict(sorted(sums.items(), key=lambda item: -item[1]))
    names: dict[int, str] = {}
    for part in _BODY_PARTS:
        maximum = max(by_mode, key=lambda index: by_mode[index].get(part, 0.0))
        if by_mode[maximum].get(part, 0.0) > 0.0:
            names[maximum] = part
    modes = []
    for index, sums in by_mode.items():
        if values[index] == 0.0:
            continue  # it settles within one step, as a state that each step sets anew
        # ln of a negative real z means half a turn per step: the steps do not resolve such a mode.
        s = complex(np.log(complex(values[index]))) / timestep_s
        name = names.get(index)
        if name is None:
            name = next((part for part in sums if part not in _BODY_PARTS), next(iter(sums)))
            name += _sides(right[:, index], participation[:, index], states)
        modes.append(Mode(name, s, sums, right[:, index].astype(complex), left[index].astype(complex)))
    return sorted(modes, key=lambda mode: (abs(mode.eigenvalue_1ps), mode.name))


def _part_of(state: str) -> str:
    for part, pattern in _PARTS:
        if re.fullmatch(pattern, state):
            return part
    return state.removeprefix("d_")


def _sides(shape: NDArray[np.complex128], participation: NDArray[np.float64], states: tuple[str, ...]) -> str:
    """Return a suffix that tells parallel from opposite motion of left and right wheels in a mode."""
    top = states[int(participation.argmax())]
    match = re.search(r"(?<![a-z])([fr])([lr])_", top)
    if match is None:
        return ""
    front, side = match.groups()
    other = top.replace(f"{front}{side}_", f"{front}{'r' if side == 'l' else 'l'}_")
    if other not in states:
        return ""
    one, two = shape[states.index(top)], shape[states.index(other)]
    alike = float((one.conjugate() * two).real) * 2.0 / float(abs(one) ** 2 + abs(two) ** 2)
    # Coordinates of both sides have the same directions in vehicle axes, so wheels that steer alike turn alike.
    if abs(alike) < _MIN_LIKENESS:
        return ""
    return ", parallel" if alike > 0.0 else ", opposite"

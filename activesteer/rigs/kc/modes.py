"""Natural frequencies and damping ratios of the standing car on its tyres.

The car is free. Each tyre is a spring at the contact point: vertically with its stiffness under static load, and
sideways with the stiffness of its carcass, since it does not slide (a four-post rig). Along the car the wheels roll.
Dampers, links and servos act as in the simulations; the slope of a damper is the mean of its bump and rebound slopes at
rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from activesteer.core.conventions import CORNERS, Array
from activesteer.errors import ModelError
from activesteer.tyre.kernels.slip import carcass_stiffnesses
from activesteer.tyre.kernels.vertical import deflection_under_load, vertical_force
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import Vehicle

PARKING_FRICTION: Final = 0.9
"""Coefficient of friction under tyres that are turned at rest."""


@dataclass(frozen=True)
class TyreStiffness:
    """A tyre under its static load."""

    vertical_Npm: float
    lateral_Npm: float
    width_m: float
    pressure_Pa: float


def tyre_stiffness(tyre: TyreParameters, pressure_Pa: float | None, load_N: float) -> TyreStiffness:
    """Return the stiffnesses of an upright standing tyre."""
    record = tyre.record
    pressure = tyre["INFLPRES"] if pressure_Pa is None else pressure_Pa
    deflection = deflection_under_load(record, load_N, 0.0, pressure, 0.0, 0.0, 0.0)
    step = 1e-4
    more, less = (vertical_force(record, deflection + sign * step, 0.0, pressure) for sign in (1.0, -1.0))
    lateral = carcass_stiffnesses(record, load_N, pressure)[1]
    return TyreStiffness((more - less) / (2.0 * step), float(lateral), tyre["WIDTH"], pressure)


def parking_moment_Nm(load_N: float, tyre: TyreStiffness) -> float:
    """Return the moment that resists turning a standing tyre about the vertical on a dry road [N m].

    Source: V. E. Gough, Practical Tire Research, SAE Transactions 64 (1956): mu / 3 sqrt(load^3 / pressure).
    """
    return PARKING_FRICTION / 3.0 * math.sqrt(load_N**3 / tyre.pressure_Pa)


_LIFT_M: Final = 1.0
_DIFFERENCE: Final = 1e-6
"""Step of the central differences [m, rad, and per second]."""
_FASTEST_HZ: Final = 40.0
"""Highest frequency of the modes of body and wheels. Links and steering have higher frequencies [Hz]."""


@dataclass(frozen=True)
class Mode:
    """Natural frequency and damping ratio of one mode of the car."""

    frequency_Hz: float  # frequency of the undamped oscillation: magnitude of the eigenvalue [Hz]
    damping_ratio: float


@dataclass(frozen=True)
class Modes:
    """Modes of body and wheels, and roll and pitch gradients."""

    by_name: dict[str, Mode]  # modes by the names of `_motions`
    body_roll_sliding: Mode  # body roll with tyres that slide sideways without resistance, as on air bearings
    roll_gradient_radps2pm: float  # roll angle per lateral acceleration [rad s2/m], positive to the outside of the turn
    # Pitch angle per deceleration with the brake distribution at full pedal [rad s2/m], positive nose down
    pitch_gradient_radps2pm: float


class _Linear:
    """The standing car: M a + C v + K x = f, in the engine's degrees of freedom without the wheels' rotation."""

    def __init__(
        self, vehicle: Vehicle, load_N: Array, tyres: tuple[TyreStiffness, TyreStiffness], grip: float
    ) -> None:
        self.model = model = vehicle.model
        self.data = data = mujoco.MjData(model)
        self.wheels = [model.body(f"{corner}_wheel").id for corner in CORNERS]
        self._load_N = load_N
        self._vertical = np.repeat([tyre.vertical_Npm for tyre in tyres], 2)
        self._lateral = np.repeat([tyre.lateral_Npm for tyre in tyres], 2) * grip
        data.qpos[:] = vehicle.data.qpos
        root = model.joint("root")
        data.qpos[int(root.qposadr[0]) + 2] += _LIFT_M
        self.root = int(root.dofadr[0])
        spins = [int(model.joint(f"{corner}_spin").dofadr[0]) for corner in CORNERS]
        self.free = np.setdiff1d(np.arange(model.nv), spins)
        mujoco.mj_fwdPosition(model, data)
        self._radius = (data.xpos[self.wheels, 2] - _LIFT_M) / np.sqrt(1.0 - data.xmat[self.wheels, 7] ** 2)
        self._start_m = self.contacts()
        self.stiffness, self.damping = self._differences()
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        self.mass: Array = mass[np.ix_(self.free, self.free)]

    def contacts(self) -> Array:
        """Contact points [m], shape (4, 3)."""
        x, y, z = self.data.xmat[self.wheels][:, 1::3].T
        across = np.sqrt(1.0 - z * z)
        down = np.stack([x * z, y * z, -across * across], axis=1) / across[:, None]
        return self.data.xpos[self.wheels] + self._radius[:, None] * down

    def at_contacts(self, forces_N: Array) -> Array:
        """Return the generalised forces of forces at the contact points, shape (nv,)."""
        total = np.zeros(self.model.nv)
        for body, point, force in zip(self.wheels, self.contacts(), forces_N, strict=True):
            mujoco.mj_applyFT(self.model, self.data, force, np.zeros(3), point, body, total)
        return total

    def _forces(self) -> Array:
        model, data = self.model, self.data
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        moved = self.contacts() - self._start_m
        pads = np.zeros((4, 3))
        pads[:, 1] = -self._lateral * moved[:, 1]
        pads[:, 2] = self._load_N - self._vertical * moved[:, 2]
        return (data.qfrc_passive - data.qfrc_bias + data.qfrc_actuator + self.at_contacts(pads))[self.free]

    def _differences(self) -> tuple[Array, Array]:
        data, start = self.data, self.data.qpos.copy()
        stiffness, damping = (np.empty((self.free.size, self.free.size)) for _ in range(2))
        move = np.zeros(self.model.nv)
        for column, dof in enumerate(self.free):
            sides = []
            for sign in (1.0, -1.0):
                move[:] = 0.0
                move[dof] = sign * _DIFFERENCE
                mujoco.mj_integratePos(self.model, data.qpos, move, 1.0)
                displaced = self._forces()
                data.qpos[:] = start
                data.qvel[:] = move
                sides.append((displaced, self._forces()))
                data.qvel[:] = 0.0
            stiffness[:, column] = (sides[1][0] - sides[0][0]) / (2.0 * _DIFFERENCE)
            damping[:, column] = (sides[1][1] - sides[0][1]) / (2.0 * _DIFFERENCE)
        self._forces()
        return stiffness, damping

    def velocity_map(self, body: int, point_m: Array) -> tuple[Array, Array]:
        """Return the Jacobians (3, free) of the velocity of a point and of the rotation of its body."""
        along, about = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        mujoco.mj_jac(self.model, self.data, along, about, point_m, body)
        return along[:, self.free], about[:, self.free]


def modes(vehicle: Vehicle, load_N: Array, tyres: tuple[TyreStiffness, TyreStiffness]) -> Modes:
    """Linearise the standing car and name its modes."""
    stuck = _Linear(vehicle, load_N, tyres, grip=1.0)
    sliding = _Linear(vehicle, load_N, tyres, grip=0.0)
    return Modes(_named(stuck), _named(sliding)["body_roll"], _roll_gradient(stuck), _pitch_gradient(stuck, vehicle))


def _named(linear: _Linear) -> dict[str, Mode]:
    """Assign each mode to the motion with most of its kinetic energy."""
    size = linear.free.size
    lower = -np.linalg.solve(linear.mass, np.hstack([linear.stiffness, linear.damping]))
    upper = np.hstack([np.zeros((size, size)), np.eye(size)])
    solution = np.linalg.eig(np.vstack([upper, lower]))
    roots, vectors = (np.asarray(part, dtype=np.complex128) for part in solution)
    keep = (roots.imag > 1e-3) & (np.abs(roots) < 2.0 * math.pi * _FASTEST_HZ)
    roots, shapes = roots[keep], vectors[size:, keep]
    energy = np.einsum("im,ij,jm->m", shapes.conj(), linear.mass, shapes).real
    named = {}
    for name, (inertia, rows) in _motions(linear).items():
        fraction = inertia * np.sum(np.abs(rows @ shapes) ** 2, axis=0) / energy
        if not fraction.size or fraction.max() < 0.1:
            if name.startswith("body"):
                where = f"of the standing car below {_FASTEST_HZ:g} Hz"
                raise ModelError(f"kinematics and compliance rig: no mode {where} is the {name}")
            # With hard dampers a wheel does not oscillate between spring and tyre.
            named[name] = Mode(math.nan, math.nan)
            continue
        if name == "body_pitch":
            # Bounce and pitch share two modes; the mode with more bounce is the bounce.
            taken = np.isclose(np.abs(roots), 2.0 * math.pi * named["body_bounce"].frequency_Hz)
            fraction[taken] = 0.0
        # Sideways on its tyres the body sways and rolls in two modes; the slower one is the roll.
        best = (
            int(np.flatnonzero(fraction > 0.25)[np.abs(roots)[fraction > 0.25].argmin()])
            if name == "body_roll"
            else int(fraction.argmax())
        )
        size_of = float(np.abs(roots[best]))
        named[name] = Mode(size_of / (2.0 * math.pi), float(-roots[best].real / size_of))
    return named


def _motions(linear: _Linear) -> dict[str, tuple[float, Array]]:
    """Return inertia and Jacobian rows of each named motion."""
    model, data = linear.model, linear.data
    chassis = model.body("chassis").id
    along, about = linear.velocity_map(chassis, data.xipos[chassis])
    mass, inertia = float(model.body_mass[chassis]), model.body_inertia[chassis]
    wheels = [linear.velocity_map(body, data.xpos[body])[0][2] for body in linear.wheels]
    unsprung = [float(model.body_subtreemass[model.body(f"{corner}_knuckle").id]) for corner in CORNERS]
    motions = {
        "body_bounce": (mass, along[2:3]),
        "body_pitch": (float(inertia[1]), about[1:2]),
        "body_roll": (float(inertia[0]), about[0:1]),
    }
    for axle, left, right in (("front", 0, 1), ("rear", 2, 3)):
        half = 0.5 * unsprung[left]
        motions[f"wheel_hop_{axle}"] = (half, (wheels[left] + wheels[right])[None])
        motions[f"tramp_{axle}"] = (half, (wheels[left] - wheels[right])[None])
    return motions


def _roll_gradient(linear: _Linear) -> float:
    """Return the roll gradient from inertial and side forces."""
    sideways = np.zeros(linear.free.size)
    sideways[linear.root + 1] = 1.0
    moved = np.linalg.lstsq(linear.stiffness, -linear.mass @ sideways, rcond=1e-13)[0]
    return float(moved[linear.root + 3])


def _pitch_gradient(linear: _Linear, vehicle: Vehicle) -> float:
    """Return the pitch gradient from inertial and brake forces."""
    brakes = vehicle.parameters.brakes
    fraction = np.repeat([brakes.front_torque_Nm, brakes.rear_torque_Nm], 2)
    total = fraction.sum()
    if total <= 0.0:
        return math.nan
    weight = float(linear.model.body_subtreemass[0])
    push = np.zeros((4, 3))
    push[:, 0] = -weight * fraction / total
    forwards = np.zeros(linear.free.size)
    forwards[linear.root] = 1.0
    force = linear.mass @ forwards + linear.at_contacts(push)[linear.free]
    moved = np.linalg.lstsq(linear.stiffness, force, rcond=1e-13)[0]
    return float(moved[linear.root + 4])

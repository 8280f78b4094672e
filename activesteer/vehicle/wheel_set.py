"""The four wheels in the engine: their coupling to the drive, rolling radii and inertias."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from activesteer.conventions import CORNERS, Array
from activesteer.signals import WheelTorques
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.named_parts import find
from activesteer.vehicle.parameters import Powertrain
from activesteer.vehicle.powertrain import CLUTCH_OPEN
from activesteer.vehicle.step_bindings import Wheels

_CALIBRATED_AT_MPS: Final = 20.0
"""Speed at which the rolling radii are taken that turn wheel speeds into the speed of the car [m/s]."""


class WheelSet:
    """The wheels of a car, in the order of `CORNERS`.

    Attributes:
        torques: Controls of drive and brakes.
        spins: Their degrees of freedom of rotation.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, powertrain: Powertrain) -> None:
        """Look the wheels up.

        Args:
            model: The car.
            data: Its state.
            powertrain: The drive.

        Raises:
            ModelError: the model lacks a part of a wheel.
        """

        def found(kind: mujoco.mjtObj, ending: str) -> list[int]:
            return [find(model, kind, corner + ending) for corner in CORNERS]

        self._model, self._data, self._ctrl, self._powertrain = model, data, data.ctrl, powertrain
        self.torques = Wheels(
            found(mujoco.mjtObj.mjOBJ_ACTUATOR, "_drive"),
            found(mujoco.mjtObj.mjOBJ_ACTUATOR, "_brake"),
            powertrain.wheel_fractions,
        )
        self.spins: list[int] = model.jnt_dofadr[found(mujoco.mjtObj.mjOBJ_JOINT, "_spin")].tolist()
        self._bodies = found(mujoco.mjtObj.mjOBJ_BODY, "_wheel")
        self._armature_kgm2: list[float] = model.dof_armature[self.spins].tolist()

    def engage(self, gear: float) -> None:
        """Couple the engine to the driven wheels, each of which then carries its part of the inertia, or free them."""
        inertia_kgm2 = 0.0 if gear == CLUTCH_OPEN else self._powertrain.inertia_kgm2
        for dof, own, fraction in zip(self.spins, self._armature_kgm2, self._powertrain.wheel_fractions, strict=True):
            self._model.dof_armature[dof] = own + fraction * inertia_kgm2

    def apply(self, torques: WheelTorques) -> None:
        """Set the torques of single wheels, at once and without the limits of the engine."""
        if len(torques.drive_Nm) != len(CORNERS) or len(torques.brake_Nm) != len(CORNERS):
            raise ValueError(f"{torques!r}: four torques each are needed")
        self._ctrl[self.torques.drives] = torques.drive_Nm
        self._ctrl[self.torques.brakes] = torques.brake_Nm

    def heights_m(self) -> Array:
        """Return the heights of the wheels' centres, shape (4,) [m]: roughly their rolling radii."""
        return self._data.xpos[self._bodies, 2]

    def effective_radii_m(self, tyres: tuple[TyreParameters, TyreParameters]) -> list[float]:
        """Return the rolling radii under the present loads; with fitted sensors, the car stands still.

        Args:
            tyres: Tyres of the front and of the rear axle.
        """
        loads_N = fb.wheel_outputs(self._data, len(CORNERS))["fz_N"]
        return [
            float(MagicFormula(tyre).evaluate(load_N, 0.0, 0.0, vx_mps=_CALIBRATED_AT_MPS).effective_radius_m)
            for tyre, load_N in zip((tyres[0], tyres[0], tyres[1], tyres[1]), loads_N, strict=True)
        ]

    def inertias_kgm2(self) -> list[float]:
        """Return the inertia of each wheel with everything that turns with it."""
        mass_matrix = np.zeros((self._model.nv, self._model.nv))
        mujoco.mj_fullM(self._model, self._data, mass_matrix)
        return mass_matrix.diagonal()[self.spins].tolist()

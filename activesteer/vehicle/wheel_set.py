"""The four wheels in the engine: their coupling to the drive, rolling radii and inertias."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from activesteer.conventions import CORNERS, Array
from activesteer.errors import ParameterError, shown
from activesteer.signals import WheelTorques
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.engine_layout import find
from activesteer.vehicle.parameters import VehicleParameters
from activesteer.vehicle.step_bindings import ENGINE, MOTOR, NOTHING, Wheels

_CALIBRATED_AT_MPS: Final = 20.0
"""Speed at which the rolling radii are taken that turn wheel speeds into the speed of the car [m/s]."""


class WheelSet:
    """The wheels of a car, in the order of `CORNERS`.

    Attributes:
        torques: Controls of drive and brakes.
        spins: Their degrees of freedom of rotation.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, parameters: VehicleParameters) -> None:
        """Look the wheels up."""

        def found(kind: mujoco.mjtObj, ending: str) -> list[int]:
            return [find(model, kind, corner + ending) for corner in CORNERS]

        self._model, self._data, self._ctrl = model, data, data.ctrl
        driven_by = [
            MOTOR if parameters.motors.at(corner) else ENGINE if fraction > 0.0 else NOTHING
            for corner, fraction in zip(CORNERS, parameters.engine_fractions, strict=True)
        ]
        self._driven = [corner for corner, source in zip(CORNERS, driven_by, strict=True) if source != NOTHING]
        self.spins: list[int] = model.jnt_dofadr[found(mujoco.mjtObj.mjOBJ_JOINT, "_spin")].tolist()
        engine_kgm2 = parameters.powertrain.inertia_kgm2
        free_kgm2: list[float] = model.dof_armature[self.spins].tolist()
        self.torques = Wheels(
            found(mujoco.mjtObj.mjOBJ_ACTUATOR, "_drive"),
            found(mujoco.mjtObj.mjOBJ_ACTUATOR, "_brake"),
            parameters.powertrain.wheel_fractions,
            driven_by,
            self.spins,
            free_kgm2,
            [own + engine_kgm2 * part for own, part in zip(free_kgm2, parameters.engine_fractions, strict=True)],
        )
        self._bodies = found(mujoco.mjtObj.mjOBJ_BODY, "_wheel")

    def check_driven(self, torques_Nm: Sequence[float]) -> None:
        """Check that no torque is demanded of a wheel without a drive."""
        for corner, torque in zip(CORNERS, torques_Nm, strict=True):
            if torque != 0.0 and corner not in self._driven:
                raise ParameterError(
                    f"demands {torque:g} N m at {corner}, which nothing drives; driven are {', '.join(self._driven)}, "
                    "and [motors] in the vehicle file can drive any wheel",
                    key="wheel_torque_demand_Nm",
                    value=torque,
                )

    def apply(self, torques: WheelTorques) -> None:
        """Set the torques of single wheels, at once and without the limits of the engine."""
        numbers = torque_numbers(torques)
        self._ctrl[self.torques.drives], self._ctrl[self.torques.brakes] = numbers[:4], numbers[4:]

    def heights_m(self) -> Array:
        """Return the heights of the wheels' centres, shape (4,) [m]: roughly their rolling radii."""
        return self._data.xpos[self._bodies, 2]

    def effective_radii_m(self, tyres: tuple[TyreParameters, TyreParameters]) -> list[float]:
        """Return the rolling radii under the present loads. With fitted sensors, the car stands still."""
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


def torque_numbers(torques: WheelTorques) -> tuple[float, ...]:
    """Return the drive torques and the brake torques of the wheels [N m]."""
    try:
        numbers = (*map(float, torques.drive_Nm), *map(float, torques.brake_Nm))
    except (AttributeError, TypeError, ValueError) as reason:
        raise ParameterError(f"are {shown(torques)}: {reason}", key="wheel_torques", value=torques) from reason
    if len(numbers) != 2 * len(CORNERS) or len(torques.drive_Nm) != len(CORNERS):
        raise ParameterError(f"are {shown(torques)}; four each are needed", key="wheel_torques", value=torques)
    return numbers

"""The superposition actuator in a vehicle file: the model's servo, or a motor with gear and lock.

The gear adds its angle between steering wheel and rack, so all three carry the same torque: the hands must hold the
torque of the superposition. Motor and gear replace the servo's lag and rate limit; its stiffness stays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Literal, Self

import mujoco
from numpy.typing import NDArray

from activesteer.config import Range
from activesteer.errors import ModelError
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.electric_actuator import STOP_BEYOND, ElectricActuator, known, presets_of
from activesteer.vehicle.named_parts import tendon_arms

NAME: Final = "superposition"
MOTOR: Final = "_motor"
"""Suffix of the state beside an actuator that is the speed of its motor, and of its sensor."""
_COLUMN: Final = "steering_column"


@dataclass(frozen=True)
class SuperpositionActuator(ElectricActuator):
    """The superposition actuator. With `servo` the other keys have no effect."""

    preset: Literal["servo", "strain_wave"] = "servo"
    """`servo`: the model's own; `strain_wave`: a motor and a strain-wave gear, with the other keys as overrides."""
    lock_torque_Nm: Annotated[float, Range(0.0, 50.0)] | None = None
    """Holding torque of the electromagnetic lock at the motor without supply [N m]."""
    position_tolerance_rad: Annotated[float, Range(0.0, 0.1)] | None = None
    """Error of the angle behind the gear at which the motor is switched off, if the gear then holds by itself [rad]."""

    def __post_init__(self) -> None:
        """Refuse a key without effect."""
        if not self.is_geared:
            self.refuse_keys(
                "has no effect on the servo, whose numbers are in the model; preset strain_wave has a motor"
            )

    @property
    def is_geared(self) -> bool:
        """True if a motor turns it through a gear."""
        return self.preset != "servo"

    def smooth(self) -> Self:
        """Return it without dry friction and angle tolerance, within which slopes mean nothing."""
        if not self.is_geared:
            return self
        return replace(self, friction_torque_Nm=0.0, load_friction=0.0, position_tolerance_rad=0.0)

    def resolved(self) -> Self:
        """Return it with the preset's value for every missing key."""
        return self.filled(STRAIN_WAVE)


STRAIN_WAVE: Final = presets_of(SuperpositionActuator, "superposition_actuator")["strain_wave"]
"""Defaults of the preset `strain_wave`."""


def fit_motor(spec: mujoco.MjSpec) -> None:
    """Give the superposition of a model a motor: a state without a force, and a sensor of torque and limits.

    Raises:
        ModelError: the model has no superposition, or it does not turn the column.
    """
    if spec.joint(NAME) is None or spec.actuator(NAME) is None or spec.tendon(_COLUMN) is None:
        raise ModelError(f"a motor for the superposition needs joint and actuator {NAME!r} and the tendon {_COLUMN!r}")
    added = spec.add_actuator(
        name=NAME + MOTOR, target=NAME, trntype=mujoco.mjtTrn.mjTRN_JOINT, dyntype=mujoco.mjtDyn.mjDYN_USER,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED, biastype=mujoco.mjtBias.mjBIAS_NONE,
    )  # fmt: skip
    added.gainprm[0] = 0.0
    spec.add_sensor(name=NAME + MOTOR, type=mujoco.mjtSensor.mjSENS_USER, dim=2)
    spec.nuserdata += 2


def motor_record(model: mujoco.MjModel, actuator: SuperpositionActuator) -> NDArray[Any]:
    """Return the `SCREW` record for the callbacks.

    Args:
        model: The model with the motor, compiled.
        actuator: The actuator with all keys.
    """
    index, column = model.actuator(NAME).id, model.tendon(_COLUMN).id
    values = actuator.motor_numbers() | {
        "act": float(model.actuator_actadr[index]),
        "motor_act": float(model.actuator_actadr[model.actuator(NAME + MOTOR).id]),
        "command": float(index),
        "lead_mprad": 1.0 / known(actuator.gear),
        "stop_m": STOP_BEYOND * float(model.actuator_ctrlrange[index, 1]),
        "tolerance_m": known(actuator.position_tolerance_rad),
        # Its readings are the last of all sensors, before the number of active faults.
        "userdata": float(model.nuserdata - 3),
        "column": float(column),
        "column_stiffness_Npm": float(model.tendon_stiffness[column]),
        "column_rest_m": float(model.tendon_lengthspring[column, 0]),
        "column_arm_m": tendon_arms(model, _COLUMN)[NAME],
    }
    if actuator.voltage_ratio == 0.0:
        values["friction_Nm"] += known(actuator.lock_torque_Nm)
    return fb.filled(fb.SCREW, travel=[1.0], **values)

"""Electric actuators in a vehicle file: servos of the model, or motors with gears, rear and superposition.

The gear adds its angle between steering wheel and rack, so all three carry the same torque: the hands must hold the
torque of the superposition. Motor and gear replace the servo's lag and rate limit; its stiffness stays.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import mujoco
from numpy.typing import NDArray

from activesteer.config import Range, build, read_toml
from activesteer.errors import ModelError, ParameterError
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.engine_layout import tendon_arms

Positive = Annotated[float, Range(1e-9)]
STOP_BEYOND: Final = 1.03
"""Position of the end stops over the travel at the limit: an assumption."""


@dataclass(frozen=True)
class ElectricActuator:
    """A motor behind a gear. Defaults come from the preset."""

    gear: Annotated[float, Range(0.1, 200.0)] | None = None
    """Turns of the motor per turn of the driven part."""
    friction_torque_Nm: Annotated[float, Range(0.0, 10.0)] | None = None
    """Dry friction at the motor without load: bearings, seals, brush [N m]."""
    load_friction: Annotated[float, Range(0.0, 20.0)] | None = None
    """Friction over the load's torque at the motor. For a thread: tan(friction angle) / tan(lead angle). At 1 and more
    it is self-locking."""
    rotor_inertia_kgm2: Annotated[float, Range(1e-7, 1e-2)] | None = None
    """Inertia of everything that turns with the motor [kg m2]."""
    peak_torque_Nm: Positive | None = None
    """Highest torque of the motor, by its current limit [N m]."""
    stall_torque_Nm: Positive | None = None
    """Torque at rest without that limit, at nominal voltage [N m]."""
    no_load_speed_radps: Positive | None = None
    """Speed at which no torque is left, at nominal voltage [rad/s]."""
    speed_limit_radps: Positive | None = None
    """Highest speed demand of its controller [rad/s]."""
    nominal_voltage_V: Positive | None = None
    """Voltage of these values [V]."""
    supply_voltage_V: Annotated[float, Range(0.0, 1000.0)] | None = None
    """Supply voltage; 0: unpowered [V]."""
    supply_power_W: Annotated[float, Range(0.0, 1e5)] | None = None
    """Highest mechanical power that the supply allows the motor [W]."""
    position_gain_1ps: Annotated[float, Range(1.0, 300.0)] | None = None
    """Position loop: speed demand per position error [1/s]."""
    speed_gain_1ps: Annotated[float, Range(5.0, 700.0)] | None = None
    """Speed loop: rate at which a speed error decays, if the motor is strong enough [1/s]."""

    def refuse_keys(self, problem: str) -> None:
        """Refuse keys of a motor for an actuator without one."""
        for item in fields(self):
            if item.name != "preset" and (value := getattr(self, item.name)) is not None:
                raise ParameterError(problem, key=item.name, value=value)

    def filled(self, preset: Mapping[str, Any]) -> Self:
        """Return it with the preset's value for every missing key."""
        return replace(self, **{key: value for key, value in preset.items() if getattr(self, key) is None})

    @property
    def voltage_ratio(self) -> float:
        """Supply over nominal voltage [-]."""
        return known(self.supply_voltage_V) / known(self.nominal_voltage_V)

    def motor_numbers(self) -> dict[str, float]:
        """Fields of a `SCREW` record that follow from these."""
        ratio = self.voltage_ratio
        return {
            "inertia_kgm2": known(self.rotor_inertia_kgm2),
            "position_gain_1ps": known(self.position_gain_1ps),
            "speed_gain_1ps": known(self.speed_gain_1ps),
            "speed_limit_radps": known(self.speed_limit_radps),
            "peak_Nm": known(self.peak_torque_Nm) if ratio > 0.0 else 0.0,
            "stall_Nm": known(self.stall_torque_Nm) * ratio,
            "slope_Nmsprad": known(self.stall_torque_Nm) / known(self.no_load_speed_radps),
            "power_W": known(self.supply_power_W),
            "friction_Nm": known(self.friction_torque_Nm),
            "load_friction": known(self.load_friction),
        }


def presets_of(kind: type[ElectricActuator], table: str) -> dict[str, dict[str, Any]]:
    """Return the presets of a kind of actuator: name -> key -> value in SI."""
    given, source = read_toml(Path(__file__).with_name("actuator_presets.toml"))
    built = {name: build(kind, {"preset": name, **keys}, source, (table, name)) for name, keys in given[table].items()}
    return {name: {key: value for key, value in vars(preset).items() if value is not None and key != "preset"}
            for name, preset in built.items()}  # fmt: skip


def known(value: float | None) -> float:
    """Return a value that the preset has filled in."""
    assert value is not None
    return value


_HINGE: Final = "hinge"


@dataclass(frozen=True)
class RearActuator(ElectricActuator):
    """The rear steering actuator. With `hinge` the other keys have no effect."""

    preset: Literal["hinge", "screw_3deg", "screw_10deg"] = "hinge"
    """`hinge`: the model's own; `screw_3deg`, `screw_10deg`: screws in the toe links, with the keys below as overrides.
    """
    arrangement: Literal["per_side", "central"] | None = None
    """One actuator at each side, or one in the middle that moves both toe links."""
    limit_rad: Annotated[float, Range(math.radians(0.5), math.radians(15.0))] | None = None
    """Largest wheel angle to either side as a demand. The end stops lie 3 % beyond [rad]."""
    lead_m: Annotated[float, Range(1e-4, 0.05)] | None = None
    """Travel per turn of the screw [m]."""
    screw_stiffness_Npm: Annotated[float, Range(1e5, 1e10)] | None = None
    """Nut, thread, bearing and housing, in series with the link [N/m]."""
    backlash_m: Annotated[float, Range(0.0, 5e-3)] | None = None
    """Free play between link and screw, from end to end [m]."""
    position_tolerance_m: Annotated[float, Range(0.0, 1e-3)] | None = None
    """Error of the screw's position at which the motor is switched off, if the screw then holds by itself [m]."""

    def __post_init__(self) -> None:
        """Refuse a key without effect."""
        if self.preset == _HINGE:
            self.refuse_keys("has no effect on the hinge, whose numbers are in the model; preset screw_3deg is a screw")

    @property
    def is_screw(self) -> bool:
        """True if screws move the toe links."""
        return self.preset != _HINGE

    @property
    def is_central(self) -> bool:
        """True if one screw in the middle moves both toe links."""
        return self.is_screw and self.resolved().arrangement == "central"

    def smooth(self) -> Self:
        """Return it without play, dry friction and position tolerance, within which slopes mean nothing."""
        if not self.is_screw:
            return self
        return replace(self, backlash_m=0.0, friction_torque_Nm=0.0, load_friction=0.0, position_tolerance_m=0.0)

    def resolved(self) -> Self:
        """Return it with the preset's value for every missing key."""
        return self.filled(PRESETS[self.preset])


PRESETS: Final = presets_of(RearActuator, "rear_actuator")
"""Preset -> defaults of its keys."""


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
    """Give the superposition of a model a motor: a state without a force, and a sensor of torque and limits."""
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
    """Return the `SCREW` record for the callbacks."""
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

"""Electric motors of a vehicle file: drive motors with their battery, and motors of steering actuators.

An actuator is a servo of the model, or a motor with a gear.
The gear adds its angle between steering wheel and rack, so all three carry the same torque: the hands must hold the
torque of the superposition. Motor and gear replace the servo's lag and rate limit; its stiffness stays.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal, NamedTuple, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range, build, check_points, read_toml
from activesteer.core.conventions import CORNERS
from activesteer.errors import ModelError, ParameterError
from activesteer.native.records import numbers_type
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.force_block import tendon_arms

MAX_MAP_POINTS: Final = 12
"""Largest number of points of a torque-speed map."""
_Positive = Annotated[float, Range(1e-9)]
_NotNegative = Annotated[float, Range(0.0)]
_Fraction = Annotated[float, Range(0.0, 1.0)]


@dataclass(frozen=True)
class Motor:
    """A motor with inverter and gear, which drives one wheel or both wheels of an axle."""

    speed_radps: tuple[float, ...]
    """Speeds of the torque-speed map at the motor's shaft, from 0, increasing [rad/s]. Above the last one there is no
    torque."""
    torque_Nm: tuple[float, ...]
    """Largest torques at these speeds, at the shaft [N m]; linear in between."""
    max_power_W: _Positive | None = None
    """Largest power at the shaft [W]. Default no limit beyond the map."""
    gear_ratio: Annotated[float, Range(0.01, 100.0)] = 1.0
    """Turns of the motor per turn of the wheel [-]; 1 is a motor in the hub."""
    efficiency: Annotated[float, Range(0.1, 1.0)] = 0.9
    """Efficiency of inverter, motor and gear, in either direction of the power [-]."""
    idle_loss_W: _NotNegative = 0.0
    """Loss that does not depend on the torque [W]."""
    regeneration: _Fraction = 1.0
    """Fraction of torque and power that the motor may absorb when it brakes the car [-]; 0 is a motor that only drives.
    """
    lag_s: Annotated[float, Range(0.001, 2.0)] = 0.02
    """Time constant of the torque relative to its demand [s]."""
    rate_Nmps: _Positive | None = None
    """Largest rate of the torque at the shaft [N m/s]. Default no limit."""
    rotor_inertia_kgm2: _NotNegative = 0.0
    """Inertia of everything that turns with the motor [kg m2]; the two wheels of an axle carry half of it each."""
    differential: Literal["open", "splitting"] = "open"
    """Differential of a motor on an axle: `open` gives equal torques to both wheels, `splitting` shifts torque between
    them."""
    split_torque_Nm: _Positive | None = None
    """Largest difference of the torques at the two wheels behind a splitting differential [N m]."""

    def __post_init__(self) -> None:
        """Check the map and the differential."""
        check_points("speed_radps", self.speed_radps, {"torque_Nm": self.torque_Nm}, Range(2, MAX_MAP_POINTS))
        if self.speed_radps[0] != 0.0:
            raise ParameterError(f"begins at {self.speed_radps[0]:g} rad/s; 0 is needed", key="speed_radps")
        if min(self.torque_Nm) < 0.0 or max(self.torque_Nm) == 0.0:
            raise ParameterError(
                f"is {list(self.torque_Nm)} N m; torques of 0 or more are needed, not all 0", key="torque_Nm"
            )
        if (self.split_torque_Nm is not None) is not (self.differential == "splitting"):
            raise ParameterError(
                "has an effect only with differential = 'splitting'",
                key="split_torque_Nm",
                value=self.split_torque_Nm,
            )

    @property
    def wheel_torque_Nm(self) -> float:
        """Largest total torque at the driven wheels [N m]."""
        return self.gear_ratio * max(self.torque_Nm)

    @property
    def power_W(self) -> float:
        """Largest power at the shaft, by the map and by `max_power_W` [W]."""
        most = 0.0
        for (low, before), (high, after) in pairwise(zip(self.speed_radps, self.torque_Nm, strict=True)):
            # Speed times a torque that is linear in the speed has its maximum at an end or at the vertex in between.
            slope = (after - before) / (high - low)
            vertex = 0.5 * (low - before / slope) if slope < 0.0 else high
            speed = min(max(vertex, low), high)
            most = max(most, speed * (before + slope * (speed - low)))
        return most if self.max_power_W is None else min(most, self.max_power_W)


@dataclass(frozen=True)
class Motors:
    """Drive motors by position, one per axle or one per wheel, none by default."""

    front: Motor | None = None
    """Motor of the front axle, with a differential."""
    rear: Motor | None = None
    """Motor of the rear axle, with a differential."""
    fl: Motor | None = None
    """Motor of the front left wheel."""
    fr: Motor | None = None
    """Motor of the front right wheel."""
    rl: Motor | None = None
    """Motor of the rear left wheel."""
    rr: Motor | None = None
    """Motor of the rear right wheel."""

    def __post_init__(self) -> None:
        """Check that each axle has one motor or a pair, and that a differential belongs to a single motor."""
        for axle, wheels in AXLES.items():
            pair = [name for name in wheels if getattr(self, name) is not None]
            if pair and getattr(self, axle) is not None:
                raise ParameterError(
                    f"the {axle} axle has a motor already; give motors.{axle}, or motors.{wheels[0]} and "
                    f"motors.{wheels[1]}",
                    key=pair[0],
                )
            if len(pair) == 1:
                other = next(name for name in wheels if name not in pair)
                raise ParameterError(f"is missing; motors.{pair[0]} drives only one wheel of the axle", key=other)
            for name in pair:
                if getattr(self, name).differential != "open":
                    raise ParameterError(
                        f"has no effect on the motor of one wheel; motors.{axle} has a differential",
                        key=f"{name}.differential",
                    )

    def __iter__(self) -> Iterator[tuple[str, Motor]]:
        """Return the drive motors by position."""
        return iter([(item.name, motor) for item in fields(self) if (motor := getattr(self, item.name)) is not None])

    def on(self, axle: str) -> list[Motor]:
        """Return the motors that drive an axle, `front` or `rear`."""
        return [motor for name, motor in self if name == axle or name in AXLES[axle]]

    def at(self, corner: str) -> tuple[str, Motor] | None:
        """Return position and motor of the drive of a wheel, or None without a motor."""
        return next(((name, motor) for name, motor in self if name == corner or corner in AXLES.get(name, ())), None)

    def inertia_kgm2(self, corner: str) -> float:
        """Return the rotor inertia at a wheel [kg m2]."""
        found = self.at(corner)
        if found is None:
            return 0.0
        place, motor = found
        return motor.rotor_inertia_kgm2 * motor.gear_ratio**2 * (0.5 if place in AXLES else 1.0)

    def splits(self, axle: str) -> bool:
        """Return whether the torques of an axle's wheels can differ."""
        motors = self.on(axle)
        return len(motors) == 2 or (len(motors) == 1 and motors[0].differential == "splitting")


AXLES: Final = {"front": CORNERS[:2], "rear": CORNERS[2:]}
"""Wheels of each axle, left before right."""
PLACES: Final = tuple(item.name for item in fields(Motors))
"""Places that a motor can have."""


@dataclass(frozen=True)
class Battery:
    """Battery of the motors, with the limits of its power at the terminals."""

    discharge_power_W: _Positive | None = None
    """Largest power that the battery gives [W]. Default: no limit."""
    charge_power_W: _NotNegative | None = None
    """Largest power that the battery takes from regeneration [W]. Default: no limit."""
    auxiliary_power_W: _NotNegative = 0.0
    """Power of all consumers except the motors [W]."""


MOTOR: Final = numbers_type(
    "left", "right", "gear", "points", "power_W", "regeneration", "efficiency", "idle_W", "follow", "step_Nm",
    "split_Nm", "scale", "offset", "stuck", ("speed_radps", MAX_MAP_POINTS), ("torque_Nm", MAX_MAP_POINTS),
)  # fmt: skip
"""A motor. Torques are totals at its wheels, except for its map (shaft). `left` and `right` are its wheels, which are
the same for the motor of one wheel. `follow` is the fraction of the difference between torque and demand that closes in
one step, `step_Nm` the largest change in one step. A fault sets `scale`, `offset` and `stuck`."""
HEALTHY: Final = {"scale": 1.0, "offset": 0.0, "stuck": 0.0}
"""Values of a motor's fields without a fault."""

BATTERY: Final = numbers_type("discharge_W", "charge_W", "auxiliary_W")
"""Limits of the battery."""

MOTOR_STATE: Final = numbers_type("torque_Nm", "difference_Nm", "demand_Nm", "power_W", "limited")
"""State of a motor: total torque at its wheels, torque of the right wheel minus torque of the left wheel (0 behind an
open differential), demand before limits, electric power, and whether a limit acts."""
BATTERY_STATE: Final = numbers_type("power_W", "energy_J", "limited")
"""Power at the terminals, positive when the battery gives it, energy given since the start, whether a limit acts."""
FULL_TORQUE_NM: Final = 1e9
"""Demand beyond the strength of any motor [N m]."""
ENERGY: Final = 1
"""Place of the battery's energy in the state."""
_UNLIMITED: Final = 1e12
"""A power [W] or torque [N m] without effect as a limit."""


def motor_records(motors: Motors, timestep_s: float) -> NDArray[Any]:
    """Return the records of a car's motors, in the order of their positions."""
    records = np.zeros(len(list(motors)), MOTOR)
    for record, (place, motor) in zip(records, motors, strict=True):
        wheels = AXLES.get(place, (place, place))
        record["left"], record["right"] = (CORNERS.index(wheel) for wheel in wheels)
        record["gear"], record["points"] = motor.gear_ratio, len(motor.speed_radps)
        record["speed_radps"][: len(motor.speed_radps)] = motor.speed_radps
        record["torque_Nm"][: len(motor.torque_Nm)] = motor.torque_Nm
        record["power_W"] = _UNLIMITED if motor.max_power_W is None else motor.max_power_W
        record["regeneration"], record["efficiency"] = motor.regeneration, motor.efficiency
        record["idle_W"], record["follow"] = motor.idle_loss_W, -math.expm1(-timestep_s / motor.lag_s)
        rate_Nmps = _UNLIMITED if motor.rate_Nmps is None else motor.gear_ratio * motor.rate_Nmps
        record["step_Nm"], record["split_Nm"] = rate_Nmps * timestep_s, motor.split_torque_Nm or 0.0
        for name, value in HEALTHY.items():
            record[name] = value
    return records


class ElectricDrive(NamedTuple):
    """Memory of a car's electric drive, empty without motors; `state` is a `BATTERY_STATE`, then `MOTOR_STATE`s."""

    motors: NDArray[Any]
    battery: NDArray[Any]
    state: NDArray[np.float64]

    @property
    def states(self) -> NDArray[Any]:
        """View of the `MOTOR_STATE` records."""
        return self.state[BATTERY_STATE.itemsize // 8 :].view(MOTOR_STATE)

    @classmethod
    def of(cls, motors: Motors, battery: Battery, timestep_s: float) -> ElectricDrive:
        """Allocate the memory of a car before its first step."""
        records = motor_records(motors, timestep_s)
        size = BATTERY_STATE.itemsize + len(records) * MOTOR_STATE.itemsize if len(records) else 0
        limits = (battery.discharge_power_W, battery.charge_power_W)
        most_W = (_UNLIMITED if limit is None else limit for limit in limits)
        own = np.array([(*most_W, battery.auxiliary_power_W)], BATTERY)
        return cls(records, own, np.zeros(size // 8))


STOP_BEYOND: Final = 1.03
"""Position of the end stops divided by the travel at the limit: an assumption."""


@dataclass(frozen=True)
class ElectricActuator:
    """A geared motor, with the preset's value for each missing key."""

    TABLE: ClassVar[str]
    """Table of the vehicle file, and of the presets."""
    MODEL: ClassVar[str]
    """Preset for the model's own actuator."""

    preset: str
    gear: Annotated[float, Range(0.1, 200.0)] | None = None
    """Turns of the motor per turn of the driven part."""
    friction_torque_Nm: Annotated[float, Range(0.0, 10.0)] | None = None
    """Dry friction at the motor without load: bearings, seals, brush [N m]."""
    load_friction: Annotated[float, Range(0.0, 20.0)] | None = None
    """Friction per torque of the load at the motor. For a thread: tan(friction angle) / tan(lead angle). At 1 and more
    it is self-locking."""
    rotor_inertia_kgm2: Annotated[float, Range(1e-7, 1e-2)] | None = None
    """Inertia of everything that turns with the motor [kg m2]."""
    peak_torque_Nm: _Positive | None = None
    """Highest torque of the motor, by its current limit [N m]."""
    stall_torque_Nm: _Positive | None = None
    """Torque at rest without the current limit, at nominal voltage [N m]."""
    no_load_speed_radps: _Positive | None = None
    """Speed at which no torque is left, at nominal voltage [rad/s]."""
    speed_limit_radps: _Positive | None = None
    """Highest speed demand of the motor's controller [rad/s]."""
    nominal_voltage_V: _Positive | None = None
    """Voltage at which these values hold [V]."""
    supply_voltage_V: Annotated[float, Range(0.0, 1000.0)] | None = None
    """Supply voltage; 0: unpowered [V]."""
    supply_power_W: Annotated[float, Range(0.0, 1e5)] | None = None
    """Highest mechanical power that the supply allows the motor [W]."""
    position_gain_1ps: Annotated[float, Range(1.0, 300.0)] | None = None
    """Position loop: speed demand per position error [1/s]."""
    speed_gain_1ps: Annotated[float, Range(5.0, 700.0)] | None = None
    """Speed loop: rate at which a speed error decays, if the motor is strong enough [1/s]."""

    def __post_init__(self) -> None:
        """Reject a key without effect."""
        for item in fields(self):
            if not self.has_motor and item.name != "preset" and (value := getattr(self, item.name)) is not None:
                problem = f"has no effect on the {self.MODEL}, whose values are in the car's model"
                name = next(iter(presets_of(type(self))))
                raise ParameterError(f"{problem}; preset {name} has a motor", key=item.name, value=value)

    @property
    def has_motor(self) -> bool:
        """True if a motor moves the actuator, through a screw or a gear."""
        return self.preset != self.MODEL

    def resolved(self) -> Self:
        """Return the actuator with the preset's value for every missing key."""
        preset = presets_of(type(self))[self.preset]
        return replace(self, **{key: value for key, value in preset.items() if getattr(self, key) is None})

    def smooth(self) -> Self:
        """Return the actuator without play, dry friction and position tolerance, for a linear analysis."""
        loose = [item.name for item in fields(self) if item.name.startswith(_LOOSE)]
        return replace(self, **dict.fromkeys(loose, 0.0)) if self.has_motor else self

    @property
    def voltage_ratio(self) -> float:
        """Ratio of supply to nominal voltage [-]."""
        return known(self.supply_voltage_V) / known(self.nominal_voltage_V)

    def motor_numbers(self) -> dict[str, float]:
        """Derived fields of the `SCREW` record."""
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


_LOOSE: Final = ("backlash", "friction_torque", "load_friction", "position_tolerance")


@functools.cache
def presets_of(kind: type[ElectricActuator]) -> dict[str, dict[str, Any]]:
    """Return the presets of a kind of actuator by name, as SI values by key."""
    given, source = read_toml(Path(__file__).with_name("actuator_presets.toml"))
    presets = {
        name: vars(build(kind, {"preset": name, **keys}, source, (kind.TABLE, name)))
        for name, keys in given[kind.TABLE].items()
    }
    return {
        name: {key: value for key, value in preset.items() if value is not None and key != "preset"}
        for name, preset in presets.items()
    }


def known(value: float | None) -> float:
    """Return a value that the preset has filled in."""
    assert value is not None
    return value


@dataclass(frozen=True)
class RearActuator(ElectricActuator):
    """The rear steering actuator, whose keys have no effect with `hinge`."""

    TABLE: ClassVar = "rear_actuator"
    MODEL: ClassVar = "hinge"

    preset: Literal["hinge", "screw_3deg", "screw_10deg"] = "hinge"
    """`hinge`: the model's own; `screw_3deg`, `screw_10deg`: screws in the toe links, with the keys below as overrides.
    """
    arrangement: Literal["per_side", "central"] | None = None
    """One actuator at each side, or one in the middle that moves both toe links."""
    limit_rad: Annotated[float, Range(math.radians(0.5), math.radians(15.0))] | None = None
    """Largest wheel angle to either side as a demand. The end stops are 3 % beyond [rad]."""
    lead_m: Annotated[float, Range(1e-4, 0.05)] | None = None
    """Travel per turn of the screw [m]."""
    screw_stiffness_Npm: Annotated[float, Range(1e5, 1e10)] | None = None
    """Stiffness of nut, thread, bearing and housing, in series with the link [N/m]."""
    backlash_m: Annotated[float, Range(0.0, 5e-3)] | None = None
    """Free play between link and screw, from end to end [m]."""
    position_tolerance_m: Annotated[float, Range(0.0, 1e-3)] | None = None
    """Error of the screw's position at which the motor is switched off, if the screw then holds by itself [m]."""

    @property
    def is_central(self) -> bool:
        """True if one screw in the middle moves both toe links."""
        return self.has_motor and self.resolved().arrangement == "central"


NAME: Final = "superposition"
SPEED_STATE: Final = "_motor"
"""Suffix of the additional state of an actuator that is the speed of its motor, and of its sensor."""
_COLUMN: Final = "steering_column"


@dataclass(frozen=True)
class SuperpositionActuator(ElectricActuator):
    """The superposition actuator, whose keys have no effect with `servo`."""

    TABLE: ClassVar = "superposition_actuator"
    MODEL: ClassVar = "servo"

    preset: Literal["servo", "strain_wave"] = "servo"
    """`servo`: the model's own; `strain_wave`: a motor and a strain-wave gear, with the other keys as overrides."""
    lock_torque_Nm: Annotated[float, Range(0.0, 50.0)] | None = None
    """Holding torque of the electromagnetic lock at the motor without supply [N m]."""
    position_tolerance_rad: Annotated[float, Range(0.0, 0.1)] | None = None
    """Error of the angle after the gear at which the motor is switched off, if the gear then holds by itself [rad]."""


def fit_motor(spec: mujoco.MjSpec) -> None:
    """Add a motor to the superposition of a model: a state without a force, and a sensor of torque and limits."""
    if spec.joint(NAME) is None or spec.actuator(NAME) is None or spec.tendon(_COLUMN) is None:
        raise ModelError(f"a motor for the superposition needs joint and actuator {NAME!r} and the tendon {_COLUMN!r}")
    added = spec.add_actuator(
        name=NAME + SPEED_STATE, target=NAME, trntype=mujoco.mjtTrn.mjTRN_JOINT, dyntype=mujoco.mjtDyn.mjDYN_USER,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED, biastype=mujoco.mjtBias.mjBIAS_NONE,
    )  # fmt: skip
    added.gainprm[0] = 0.0
    spec.add_sensor(name=NAME + SPEED_STATE, type=mujoco.mjtSensor.mjSENS_USER, dim=2)
    spec.nuserdata += 2


def motor_record(model: mujoco.MjModel, actuator: SuperpositionActuator) -> NDArray[Any]:
    """Return the `SCREW` record for the callbacks."""
    index, column = model.actuator(NAME).id, model.tendon(_COLUMN).id
    values = actuator.motor_numbers() | {
        "act": float(model.actuator_actadr[index]),
        "motor_act": float(model.actuator_actadr[model.actuator(NAME + SPEED_STATE).id]),
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

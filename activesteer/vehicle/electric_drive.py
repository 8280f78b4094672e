"""Electric motors on wheels or axles, and their battery: the file, and constants and state for compiled code."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range
from activesteer.conventions import CORNERS
from activesteer.errors import ParameterError
from activesteer.native_records import numbers_type

MAX_MAP_POINTS: Final = 12
"""Largest number of points of a torque-speed map."""
_Positive = Annotated[float, Range(1e-9)]
_NotNegative = Annotated[float, Range(0.0)]
_Fraction = Annotated[float, Range(0.0, 1.0)]


@dataclass(frozen=True)
class Motor:
    """A motor with inverter and gear, on one wheel or, through a differential, on both wheels of an axle."""

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
        count = len(self.speed_radps)
        if not 2 <= count <= MAX_MAP_POINTS or len(self.torque_Nm) != count:
            raise ParameterError(
                f"{count} speeds and {len(self.torque_Nm)} torques given; 2 to {MAX_MAP_POINTS} points are needed, as "
                "many speeds as torques",
                key="torque_Nm",
            )
        if self.speed_radps[0] != 0.0 or any(right <= left for left, right in pairwise(self.speed_radps)):
            raise ParameterError(
                f"is {list(self.speed_radps)} rad/s; speeds that begin at 0 and increase are needed",
                key="speed_radps",
            )
        if min(self.torque_Nm) < 0.0 or max(self.torque_Nm) == 0.0:
            raise ParameterError(
                f"is {list(self.torque_Nm)} N m; torques of 0 or more are needed, not all 0", key="torque_Nm"
            )
        if (self.split_torque_Nm is not None) is not (self.differential == "splitting"):
            raise ParameterError(
                "belongs to differential = 'splitting', and only to it",
                key="split_torque_Nm",
                value=self.split_torque_Nm,
            )

    @property
    def wheel_torque_Nm(self) -> float:
        """Largest torque at the wheels that it drives, together [N m]."""
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
    """Electric motors by their places. An axle has one motor, or one on each wheel. Default none."""

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
        """Check that each axle has one motor or a pair, and that only an axle has a differential."""
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
        """Return the places that have a motor, each with its motor."""
        return iter([(item.name, motor) for item in fields(self) if (motor := getattr(self, item.name)) is not None])

    def on(self, axle: str) -> list[Motor]:
        """Return the motors that drive an axle, `front` or `rear`."""
        return [motor for name, motor in self if name == axle or name in AXLES[axle]]

    def at(self, corner: str) -> tuple[str, Motor] | None:
        """Return place and motor that drive a wheel, or None."""
        return next(((name, motor) for name, motor in self if name == corner or corner in AXLES.get(name, ())), None)

    def inertia_kgm2(self, corner: str) -> float:
        """Return the inertia of a motor at a wheel, half of it behind a differential [kg m2]."""
        found = self.at(corner)
        if found is None:
            return 0.0
        place, motor = found
        return motor.rotor_inertia_kgm2 * motor.gear_ratio**2 * (0.5 if place in AXLES else 1.0)

    def splits(self, axle: str) -> bool:
        """Return True if the torques of an axle's wheels can differ."""
        motors = self.on(axle)
        return len(motors) == 2 or (len(motors) == 1 and motors[0].differential == "splitting")


AXLES: Final = {"front": CORNERS[:2], "rear": CORNERS[2:]}
"""Axle -> its wheels, left before right."""
PLACES: Final = tuple(item.name for item in fields(Motors))
"""Places that a motor can have."""


@dataclass(frozen=True)
class Battery:
    """The battery of the motors: limits of its power at the terminals."""

    discharge_power_W: _Positive | None = None
    """Largest power that it gives [W]. Default no limit."""
    charge_power_W: _NotNegative | None = None
    """Largest power that it takes from regeneration [W]. Default no limit."""
    auxiliary_power_W: _NotNegative = 0.0
    """Power of all consumers beside the motors [W]."""


MOTOR: Final = numbers_type(
    "left", "right", "gear", "points", "power_W", "regeneration", "efficiency", "idle_W", "follow", "step_Nm",
    "split_Nm", "scale", "offset", "stuck", ("speed_radps", MAX_MAP_POINTS), ("torque_Nm", MAX_MAP_POINTS),
)  # fmt: skip
"""A motor. Torques are those at its wheels together, except for its map (shaft). `left` and `right` are its wheels, the
same one for the motor of a wheel. `follow` is the fraction of the difference between torque and demand that closes in
one step, `step_Nm` the largest change in one step. A fault sets `scale`, `offset` and `stuck`."""
HEALTHY: Final = {"scale": 1.0, "offset": 0.0, "stuck": 0.0}
"""Fields of a motor without a fault."""

BATTERY: Final = numbers_type("discharge_W", "charge_W", "auxiliary_W")
"""Limits of the battery."""

MOTOR_STATE: Final = numbers_type("torque_Nm", "difference_Nm", "demand_Nm", "power_W", "limited")
"""State of a motor: torque at its wheels together, torque of the right wheel less that of the left one (0 behind an
open differential), demand before limits, electric power, and whether a limit acts."""
BATTERY_STATE: Final = numbers_type("power_W", "energy_J", "limited")
"""Power at the terminals, positive when the battery gives it, energy given since the start, and whether a limit acts.
"""
FULL_TORQUE_NM: Final = 1e9
"""Demand beyond the strength of any motor [N m]."""
ENERGY: Final = 1
"""Place of the battery's energy in the state."""
_UNLIMITED: Final = 1e12
"""A power [W] or torque [N m] without effect as a limit."""


def motor_records(motors: Motors, timestep_s: float) -> NDArray[Any]:
    """Return the records of a car's motors, in the order of their places."""
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
    """Memory of the electric drive of one car.

    Attributes:
        motors: `MOTOR` records; none for a car without motors.
        battery: A `BATTERY`, shape (1,).
        state: A `BATTERY_STATE` followed by a `MOTOR_STATE` for each motor, as numbers; empty without motors.
    """

    motors: NDArray[Any]
    battery: NDArray[Any]
    state: NDArray[np.float64]

    @property
    def states(self) -> NDArray[Any]:
        """The `MOTOR_STATE` records, a view."""
        return self.state[BATTERY_STATE.itemsize // 8 :].view(MOTOR_STATE)

    @classmethod
    def of(cls, motors: Motors, battery: Battery, timestep_s: float) -> ElectricDrive:
        """Allocate the memory of a car that has given no power yet."""
        records = motor_records(motors, timestep_s)
        size = BATTERY_STATE.itemsize + len(records) * MOTOR_STATE.itemsize if len(records) else 0
        return cls(records, battery_record(battery), np.zeros(size // 8))


def battery_record(battery: Battery) -> NDArray[Any]:
    """Return the record of a battery, shape (1,)."""
    limits = (battery.discharge_power_W, battery.charge_power_W)
    return np.array(
        [(*(_UNLIMITED if limit is None else limit for limit in limits), battery.auxiliary_power_W)], BATTERY
    )

"""Constants and state of the electric drive in native code: records of float64, at addresses that stay."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import CORNERS
from activesteer.native_records import numbers_type
from activesteer.vehicle.electric_drive import AXLES, MAX_MAP_POINTS, Battery, Motors

MOTOR: Final = numbers_type(
    "left", "right", "gear", "points", "power_W", "regeneration", "efficiency", "idle_W", "follow", "step_Nm",
    "split_Nm", "scale", "offset", "stuck", ("speed_radps", MAX_MAP_POINTS), ("torque_Nm", MAX_MAP_POINTS),
)  # fmt: skip
"""A motor. Torques are those at its wheels together, except for its map (shaft). `left` and `right` are its wheels, the
same one for the motor of a wheel; `follow` is the fraction of the difference between torque and demand that closes in
one step, `step_Nm` the largest change in one step; a fault sets `scale`, `offset` and `stuck`."""
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
    """Return the records of a car's motors, in the order of their places.

    Args:
        motors: The motors.
        timestep_s: Step of the engine [s].
    """
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

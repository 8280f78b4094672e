"""Electric axles and battery of a car as controllers know them."""

from __future__ import annotations

import math

from activesteer.controllers.parameters import SplitAxle
from activesteer.vehicle.electric_drive import AXLES, Battery, Motors


def split_axles(motors: Motors) -> tuple[SplitAxle, ...]:
    """Return the axles whose left and right torques can differ, front first."""
    found = []
    for place, axle in zip((0, 2), AXLES, strict=True):
        if not motors.splits(axle):
            continue
        motor, *others = motors.on(axle)
        torque_Nm, difference_Nm = motor.wheel_torque_Nm, 2.0 * motor.wheel_torque_Nm
        if not others:
            difference_Nm = motor.split_torque_Nm or 0.0
            torque_Nm = 0.5 * (torque_Nm + difference_Nm)
        found.append(SplitAxle(place, torque_Nm, motor.power_W, motor.regeneration, difference_Nm, motor.efficiency))
    return tuple(found)


def battery_power_W(battery: Battery) -> tuple[float, float]:
    """Return the largest power that a battery takes from motors and gives to them [W]."""
    charge, discharge = (
        math.inf if limit is None else limit for limit in (battery.charge_power_W, battery.discharge_power_W)
    )
    return charge + battery.auxiliary_power_W, max(discharge - battery.auxiliary_power_W, 0.0)

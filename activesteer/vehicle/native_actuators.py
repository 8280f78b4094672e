"""The dynamics of servos, drive, brakes and dry friction: rates of their activations, for the native callbacks.

`entry` is an actuator's `ACTUATOR` record, `command` its demand, `state` its activation.
"""

from __future__ import annotations

import math

from activesteer.compilation import inlined
from activesteer.vehicle.dry_friction import friction_rate
from activesteer.vehicle.powertrain import CLUTCH_OPEN, drive_limits


@inlined
def servo_rate(entry, command, state):
    """Return the rate of a servo: a first-order lag behind the limited command, with a rate limit."""
    rate = (min(max(command, entry.low), entry.high) - state) / entry.lag_s
    return min(max(rate, -entry.rate_limit), entry.rate_limit)


@inlined
def drive_rate(wheels, header, entry, qvel, command, state, timestep_s):
    """Return the rate of a wheel's drive torque: a first-order lag, within the limits of the engine.

    A motor has its dynamics in `native_motors`; its torque is the command.
    """
    if header.gear == CLUTCH_OPEN or entry.motor != 0.0:
        return (command - state) / timestep_s
    speed = 0.0
    for index in range(wheels.size):
        wheel = wheels[index]
        speed += wheel.drive_fraction * qvel[int(wheel.spin_dof)]
    low, high = drive_limits(
        speed,
        header.gear,
        header.engine_torque_Nm,
        header.engine_power_W,
        header.engine_limit_radps,
        header.engine_drag_Nm,
    )
    torque = state - (command - state) * math.expm1(-timestep_s / entry.lag_s)
    fraction = entry.drive_fraction
    if fraction == 0.0:
        # Not driven: the command is 0, and torque set without the engine decays.
        return (torque - state) / timestep_s
    return (min(max(torque, fraction * low), fraction * high) - state) / timestep_s


@inlined
def brake_rate(entry, qvel, command, state, timestep_s):
    """Return the rate of elasto-plastic friction: the pads wind up with the wheel and slip at the demanded torque."""
    speed = qvel[int(entry.dof)]
    # Drag of pads, bearings and seals acts always; it also keeps a car at rest from creeping.
    limit = min(max(command, entry.low), entry.high) / entry.stiffness
    wound = min(max(state + timestep_s * speed, -limit), limit)
    return (wound - state) / timestep_s


@inlined
def dry_friction_rate(entry, qvel, ten_velocity, state, timestep_s):
    """Return the rate of the dry friction of a damper on a vibrating road, or of the rack."""
    speed = ten_velocity[int(entry.tendon)] if entry.tendon >= 0.0 else qvel[int(entry.dof)]
    # The free joint of the chassis comes first (`Vehicle` checks it): its velocity in the world.
    vibration = entry.vibration * (qvel[0] * qvel[0] + qvel[1] * qvel[1]) ** 0.25
    return friction_rate(state, speed, vibration, entry.wound_limit, timestep_s)

"""Channels of the actuators: torques of drive, brakes and motors, dry friction, and flags for limits."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import mujoco
import numpy as np

from activesteer.vehicle.channels.raw_rows import Actuator, Column, Signal, sensor, signal
from activesteer.vehicle.electric_actuators import MOTOR, NAME
from activesteer.vehicle.electric_drive import Motors
from activesteer.vehicle.named_parts import is_there
from activesteer.vehicle.toe_links import SCREW


def actuator_signals(model: mujoco.MjModel) -> Iterator[Signal]:
    """Yield torques of drive and brakes, dry friction, and flags of servos without a motor that are at a limit."""
    for index in range(model.nu):
        name, force = model.actuator(index).name, Column("actuator_force", index)
        if name.endswith(("_drive", "_brake")):
            yield signal("vehicle", f"{name}_torque_Nm", "Nm", f"torque of {name} on the wheel", force)
        elif name.endswith("_friction"):
            part = name.removesuffix("_friction")
            sign = "positive resists compression" if part.endswith("damper") else "positive pushes to the left"
            yield signal("links", f"{name}_N", "N", f"dry friction of {part}, {sign}", force)
        elif (
            model.actuator_actadr[index] >= 0
            and model.actuator_gainprm[index, 0] > 0.0
            and model.actuator_trntype[index] != int(mujoco.mjtTrn.mjTRN_TENDON)
            and not _has_motor(model, name)
        ):
            yield signal("vehicle", f"{name}_torque_Nm", "Nm", f"torque of the servo of {name}", force)
            meaning = f"1 if {name} is at its angle, rate or torque limit"
            yield signal("vehicle", f"{name}_saturated", "", meaning, _limits(model, index))


def motor_signals(model: mujoco.MjModel) -> Iterator[Signal]:
    """Yield the signals of the motors of screws in the toe links, and of the superposition."""
    for name, words in (
        ("rl", "of the left toe link"), ("rr", "of the right toe link"), ("rear", "of both toe links"),
        (NAME, "of the superposition"),
    ):  # fmt: skip
        if not _has_motor(model, name):
            continue
        torque, limited = sensor(model, name + MOTOR)[:2]
        flag = "saturated" if name == NAME else "steer_saturated"
        for what, unit, meaning, values in (
            *([] if name == NAME else [("screw_m", "m", "travel of the screw", _state(model, name + SCREW))]),
            ("motor_speed_radps", "rad/s", "speed of the motor", _state(model, name + MOTOR)),
            ("motor_torque_Nm", "Nm", "torque of the motor", torque),
            (flag, "", "1 at a limit of angle, speed, torque or supply of the motor", limited),
        ):
            yield signal("vehicle", f"{name}_{what}", unit, f"{meaning} {words}", values)


def electric_signals(motors: Motors) -> Iterator[Signal]:
    """Yield the signals of electric motors on wheels or axles, and of their battery."""
    if not list(motors):
        return
    place = itertools.count()
    for name, unit, meaning in (
        ("power_W", "W", "power at the terminals of the battery, positive when it gives power"),
        ("energy_J", "J", "energy that the battery has given since the start"),
        ("limited", "", "1 while a limit of the battery reduces the torques"),
    ):
        yield signal("vehicle", f"battery_{name}", unit, meaning, Column("electric", next(place)))
    for motor, _ in motors:
        for name, unit, meaning in (
            ("torque_Nm", "Nm", "torque at its wheels together, forward positive"),
            ("difference_Nm", "Nm", "torque of the right wheel less that of the left one"),
            ("demand_Nm", "Nm", "torque demand at its wheels together"),
            ("power_W", "W", "electric power, positive when it drives"),
            ("limited", "", "1 while a limit of speed, torque, power or battery acts"),
        ):
            column = Column("electric", next(place))
            yield signal("vehicle", f"motor_{motor}_{name}", unit, f"{meaning}, motor {motor}", column)


def _has_motor(model: mujoco.MjModel, name: str) -> bool:
    return is_there(model, mujoco.mjtObj.mjOBJ_SENSOR, name + MOTOR)


def _state(model: mujoco.MjModel, name: str) -> Column:
    """The activation of an actuator."""
    return Column("act", int(model.actuator_actadr[model.actuator(name).id]))


def _limits(model: mujoco.MjModel, index: int) -> Actuator:
    force = model.actuator_forcerange[index] if model.actuator_forcelimited[index] else (-np.inf, np.inf)
    lag_and_rate, angle = model.actuator_dynprm[index, :2], model.actuator_ctrlrange[index]
    return Actuator._make((index, model.actuator_actadr[index], *lag_and_rate, *angle, *force))

"""Channels of steering, actuators and links."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from functools import partial

import mujoco
import numpy as np

from activesteer.conventions import Array
from activesteer.vehicle.channels.corners import toe
from activesteer.vehicle.channels.native_channels import (
    Actuator,
    AxialForce,
    Column,
    Computed,
    Signal,
    Values,
    sensor,
    signal,
)
from activesteer.vehicle.curve_axles import HOLDING_TENDON
from activesteer.vehicle.electric_actuators import MOTOR, NAME
from activesteer.vehicle.electric_drive import Motors
from activesteer.vehicle.engine_layout import find, is_there, tendon_arms
from activesteer.vehicle.parameters import Steering
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


def link_signals(model: mujoco.MjModel) -> Iterator[Signal]:
    """Yield the axial forces of all tendons with a stiffness, tension positive."""
    for index in range(model.ntendon):
        if model.tendon_stiffness[index] == 0.0 and not model.tendon_stiffnesspoly[index].any():
            continue
        if model.tendon(index).name.endswith(HOLDING_TENDON):
            # Five springs replace all links of a wheel; they are not parts of the car.
            continue
        # The stiffness of a damper's tendon represents the stops at both ends of its travel.
        name = model.tendon(index).name.replace("_damper", "_stop")
        yield signal("links", f"{name}_force_N", "N", f"axial force of {name}, tension positive", _force(model, index))


def axial_force(model: mujoco.MjModel, tendon: int) -> AxialForce:
    """Return the law of a tendon's stiffness."""
    stiffness = model.tendon_stiffness[tendon], *model.tendon_stiffnesspoly[tendon]
    return AxialForce._make((tendon, *stiffness, model.tendon_damping[tendon], *model.tendon_lengthspring[tendon]))


def _force(model: mujoco.MjModel, tendon: int) -> Values:
    """Return the axial force of a tendon. A screw in the link adds the force of its actuator."""
    law = axial_force(model, tendon)
    along = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON)
    screws = np.flatnonzero(along & (model.actuator_trnid[:, 0] == tendon) & (model.actuator_gainprm[:, 0] > 0.0))
    if not screws.size:
        return law

    def force(length_m: Array, velocity_mps: Array, added_N: Array) -> Array:
        passive = law.stiffness_Npm * (length_m - law.low_m) + law.damping_Nspm * velocity_mps
        return passive - added_N

    places = (("ten_length", tendon), ("ten_velocity", tendon), ("actuator_force", int(screws[0])))
    return Computed(force, tuple(Column(*place) for place in places))


def steering_signals(model: mujoco.MjModel, steering: Steering) -> list[Signal]:
    """Return angles of steering wheel, superposition and wheels, torque of the hands, travel of the rack."""
    of, ratio, felt = partial(signal, "vehicle"), steering.ratio, 1.0 - steering.assist_fraction
    wheel, added, rack, rl, rr = (
        column
        for name in ("steering_wheel_angle", "superposition_angle", "rack_travel", "rl_steer_angle", "rr_steer_angle")
        for column in sensor(model, name)
    )
    fl_axis, fr_axis = (sensor(model, f"{corner}_wheel_axis")[:2] for corner in ("fl", "fr"))
    demand = find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, "steering_wheel")
    return [
        of(
            "steering_wheel_rad", "rad", "steering wheel angle, left positive, not wrapped",
            wheel,
        ),
        of(
            "steering_wheel_demand_rad", "rad", "steering wheel angle demand of the driver", Column("ctrl", demand),
        ),
        of(
            "hand_torque_Nm", "Nm", "torque of the hands at the steering wheel, left positive",
            _column_torque(model, felt)
            or Computed(lambda torque_Nm: felt * torque_Nm, (Column("actuator_force", demand),)),
        ),
        of(
            "front_steer_rad", "rad", "mean steer angle of the front wheels against the chassis",
            Computed(lambda *axes: 0.5 * (toe(*axes[:2]) + toe(*axes[2:])), (*fl_axis, *fr_axis)),
        ),
        of(
            "superposition_rad", "rad", "angle added by the front superposition, at the road wheel",
            Computed(lambda angle_rad: angle_rad / ratio, (added,)),
        ),
        of(
            "rear_steer_rad", "rad", "mean angle of the rear steering actuators",
            Computed(lambda left_rad, right_rad: 0.5 * (left_rad + right_rad), (rl, rr)),
        ),
        of("rack_m", "m", "rack travel, positive steers left", rack),
    ]  # fmt: skip


def _column_torque(model: mujoco.MjModel, felt: float) -> AxialForce | None:
    """Return a fraction of the torque in the steering column [N m], or None without a column.

    The force of the hands' actuator is not this torque. The engine evaluates that force from the demand of this step
    and the angle at its start, but applies the force at the end of the step.
    """
    arms = tendon_arms(model, "steering_column")
    if "steering_wheel" not in arms:
        return None
    tension = axial_force(model, model.tendon("steering_column").id)
    scale = felt * arms["steering_wheel"]
    return tension._replace(
        stiffness_Npm=scale * tension.stiffness_Npm, second_Npm2=scale * tension.second_Npm2,
        third_Npm3=scale * tension.third_Npm3, damping_Nspm=scale * tension.damping_Nspm,
    )  # fmt: skip

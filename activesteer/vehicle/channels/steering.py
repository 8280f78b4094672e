"""Channels of the steering, from the steering wheel to the wheels, with the torque of the hands."""

from __future__ import annotations

from functools import partial

import mujoco

from activesteer.vehicle.channels.corners import toe
from activesteer.vehicle.channels.links import axial_force
from activesteer.vehicle.channels.raw_rows import AxialForce, Column, Computed, Signal, sensor, signal
from activesteer.vehicle.named_parts import find, tendon_arms
from activesteer.vehicle.parameters import Steering


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
    """Return a fraction of the torque in the steering column [N m]; None without a column.

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

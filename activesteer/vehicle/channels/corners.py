"""Channels of corners, car motion, steering, actuators and links."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import mujoco
import numpy as np
from numba import types

from activesteer.config import read_toml
from activesteer.core.conventions import CORNERS, Array
from activesteer.core.signals import CORNERS_IN_WORDS, Channel
from activesteer.core.units import unit_of
from activesteer.native.compilation import compiled_call, inlined
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.brakes.records import PER_WHEEL, PLACES
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
from activesteer.vehicle.electric_actuators import NAME, SPEED_STATE, Motors
from activesteer.vehicle.force_block import find, is_there, tendon_arms
from activesteer.vehicle.parameters import Steering
from activesteer.vehicle.toe_links import SCREW

_MEANINGS: Final = read_toml(Path(__file__).with_name("channels.toml"))[0]
_BRAKE_FIELDS: Final = ("demand_Pa", "pressure_Pa", "phase", "reference_mps", "tcs_active")
"""Fields of `BRAKE_STATE` that are also channels of the table `brakes`."""


def _of_wheel(table: str, index: int, name: str, values: Values) -> Signal:
    corner = CORNERS[index]
    return signal("corners", f"{corner}_{name}", f"{_MEANINGS[table][name]}, {CORNERS_IN_WORDS[corner]}", values)


def corner_signals(model: mujoco.MjModel) -> Iterator[Signal]:
    """Yield the signals of each wheel: its tyre, and its position relative to the chassis."""
    heights_m = design_heights_m(model)
    tables = ("tyre",) if fb.header_of(model)["n_surfaces"][0] == 0.0 else ("tyre", "road")
    for index, corner in enumerate(CORNERS):
        for table in tables:
            for name in _MEANINGS[table]:
                output = fb.output_slot(index, name.removeprefix("tyre_"))
                yield _of_wheel(table, index, name, Column("userdata", output))
        *_, height = sensor(model, f"{corner}_wheel_position")
        axis = sensor(model, f"{corner}_wheel_axis")
        (speed,) = sensor(model, f"{corner}_wheel_speed")
        damper = Column("userdata", len(CORNERS) * fb.USERDATA_PER_WHEEL + index)
        values = (speed, *_against_chassis(height, heights_m[index], axis), damper)
        for name, value in zip(_MEANINGS["wheel"], values, strict=True):
            yield _of_wheel("wheel", index, name, value)


def brake_signals() -> Iterator[Signal]:
    """Yield the brake pressures, and the signals of the brake control unit."""
    for field, (name, meaning) in zip(_BRAKE_FIELDS, _MEANINGS["brakes"].items(), strict=True):
        first = PLACES[field]
        if field not in PER_WHEEL:
            yield signal("vehicle", name, meaning, Column("brakes", first))
            continue
        for index in range(len(CORNERS)):
            yield _of_wheel("brakes", index, name, Column("brakes", first + index))


def toe(forward: Array, left: Array) -> Array:
    """Return the steer angle of a wheel from its spin axis [rad]."""
    return np.arctan2(-forward, left)


def _against_chassis(height: Column, design_m: float, axis: tuple[Column, ...]) -> tuple[Values, Values, Values]:
    """Return travel, steer angle and camber of a wheel from its height and spin axis."""
    return (
        Computed(lambda height_m: height_m - design_m, (height,)),
        Computed(toe, axis[:2]),
        Computed(np.arcsin, axis[2:]),
    )


def design_heights_m(model: mujoco.MjModel) -> list[float]:
    """Return the design heights of the wheel centres in vehicle axes [m], in the order of `CORNERS`."""
    at_rest = mujoco.MjData(model)
    mujoco.mj_kinematics(model, at_rest)
    chassis = model.body("chassis").id
    axes, place = at_rest.xmat[chassis].reshape(3, 3), at_rest.xpos[chassis]
    wheels = (at_rest.xpos[model.body(f"{corner}_wheel").id] for corner in CORNERS)
    return [float((axes.T @ (wheel - place))[2]) for wheel in wheels]


STANDSTILL_MPS: Final = 0.2
"""Speed below which a sideslip angle is meaningless and recorded as 0 [m/s]: a car at rest swings on its tyres."""
FULL_SIDESLIP_MPS: Final = 1.0
"""Speed from which the true sideslip angle is recorded; below, it fades to 0 at `STANDSTILL_MPS` [m/s]."""
ROCKS_BACK_MPS: Final = 1.0
"""Limit for driving backwards, for a stopped car that swings back on suspension and tyres [m/s]."""

_EXACT: Final = ("x_m", "y_m", "yaw_rad", "front_axle_x_m", "front_axle_y_m")
"""Channels that grow with the distance and need more than 32 bits in a file."""
MOTION_CHANNELS: Final = tuple(
    Channel(name, unit_of(name), meaning, "vehicle", name not in _EXACT)
    for name, meaning in _MEANINGS["motion"].items()
)


def motion_copied(model: mujoco.MjModel) -> dict[str, Column]:
    """Return the motion channels that are copied from the engine's sensors."""
    x, y, z = sensor(model, "cg_position")
    front_x, front_y, _ = sensor(model, "front_axle_position")
    _, _, vertical = sensor(model, "cg_velocity")
    roll_rate, pitch_rate, _ = sensor(model, "cg_gyro")
    return {
        "x_m": x, "y_m": y, "z_m": z, "front_axle_x_m": front_x, "front_axle_y_m": front_y, "vz_mps": vertical,
        "roll_rate_radps": roll_rate, "pitch_rate_radps": pitch_rate,
    }  # fmt: skip


def motion_inputs(model: mujoco.MjModel) -> tuple[Column, ...]:
    """Return the inputs of the computed motion channels: orientation, velocity, acceleration and body rates."""
    orientation, velocity, acceleration, rates = (
        sensor(model, name) for name in ("chassis_orientation", "cg_velocity", "cg_accelerometer", "cg_gyro")
    )
    return *orientation, *velocity[:2], *acceleration, *rates[1:]


_ARRAY: Final = types.Array(types.float64, 2, "A")


@inlined
def angle_sides(w, x, y, z):
    """Return sines and cosines of yaw and roll up to a factor, and the sine of pitch (ISO 8855)."""
    sine = 2.0 * (w * y - x * z)
    return (
        2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y),
        -1.0 if sine < -1.0 else 1.0 if sine > 1.0 else sine,
    )  # fmt: skip


@inlined
def in_the_road_plane(vx, vy, ax, ay, az, about_y, about_z, sin, sr, sp, cos, cr, cp, gravity_mps2):
    """Return velocity, acceleration and yaw rate from sines and cosines of the angles."""
    # An accelerometer measures the specific force. After rotation into the road plane, add gravity, which has a
    # component in this plane on a grade or a bank.
    along = cp * ax + sp * (sr * ay + cr * az) + gravity_mps2[0] * cos
    across = cr * ay - sr * az - gravity_mps2[0] * sin
    if gravity_mps2[1] != 0.0:  # a bank
        along += gravity_mps2[1] * sin
        across += gravity_mps2[1] * cos
    return (
        vx * cos + vy * sin, vy * cos - vx * sin, along, across, -sp * ax + cp * (sr * ay + cr * az) + gravity_mps2[2],
        # Rate of the Euler angle about the road's normal, not about the body's z axis.
        (sr * about_y + cr * about_z) / cp,
    )  # fmt: skip


@inlined
def sideslip_share(speed, along):
    """Return the fraction of the sideslip angle to record at low or backward speed."""
    if along < 0.0:
        return 1.0 if speed > ROCKS_BACK_MPS else 0.0
    return min(max((speed - STANDSTILL_MPS) / (FULL_SIDESLIP_MPS - STANDSTILL_MPS), 0.0), 1.0)


@compiled_call(types.void, _ARRAY, _ARRAY)
def _all_angle_sides(columns, out):
    """Write the sines and cosines of all rows."""
    for row in range(len(columns)):
        out[row, 0], out[row, 2], out[row, 1], out[row, 3], out[row, 4] = angle_sides(
            columns[row, 0], columns[row, 1], columns[row, 2], columns[row, 3]
        )


@compiled_call(types.void, _ARRAY, _ARRAY, _ARRAY, types.Array(types.float64, 1, "C"), _ARRAY)
def _all_in_the_road_plane(columns, sines, cosines, gravity_mps2, out):
    for row in range(len(columns)):
        out[row, 0], out[row, 1], out[row, 2], out[row, 3], out[row, 4], out[row, 5] = in_the_road_plane(
            columns[row, 4], columns[row, 5], columns[row, 6], columns[row, 7], columns[row, 8], columns[row, 9],
            columns[row, 10], sines[row, 0], sines[row, 1], sines[row, 2], cosines[row, 0], cosines[row, 1],
            cosines[row, 2], gravity_mps2,
        )  # fmt: skip


_COLUMN: Final = types.Array(types.float64, 1, "A")


@compiled_call(types.void, _COLUMN, _COLUMN, _COLUMN)
def _all_sideslip_shares(speed, along, out):
    for row in range(len(out)):
        out[row] = sideslip_share(speed[row], along[row])


class CarMotion:
    """Motion of the centre of gravity in the axes of ISO 8855, from sensors in world and body axes."""

    def __init__(self, columns: Array, gravity_mps2: Array, last_yaw_rad: float) -> None:
        """Evaluate all motion channels, by name."""
        # numpy's sines compute eight at a time; recordings keep the last digits of angles.
        sides, angles, turned = (np.empty((len(columns), count), order="F") for count in (5, 3, 6))
        _all_angle_sides(columns, sides)
        np.arctan2(sides[:, :2], sides[:, 2:4], out=angles[:, :2])
        np.arcsin(sides[:, 4], out=angles[:, 2])
        self.yaw_rad, self.roll_rad, self.pitch_rad = angles.T
        steps = np.abs(self.yaw_rad[1:] - self.yaw_rad[:-1])
        # Unwrapping takes longer than everything else; without a jump it only adds 0.
        if steps.max(initial=abs(self.yaw_rad[0] - last_yaw_rad)) < np.pi:
            self.yaw_rad += 0.0
        else:
            self.yaw_rad[:] = np.unwrap(np.concatenate(([last_yaw_rad], self.yaw_rad)))[1:]
        _all_in_the_road_plane(columns, np.sin(angles), np.cos(angles), gravity_mps2, turned)
        self.vx_mps, self.vy_mps, self.ax_mps2, self.ay_mps2, self.az_mps2, self.yaw_rate_radps = turned.T
        self.speed_mps = np.hypot(columns[:, 4], columns[:, 5])
        shares = np.empty(len(columns))
        _all_sideslip_shares(self.speed_mps, self.vx_mps, shares)
        self.sideslip_rad = shares * np.arctan2(self.vy_mps, self.vx_mps)


def actuator_signals(model: mujoco.MjModel) -> Iterator[Signal]:
    """Yield torques of drive and brakes, dry friction, and limit flags of servos."""
    for index in range(model.nu):
        name, force = model.actuator(index).name, Column("actuator_force", index)
        if name.endswith(("_drive", "_brake")):
            yield signal("vehicle", f"{name}_torque_Nm", f"torque of {name} on the wheel", force)
        elif name.endswith("_friction"):
            part = name.removesuffix("_friction")
            sign = "positive resists compression" if part.endswith("damper") else "positive pushes to the left"
            yield signal("links", f"{name}_N", f"dry friction of {part}, {sign}", force)
        elif (
            model.actuator_actadr[index] >= 0
            and model.actuator_gainprm[index, 0] > 0.0
            and model.actuator_trntype[index] != int(mujoco.mjtTrn.mjTRN_TENDON)
            and not _has_motor(model, name)
        ):
            yield signal("vehicle", f"{name}_torque_Nm", f"torque of the servo of {name}", force)
            meaning = f"1 if {name} is at its angle, rate or torque limit"
            yield signal("vehicle", f"{name}_saturated", meaning, _limits(model, index))


def motor_signals(model: mujoco.MjModel) -> Iterator[Signal]:
    """Yield the signals of the actuator motors: toe link screws and superposition."""
    for name, words in (
        ("rl", "of the left toe link"), ("rr", "of the right toe link"), ("rear", "of both toe links"),
        (NAME, "of the superposition"),
    ):  # fmt: skip
        if not _has_motor(model, name):
            continue
        torque, limited = sensor(model, name + SPEED_STATE)[:2]
        values = {
            "screw_m": None if name == NAME else _state(model, name + SCREW),
            "motor_speed_radps": _state(model, name + SPEED_STATE),
            "motor_torque_Nm": torque,
            "saturated": limited,
        }
        for what, value in values.items():
            part = f"{name}_steer" if what == "saturated" and name != NAME else name
            if value is not None:
                yield signal("vehicle", f"{part}_{what}", f"{_MEANINGS['screw'][what]} {words}", value)


def electric_signals(motors: Motors) -> Iterator[Signal]:
    """Yield the signals of the electric drive and its battery."""
    if not list(motors):
        return
    place = itertools.count()
    for name, meaning in _MEANINGS["battery"].items():
        yield signal("vehicle", f"battery_{name}", meaning, Column("electric", next(place)))
    for motor, _ in motors:
        for name, meaning in _MEANINGS["motor"].items():
            column = Column("electric", next(place))
            yield signal("vehicle", f"motor_{motor}_{name}", f"{meaning}, motor {motor}", column)


def _has_motor(model: mujoco.MjModel, name: str) -> bool:
    return is_there(model, mujoco.mjtObj.mjOBJ_SENSOR, name + SPEED_STATE)


def _state(model: mujoco.MjModel, name: str) -> Column:
    """Return the column of an actuator's activation."""
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
        yield signal("links", f"{name}_force_N", f"axial force of {name}, tension positive", _force(model, index))


def axial_force(model: mujoco.MjModel, tendon: int) -> AxialForce:
    """Return the coefficients of a tendon's axial force."""
    stiffness = model.tendon_stiffness[tendon], *model.tendon_stiffnesspoly[tendon]
    return AxialForce._make((tendon, *stiffness, model.tendon_damping[tendon], *model.tendon_lengthspring[tendon]))


def _force(model: mujoco.MjModel, tendon: int) -> Values:
    """Return the axial force of a tendon, including a screw in the link."""
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
    """Return the angles of steering wheel, superposition and wheels, the hand torque, and the rack travel."""
    ratio, felt = steering.ratio, 1.0 - steering.assist_fraction
    wheel, added, rack, rl, rr = (
        column
        for name in ("steering_wheel_angle", "superposition_angle", "rack_travel", "rl_steer_angle", "rr_steer_angle")
        for column in sensor(model, name)
    )
    fl_axis, fr_axis = (sensor(model, f"{corner}_wheel_axis")[:2] for corner in ("fl", "fr"))
    demand = find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, "steering_wheel")
    values = {
        "steering_wheel_rad": wheel,
        "steering_wheel_demand_rad": Column("ctrl", demand),
        "hand_torque_Nm": _column_torque(model, felt)
        or Computed(lambda torque_Nm: felt * torque_Nm, (Column("actuator_force", demand),)),
        "front_steer_rad": Computed(lambda *axes: 0.5 * (toe(*axes[:2]) + toe(*axes[2:])), (*fl_axis, *fr_axis)),
        "superposition_rad": Computed(lambda angle_rad: angle_rad / ratio, (added,)),
        "rear_steer_rad": Computed(lambda left_rad, right_rad: 0.5 * (left_rad + right_rad), (rl, rr)),
        "rack_m": rack,
    }
    return [signal("vehicle", name, _MEANINGS["steering"][name], value) for name, value in values.items()]


def _column_torque(model: mujoco.MjModel, felt: float) -> AxialForce | None:
    """Return a fraction of the torque in the steering column [N m], or None without a column."""
    # The force of the hands' actuator is not this torque: the engine evaluates it from the demand of this step and the
    # angle at its start, but applies it at the end.
    arms = tendon_arms(model, "steering_column")
    if "steering_wheel" not in arms:
        return None
    tension = axial_force(model, model.tendon("steering_column").id)
    scale = felt * arms["steering_wheel"]
    return tension._replace(
        stiffness_Npm=scale * tension.stiffness_Npm, second_Npm2=scale * tension.second_Npm2,
        third_Npm3=scale * tension.third_Npm3, damping_Nspm=scale * tension.damping_Nspm,
    )  # fmt: skip

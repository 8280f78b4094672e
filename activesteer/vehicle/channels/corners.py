"""Channels of the corners, the motion of the car, steering, actuators and links."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from functools import partial
from typing import Final

import mujoco
import numpy as np
from numba import types

from activesteer.core.conventions import CORNERS, Array
from activesteer.core.signals import CORNERS_IN_WORDS, Channel
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

_TYRE: Final = (
    ("fx_N", "tyre_fx_N", "N", "longitudinal tyre force at the contact point, ISO-W"),
    ("fy_N", "tyre_fy_N", "N", "lateral tyre force at the contact point, ISO-W, left positive"),
    ("fz_N", "tyre_fz_N", "N", "vertical tyre force"),
    ("mx_Nm", "tyre_mx_Nm", "Nm", "overturning moment"),
    ("my_Nm", "tyre_my_Nm", "Nm", "rolling resistance moment, negative rolling forward"),
    ("mz_Nm", "tyre_mz_Nm", "Nm", "aligning moment"),
    ("slip_ratio", "slip_ratio", "", "transient longitudinal slip, positive drives"),
    ("slip_angle_rad", "slip_angle_rad", "rad", "transient slip angle, positive gives negative force"),
    ("inclination_rad", "inclination_rad", "rad", "inclination of the wheel against the road about +x"),
    ("loaded_radius_m", "loaded_radius_m", "m", "distance between wheel centre and contact point"),
    ("limited", "tyre_limited", "", "1 if the tyre is outside its file's range of validity"),
    ("contact_x_m", "contact_x_m", "m", "contact point with the road, world x"),
    ("contact_y_m", "contact_y_m", "m", "contact point with the road, world y"),
    ("mu", "mu", "", "friction of the road at the contact point"),
    (
        "friction_utilisation", "friction_utilisation", "",
        "used fraction of the tyre's peak friction at its load",
    ),
)  # fmt: skip
"""Output of the native forces -> its channel: name, unit, meaning."""
_ROAD: Final = (
    ("road_z_m", "road_z_m", "m", "height of the plane that the tyre feels, below the wheel"),
    ("road_slope_x", "road_slope_x", "", "forward slope of that plane, positive uphill"),
    ("road_slope_y", "road_slope_y", "", "sideways slope of that plane, positive where the left side is higher"),
)
"""The same on an uneven road only."""
_BRAKES: Final = (
    ("demand_Pa", "brake_pressure_demand_Pa", "Pa", "brake pressure demand of driver and controller", "corners"),
    ("pressure_Pa", "brake_pressure_Pa", "Pa", "pressure in the wheel brake", "corners"),
    (
        "phase",
        "abs_phase",
        "",
        "anti-lock control: 0 off, 1 releases, 2 recovers, 3 builds up, 4 holds pressure",
        "corners",
    ),
    (
        "reference_mps",
        "abs_speed_mps",
        "m/s",
        "speed of the car, estimated by the control unit of the brakes",
        "vehicle",
    ),
    ("tcs_active", "tcs_active", "", "1 while traction control limits the drive", "vehicle"),
)
"""Field of `BRAKE_STATE` -> its channels: name, unit, meaning, group."""


def corner_signals(model: mujoco.MjModel) -> Iterator[Signal]:
    """Yield the signals of each wheel: its tyre, and its position relative to the chassis."""
    heights_m = design_heights_m(model)
    outputs = _TYRE if fb.header_of(model)["n_surfaces"][0] == 0.0 else (*_TYRE, *_ROAD)
    for index, (corner, words) in enumerate(CORNERS_IN_WORDS.items()):

        def of(
            name: str, unit: str, meaning: str, values: Values, *, corner: str = corner, words: str = words
        ) -> Signal:
            return signal("corners", f"{corner}_{name}", unit, f"{meaning}, {words}", values)

        for field, name, unit, meaning in outputs:
            yield of(name, unit, meaning, Column("userdata", fb.output_slot(index, field)))
        *_, height = sensor(model, f"{corner}_wheel_position")
        axis = sensor(model, f"{corner}_wheel_axis")
        (speed,) = sensor(model, f"{corner}_wheel_speed")
        damper = Column("userdata", len(CORNERS) * fb.USERDATA_PER_WHEEL + index)
        travel, steer, camber = _against_chassis(height, heights_m[index], axis)
        yield of("wheel_speed_radps", "rad/s", "rotational speed", speed)
        yield of("travel_m", "m", "wheel travel from the design position, bump positive", travel)
        yield of("steer_rad", "rad", "steer angle of the wheel against the chassis, left positive", steer)
        yield of("camber_rad", "rad", "inclination of the wheel against the chassis about +x", camber)
        yield of("damper_force_N", "N", "damper force, positive resists compression", damper)


def brake_signals() -> Iterator[Signal]:
    """Yield the pressures, and the signals of the control unit of the brakes."""
    for field, name, unit, meaning, group in _BRAKES:
        first = PLACES[field]
        if field in PER_WHEEL:
            for index, (corner, words) in enumerate(CORNERS_IN_WORDS.items()):
                yield signal(group, f"{corner}_{name}", unit, f"{meaning}, {words}", Column("brakes", first + index))
        else:
            yield signal(group, name, unit, meaning, Column("brakes", first))


def toe(forward: Array, left: Array) -> Array:
    """Return the steer angle of a wheel from two components of its spin axis in chassis axes [rad]."""
    return np.arctan2(-forward, left)


def _against_chassis(height: Column, design_m: float, axis: tuple[Column, ...]) -> tuple[Values, Values, Values]:
    """Return travel, steer angle and camber from the sensors of a wheel's height and spin axis."""
    return (
        Computed(lambda height_m: height_m - design_m, (height,)),
        Computed(toe, axis[:2]),
        Computed(np.arcsin, axis[2:]),
    )


def design_heights_m(model: mujoco.MjModel) -> list[float]:
    """Return the heights of the wheel centres in vehicle axes in the design position, order of `CORNERS` [m]."""
    at_rest = mujoco.MjData(model)
    mujoco.mj_kinematics(model, at_rest)
    chassis = model.body("chassis").id
    axes, place = at_rest.xmat[chassis].reshape(3, 3), at_rest.xpos[chassis]
    wheels = (at_rest.xpos[model.body(f"{corner}_wheel").id] for corner in CORNERS)
    return [float((axes.T @ (wheel - place))[2]) for wheel in wheels]


STANDSTILL_MPS: Final = 0.2
"""Below this speed a sideslip angle has no meaning and is recorded as 0 [m/s]: a car at rest swings on its tyres."""
FULL_SIDESLIP_MPS: Final = 1.0
"""From this speed on the recorded sideslip angle is the true one; below, it fades to 0 at `STANDSTILL_MPS` [m/s]."""
ROCKS_BACK_MPS: Final = 1.0
"""Limit for driving backwards, for a stopped car that swings back on suspension and tyres [m/s]."""

_EXACT: Final = ("x_m", "y_m", "yaw_rad", "front_axle_x_m", "front_axle_y_m")
"""Channels that grow with the distance and need more than 32 bits in a file."""
MOTION_CHANNELS: Final = tuple(
    Channel(name, unit, meaning, "vehicle", name not in _EXACT)
    for name, unit, meaning in (
        ("x_m", "m", "position of the centre of gravity, world x"),
        ("y_m", "m", "position of the centre of gravity, world y (left)"),
        ("z_m", "m", "height of the centre of gravity above the road"),
        ("yaw_rad", "rad", "yaw angle, left positive, unwrapped"),
        ("roll_rad", "rad", "roll angle, positive to the right"),
        ("pitch_rad", "rad", "pitch angle, positive nose down"),
        ("vx_mps", "m/s", "longitudinal velocity of the centre of gravity, in the road plane"),
        ("vy_mps", "m/s", "lateral velocity of the centre of gravity, in the road plane, left positive"),
        ("vz_mps", "m/s", "vertical velocity of the centre of gravity"),
        ("speed_mps", "m/s", "speed of the centre of gravity over the road"),
        ("yaw_rate_radps", "rad/s", "yaw rate, left positive"),
        ("roll_rate_radps", "rad/s", "roll rate, body-fixed"),
        ("pitch_rate_radps", "rad/s", "pitch rate, body-fixed"),
        ("ax_mps2", "m/s2", "longitudinal acceleration, in the road plane"),
        ("ay_mps2", "m/s2", "lateral acceleration, in the road plane, left positive"),
        ("az_mps2", "m/s2", "vertical acceleration"),
        ("sideslip_rad", "rad", "sideslip angle at the centre of gravity, atan(vy/vx); fades to 0 below 1 m/s"),
        ("front_axle_x_m", "m", "position of the middle of the front axle, world x"),
        ("front_axle_y_m", "m", "position of the middle of the front axle, world y"),
    )
)
"""Channels of the motion. A channel that is computed has the name of its attribute of `CarMotion`."""


def motion_copied(model: mujoco.MjModel) -> dict[str, Column]:
    """Return the channels of `MOTION_CHANNELS` that are copied from the engine's sensors."""
    x, y, z = sensor(model, "cg_position")
    front_x, front_y, _ = sensor(model, "front_axle_position")
    _, _, vertical = sensor(model, "cg_velocity")
    roll_rate, pitch_rate, _ = sensor(model, "cg_gyro")
    return {
        "x_m": x, "y_m": y, "z_m": z, "front_axle_x_m": front_x, "front_axle_y_m": front_y, "vz_mps": vertical,
        "roll_rate_radps": roll_rate, "pitch_rate_radps": pitch_rate,
    }  # fmt: skip


def motion_inputs(model: mujoco.MjModel) -> tuple[Column, ...]:
    """Return the inputs of the other channels: orientation, velocity, acceleration, two of the body's angular rates."""
    orientation, velocity, acceleration, rates = (
        sensor(model, name) for name in ("chassis_orientation", "cg_velocity", "cg_accelerometer", "cg_gyro")
    )
    return *orientation, *velocity[:2], *acceleration, *rates[1:]


_ARRAY: Final = types.Array(types.float64, 2, "A")


@inlined
def angle_sides(w, x, y, z):
    """Return opposite and adjacent side of yaw and of roll, and the sine of pitch (ISO 8855: yaw, pitch, roll)."""
    sine = 2.0 * (w * y - x * z)
    return (
        2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y),
        -1.0 if sine < -1.0 else 1.0 if sine > 1.0 else sine,
    )  # fmt: skip


@inlined
def in_the_road_plane(vx, vy, ax, ay, az, about_y, about_z, sin, sr, sp, cos, cr, cp, gravity_mps2):
    """Return velocity (two), acceleration (three) and yaw rate from sines and cosines of yaw, roll and pitch."""
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
    """Return the fraction of the sideslip angle that is recorded at a speed and a velocity along the car [m/s]."""
    if along < 0.0:
        return 1.0 if speed > ROCKS_BACK_MPS else 0.0
    return min(max((speed - STANDSTILL_MPS) / (FULL_SIDESLIP_MPS - STANDSTILL_MPS), 0.0), 1.0)


@compiled_call(types.void, _ARRAY, _ARRAY)
def _all_angle_sides(columns, out):
    """Write opposite sides, adjacent sides and sine of all rows."""
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
        """Evaluate all quantities, which have the names of their channels.

        Sines and angles use numpy, which computes eight at a time; recordings keep its last digits.
        """
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
        torque, limited = sensor(model, name + SPEED_STATE)[:2]
        flag = "saturated" if name == NAME else "steer_saturated"
        for what, unit, meaning, values in (
            *([] if name == NAME else [("screw_m", "m", "travel of the screw", _state(model, name + SCREW))]),
            ("motor_speed_radps", "rad/s", "speed of the motor", _state(model, name + SPEED_STATE)),
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
    return is_there(model, mujoco.mjtObj.mjOBJ_SENSOR, name + SPEED_STATE)


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

"""C functions of an exported car: its step, the computed channels, and the faults of actuators.

They contain the kernels of a simulation; the C code around them contains no laws.
"""

from __future__ import annotations

import math
from typing import Final

from numba import carray, from_dtype, types

from activesteer.core.signals import Measurement, numbers_of
from activesteer.coupling.car.variables import PLACE_GROUPS, PLACES
from activesteer.native.compilation import compiled_callback
from activesteer.native.memory import f64_pointer, pointer_to, word_pointer
from activesteer.vehicle.channels.corners import angle_sides, in_the_road_plane, sideslip_share
from activesteer.vehicle.channels.native_channels import (
    Actuator,
    AxialForce,
    RawRows,
    axial_force,
    is_limited,
    record_of,
)
from activesteer.vehicle.native_faults import CHANGE_FAULT, SET_FAULT, change_fault, set_fault
from activesteer.vehicle.native_step import carry_out

_BYTES: Final = 8

_MEASUREMENT_BYTES: Final = _BYTES * len(numbers_of(Measurement))


@compiled_callback(types.void, types.intp, types.intp, types.intp, types.intp)
def car_step(bindings, commands, torques_set, out):
    """Make one step of the car. Write the measurement, the motion, and whether the state is valid."""
    measurement = out + _BYTES
    sane = carry_out(bindings, commands, torques_set != 0, measurement, measurement + _MEASUREMENT_BYTES)
    f64_pointer(out)[0] = 1.0 if sane else 0.0


_ORIENTATION, _VELOCITY, _ACCELERATION, _RATES, _AXES, _HEIGHTS, _REAR, _SUPERPOSITION = (
    PLACES.index(names[0]) for names in PLACE_GROUPS
)
_SENSORS, _LENGTH, _SPEED, _CTRL, _ACT, _FORCE = (
    RawRows._fields.index(name)
    for name in ("sensordata", "ten_length", "ten_velocity", "ctrl", "act", "actuator_force")
)
_force_pointer: Final = pointer_to(from_dtype(record_of(AxialForce)))
_limit_pointer: Final = pointer_to(from_dtype(record_of(Actuator)))


@compiled_callback(types.void, *(types.intp,) * 10)
def derive(rows, places, design, gravity, forces, n_forces, limits, n_limits, numbers, motion):
    """Compute the channels of the last row that are not copied from it."""
    row = word_pointer(rows)
    out = f64_pointer(numbers)
    length, speed = f64_pointer(row[_LENGTH]), f64_pointer(row[_SPEED])
    for index in range(n_forces):
        law = carray(_force_pointer(forces), (n_forces,))[index]
        out[index] = axial_force(
            length[law.tendon], speed[law.tendon], law.low_m, law.high_m,
            law.stiffness_Npm, law.second_Npm2, law.third_Npm3, law.damping_Nspm,
        )  # fmt: skip
    commands, activations, torques = f64_pointer(row[_CTRL]), f64_pointer(row[_ACT]), f64_pointer(row[_FORCE])
    for index in range(n_limits):
        limit = carray(_limit_pointer(limits), (n_limits,))[index]
        out[n_forces + index] = is_limited(
            limit, commands[limit.control], activations[limit.activation], torques[limit.control]
        )
    s, at, m = f64_pointer(row[_SENSORS]), word_pointer(places), f64_pointer(motion)
    turned, moves, feels, turns = at[_ORIENTATION], at[_VELOCITY], at[_ACCELERATION], at[_RATES]
    yaw_up, yaw_on, roll_up, roll_on, sine = angle_sides(s[turned], s[turned + 1], s[turned + 2], s[turned + 3])
    yaw, roll, pitch = math.atan2(yaw_up, yaw_on), math.atan2(roll_up, roll_on), math.asin(sine)
    vx, vy, ax, ay, az, yaw_rate = in_the_road_plane(
        s[moves], s[moves + 1], s[feels], s[feels + 1], s[feels + 2], s[turns + 1], s[turns + 2],
        math.sin(yaw), math.sin(roll), math.sin(pitch), math.cos(yaw), math.cos(roll), math.cos(pitch),
        f64_pointer(gravity),
    )  # fmt: skip
    along = math.hypot(s[moves], s[moves + 1])
    m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9] = yaw, roll, pitch, vx, vy, along, yaw_rate, ax, ay, az
    m[10] = sideslip_share(along, vx) * math.atan2(vy, vx)
    heights = f64_pointer(design)
    for wheel in range(4):
        axis = at[_AXES + wheel]
        m[11 + wheel] = math.atan2(-s[axis], s[axis + 1])
        m[15 + wheel] = math.asin(s[axis + 2])
        m[19 + wheel] = s[at[_HEIGHTS + wheel]] - heights[wheel]
    m[23] = 0.5 * (m[11] + m[12])
    m[24] = 0.5 * (s[at[_REAR]] + s[at[_REAR + 1]])
    m[25] = s[at[_SUPERPOSITION]] / heights[4]


@compiled_callback(types.void, *SET_FAULT)
def fault(part, block, gain, bias, healthy, kind, offset, held):
    """Write a fault of an actuator into the model (see `faults.set_fault`)."""
    set_fault(part, block, gain, bias, healthy, kind, offset, held)


@compiled_callback(types.void, *CHANGE_FAULT)
def change(part, block, gain, bias, healthy, acting, kind, offset, ctrl, act, qpos):
    """Replace the fault of an actuator (see `native_faults.change_fault`)."""
    change_fault(part, block, gain, bias, healthy, acting, kind, offset, ctrl, act, qpos)

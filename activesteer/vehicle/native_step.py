"""One native step of the engine, from commands to a recorded row and a measurement.

The call releases Python's lock. It finds everything through `STEP_BINDINGS`, addresses and indices that a vehicle looks
up once, so the compiled code is the same for every car.
"""

from __future__ import annotations

import math
from typing import Final

from numba import carray, from_dtype, types

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import Motion
from activesteer.native.compilation import compiled_call, inlined, inlined_by_llvm
from activesteer.native.memory import f64_pointer, measurement_pointer, message_pointer, pointer_to
from activesteer.sensors.block import AX, CHAIN, MEASURED, WHEEL_SPEEDS, measure
from activesteer.vehicle.brakes.brake_control_unit import step_brakes
from activesteer.vehicle.brakes.records import BRAKE_SETUP, BRAKE_STATE
from activesteer.vehicle.channels.native_channels import ENGINE_ARRAYS
from activesteer.vehicle.native_actuators import step_motors
from activesteer.vehicle.native_faults import give_late, keep_demands, misread
from activesteer.vehicle.native_implicit import advance, implicit_plan_pointer
from activesteer.vehicle.parameters import CLUTCH_OPEN
from activesteer.vehicle.statics import YAW_DOF
from activesteer.vehicle.step_bindings import (
    BRAKES,
    COMMAND_ROW,
    ENGINE,
    MOTOR,
    N_SOURCES,
    N_WARNINGS,
    STEP_BINDINGS,
    TAPE,
    TORQUES,
)

FASTEST_MPS: Final = 200.0
"""Speed above which a run has diverged, as with a speed that is NaN [m/s]. No car of this package drives faster."""

_N_WHEELS: Final = len(CORNERS)
_N_MEASURED: Final = len(MEASURED)
_ENGINE_ARRAYS: Final = len(ENGINE_ARRAYS)
"""Number of the engine's arrays, which come first in a row."""
_EXPONENT: Final = 0x7FF0000000000000
"""Bits of a float64 that are all set if, and only if, it is not finite."""

_tape_pointer: Final = pointer_to(from_dtype(TAPE))
_bindings_pointer: Final = pointer_to(from_dtype(STEP_BINDINGS))
_command_pointer: Final = pointer_to(from_dtype(COMMAND_ROW))
_chain_pointer: Final = pointer_to(from_dtype(CHAIN))
_setup_pointer: Final = pointer_to(from_dtype(BRAKE_SETUP))
_state_pointer: Final = pointer_to(from_dtype(BRAKE_STATE))
_bits_pointer: Final = pointer_to(types.int64)
_counter_pointer: Final = pointer_to(types.int32)
_motion_pointer: Final = message_pointer(Motion)


@inlined
def _all_finite(address, size):
    bits = carray(_bits_pointer(address), (size,))
    bad = False
    for index in range(size):
        bad |= (bits[index] & _EXPONENT) == _EXPONENT
    return not bad


@inlined_by_llvm
def _sense(bindings, measurement_address, motion_address):
    """Write the true `Measurement` and `Motion`, and return whether the state is valid."""
    s = carray(f64_pointer(bindings.sensordata), (bindings.sizes[0],))
    yaw_rate = carray(f64_pointer(bindings.qvel), (bindings.n_dofs,))[YAW_DOF]
    speed = s[bindings.velocimeter]
    sane = -FASTEST_MPS < speed < FASTEST_MPS and _all_finite(bindings.qvel, bindings.n_dofs)
    for index in range(_ENGINE_ARRAYS):
        sane &= _all_finite(bindings.sources[index], bindings.sizes[index])
    warnings = carray(_counter_pointer(bindings.warnings), (2 * N_WARNINGS,))
    for index in range(N_WARNINGS):
        sane &= warnings[2 * index] == 0
    w, x, y, z = (
        s[bindings.orientation],
        s[bindings.orientation + 1],
        s[bindings.orientation + 2],
        s[bindings.orientation + 3],
    )
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    cos, sin = math.cos(yaw), math.sin(yaw)
    east, north = s[bindings.velocity], s[bindings.velocity + 1]
    pressure_Pa = carray(_state_pointer(bindings.brake_state), (1,))[0].pressure_Pa
    truth = carray(measurement_pointer(measurement_address), (1,))[0]
    truth.time_s = carray(f64_pointer(bindings.time), (1,))[0]
    truth.speed_mps, truth.yaw_rate_radps = speed, yaw_rate
    truth.ax_mps2, truth.ay_mps2 = s[bindings.accelerometer], s[bindings.accelerometer + 1]
    truth.steering_wheel_rad = s[bindings.steering_wheel_angle]
    truth.rear_steer_rad = 0.5 * (s[bindings.rear_left_angle] + s[bindings.rear_right_angle])
    truth.superposition_rad = s[bindings.superposition_angle] / bindings.ratio
    for wheel in range(_N_WHEELS):
        truth.wheel_speed_radps[wheel] = s[bindings.wheel_speed + wheel]
        truth.brake_pressure_Pa[wheel] = pressure_Pa[wheel]
    motion = carray(_motion_pointer(motion_address), (1,))[0]
    motion.x_m, motion.y_m = s[bindings.position], s[bindings.position + 1]
    motion.yaw_rad, motion.yaw_rate_radps = yaw, yaw_rate
    motion.speed_mps, motion.lateral_speed_mps = cos * east + sin * north, cos * north - sin * east
    return sane


@inlined
def _copy(source_address, target_address, size):
    source, target = f64_pointer(source_address), f64_pointer(target_address)
    for item in range(size):
        target[item] = source[item]


@inlined_by_llvm
def _record(bindings, tape):
    """Copy the recorded arrays onto a tape, and the poses of the bodies when they are due."""
    if tape.room == 0:
        return
    place = tape.row
    for index in range(N_SOURCES):
        _copy(bindings.sources[index], place, bindings.sizes[index])
        place += 8 * bindings.sizes[index]
    if tape.rows % tape.pose_every == 0:
        _copy(bindings.positions, tape.position, 3 * bindings.n_bodies)
        _copy(bindings.quaternions, tape.quaternion, 4 * bindings.n_bodies)
        tape.position += 24 * bindings.n_bodies
        tape.quaternion += 32 * bindings.n_bodies
    tape.row += tape.row_bytes
    tape.rows += 1
    tape.room -= 1


@inlined
def _engage(bindings, gear):
    """Connect the engine to the wheels, or disconnect it."""
    f64_pointer(bindings.gear)[0] = gear
    for wheel in range(_N_WHEELS):
        carried = bindings.free_kgm2[wheel] if gear == CLUTCH_OPEN else bindings.engaged_kgm2[wheel]
        f64_pointer(bindings.armature[wheel])[0] = carried


@inlined
def _with_grip(setup, state, wheel, torque_Nm):
    """Return the demand at a motor's wheel, reduced if the wheel spins or locks."""
    if setup.tcs == 0.0 or torque_Nm == 0.0:
        return torque_Nm
    faster_mps = state.wheel_mps[wheel] - state.reference_mps
    excess_mps = (faster_mps if torque_Nm > 0.0 else -faster_mps) - setup.slip * abs(state.reference_mps)
    return torque_Nm * min(max(2.0 - excess_mps / setup.spin_mps, 0.0), 1.0)


@compiled_call(types.boolean, types.intp, types.intp, types.intp)
def sense(bindings_address, measurement_address, motion_address):
    """Read the ideal sensors, called from Python (see `_sense`)."""
    return _sense(carray(_bindings_pointer(bindings_address), (1,))[0], measurement_address, motion_address)


@compiled_call(types.void, types.intp, types.float64)
def engage(bindings_address, gear):
    """Connect the engine to the wheels, or disconnect it, between two steps."""
    _engage(carray(_bindings_pointer(bindings_address), (1,))[0], gear)


@inlined_by_llvm
def _set_inputs(bindings, commands_address, torques_set):
    """Set the inputs of all actuators of the engine (see `carry_out`)."""
    commands = carray(_command_pointer(commands_address), (1,))[0]
    gear = float(CLUTCH_OPEN) if torques_set else commands.gear
    if gear != f64_pointer(bindings.gear)[0]:
        _engage(bindings, gear)
    give_late(bindings.faults, bindings.n_faults)
    brake_torques_Nm = carray(f64_pointer(commands_address), (BRAKES + _N_WHEELS,))[BRAKES:]
    ctrl = f64_pointer(bindings.ctrl)
    ctrl[bindings.steering_wheel] = commands.steering_wheel_demand_rad
    ctrl[bindings.superposition] = commands.superposition_demand_rad * bindings.ratio
    ctrl[bindings.rear_left] = commands.rear_steer_demand_rad
    ctrl[bindings.rear_right] = commands.rear_steer_demand_rad
    added_Nm = carray(f64_pointer(commands_address), (TORQUES + _N_WHEELS,))[TORQUES:]
    drive_torque_Nm = 0.0
    if commands.gear != CLUTCH_OPEN:
        drive_torque_Nm = commands.drive_torque_demand_Nm + commands.drive_torque_change_Nm
        for wheel in range(_N_WHEELS):
            if bindings.driven_by[wheel] == ENGINE:
                drive_torque_Nm += added_Nm[wheel]
    setup = carray(_setup_pointer(bindings.brake_setup), (1,))[0]
    state = carray(_state_pointer(bindings.brake_state), (1,))[0]
    sensors = carray(f64_pointer(bindings.sensordata), (bindings.sizes[0],))
    wheel_speeds, ax = sensors[bindings.wheel_speed : bindings.wheel_speed + _N_WHEELS], sensors[bindings.accelerometer]
    if bindings.n_sensors != 0:
        outputs = carray(f64_pointer(bindings.sensor_memory), (bindings.sensor_memory_size,))
        wheel_speeds, ax = outputs[WHEEL_SPEEDS : WHEEL_SPEEDS + _N_WHEELS], outputs[AX]
    pedal = 0.0 if torques_set else commands.brake_pedal
    drive_torque_Nm = step_brakes(
        setup, state, wheel_speeds, ax, pedal, drive_torque_Nm, brake_torques_Nm, commands.side_difference_Pa
    )
    for wheel in range(_N_WHEELS):
        if not torques_set:
            # Without + 0.0, a wheel that is not driven would get -0.0 during engine braking.
            ctrl[bindings.drives[wheel]] = bindings.drive_fractions[wheel] * drive_torque_Nm + 0.0
            ctrl[bindings.brakes[wheel]] = commands.parking_brake * setup.parking_torque_Nm[wheel]
        ctrl[bindings.brakes[wheel]] += setup.torque_per_pressure_NmpPa[wheel] * state.pressure_Pa[wheel]
    if bindings.n_motors != 0:
        if not torques_set:
            # A motor has no clutch: with it open, only the driver's torque is missing.
            for wheel in range(_N_WHEELS):
                if bindings.driven_by[wheel] == MOTOR:
                    demand_Nm = ctrl[bindings.drives[wheel]] + added_Nm[wheel]
                    ctrl[bindings.drives[wheel]] = _with_grip(setup, state, wheel, demand_Nm)
        step_motors(
            bindings.motors, bindings.n_motors, bindings.battery, bindings.electric_state, ctrl, bindings.drives,
            carray(f64_pointer(bindings.qvel), (bindings.n_dofs,)), bindings.spins, bindings.timestep_s, torques_set,
        )  # fmt: skip


@inlined_by_llvm
def carry_out(bindings_address, commands_address, torques_set, measurement_address, motion_address):
    """Carry out the commands, advance the engine, record and read the sensors; return whether the state is valid."""
    # The numbers of the commands (`COMMAND_ROW`) are copied into the first recorded array after the engine's. An
    # invalid state is not recorded.
    bindings = carray(_bindings_pointer(bindings_address), (1,))[0]
    row_address = bindings.sources[_ENGINE_ARRAYS]
    _copy(commands_address, row_address, bindings.sizes[_ENGINE_ARRAYS])
    _set_inputs(bindings, row_address, torques_set)
    advance(carray(implicit_plan_pointer(bindings.implicit), (1,))[0])
    keep_demands(bindings.faults, bindings.n_faults)
    sane = _sense(bindings, measurement_address, motion_address)
    if bindings.tape != 0 and sane:
        _record(bindings, carray(_tape_pointer(bindings.tape), (1,))[0])
    if bindings.n_sensors == 0:
        return sane
    chains = carray(_chain_pointer(bindings.sensors), (bindings.n_sensors,))
    memory = carray(f64_pointer(bindings.sensor_memory), (bindings.sensor_memory_size,))
    # The first number of a measurement is its time.
    _copy(measurement_address + 8, bindings.sensor_memory, _N_MEASURED)
    measure(chains, memory, bindings.wheel_radii_m, bindings.timestep_s)
    misread(bindings.faults, bindings.n_faults, memory)
    _copy(bindings.sensor_memory, measurement_address + 8, _N_MEASURED)
    return sane


STEP: Final = (types.intp, types.intp, types.boolean, types.intp, types.intp)
"""Types of the arguments of `step`."""


@compiled_call(types.boolean, *STEP)
def step(bindings_address, commands_address, torques_set, measurement_address, motion_address):
    """Make one step (see `carry_out`)."""
    return carry_out(bindings_address, commands_address, torques_set, measurement_address, motion_address)


@compiled_call(types.void, types.intp, types.Array(types.float64, 2, "C"))
def replay(bindings_address, inputs):
    """Advance the engine by one step for each row of inputs."""
    bindings = carray(_bindings_pointer(bindings_address), (1,))[0]
    implicit = carray(implicit_plan_pointer(bindings.implicit), (1,))[0]
    ctrl = f64_pointer(bindings.ctrl)
    for step in range(len(inputs)):
        for actuator in range(inputs.shape[1]):
            ctrl[actuator] = inputs[step, actuator]
        advance(implicit)

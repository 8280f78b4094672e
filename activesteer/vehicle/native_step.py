"""One step of the engine in one native call: commands in, a row for the recorder and what the sensors say out.

The call holds no lock of Python's. All that it needs stands in a `STEP_PLAN`, addresses and indices that a vehicle
looks up once; so the compiled code is the same for every car.
"""

from __future__ import annotations

import math
from typing import Final

from numba import carray, from_dtype, types

from activesteer.brakes.control_unit import step_brakes
from activesteer.brakes.records import BRAKE_SETUP, BRAKE_STATE
from activesteer.compilation import compiled_call, inlined
from activesteer.conventions import CORNERS
from activesteer.sensors.block import AX, WHEEL_SPEEDS, measured
from activesteer.sensors.signal_chain import CHAIN
from activesteer.vehicle.channels.raw_rows import ENGINE_ARRAYS
from activesteer.vehicle.chassis_heading import YAW_DOF
from activesteer.vehicle.command_row import (
    ACTUATOR_COMMAND,
    BRAKES,
    COMMAND_ROW,
    DRIVER_COMMAND,
    write_commands,
)
from activesteer.vehicle.native_implicit import advance, implicit_plan_pointer
from activesteer.vehicle.native_memory import f64_pointer, pointer_to
from activesteer.vehicle.powertrain import CLUTCH_OPEN
from activesteer.vehicle.step_plan import N_SOURCES, N_WARNINGS, STEP_PLAN, TAPE

FASTEST_MPS: Final = 200.0
"""No car of ours goes faster; a speed beyond it, or none at all, is a run that has diverged [m/s]."""

_N_WHEELS: Final = len(CORNERS)
_ENGINE_ARRAYS: Final = len(ENGINE_ARRAYS)
"""They are the first of the arrays that a row is copied from."""
_EXPONENT: Final = 0x7FF0000000000000
"""Bits of a float64 that are all set where it is not finite, and only there."""

_tape_pointer: Final = pointer_to(from_dtype(TAPE))
_plan_pointer: Final = pointer_to(from_dtype(STEP_PLAN))
_command_pointer: Final = pointer_to(from_dtype(COMMAND_ROW))
_chain_pointer: Final = pointer_to(from_dtype(CHAIN))
_setup_pointer: Final = pointer_to(from_dtype(BRAKE_SETUP))
_state_pointer: Final = pointer_to(from_dtype(BRAKE_STATE))
_bits_pointer: Final = pointer_to(types.int64)
_counter_pointer: Final = pointer_to(types.int32)


@inlined
def _all_finite(address, size):
    bits = carray(_bits_pointer(address), (size,))
    bad = False
    for index in range(size):
        bad |= (bits[index] & _EXPONENT) == _EXPONENT
    return not bad


@inlined
def _sense(plan):
    """Whether all is well, and the members of `Measurement` and of `Motion`."""
    s = carray(f64_pointer(plan.sensordata), (plan.sizes[0],))
    yaw_rate = carray(f64_pointer(plan.qvel), (plan.n_dofs,))[YAW_DOF]
    speed = s[plan.velocimeter]
    sane = -FASTEST_MPS < speed < FASTEST_MPS and _all_finite(plan.qvel, plan.n_dofs)
    for index in range(_ENGINE_ARRAYS):
        sane &= _all_finite(plan.sources[index], plan.sizes[index])
    warnings = carray(_counter_pointer(plan.warnings), (2 * N_WARNINGS,))
    for index in range(N_WARNINGS):
        sane &= warnings[2 * index] == 0
    w, x, y, z = s[plan.orientation], s[plan.orientation + 1], s[plan.orientation + 2], s[plan.orientation + 3]
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    cos, sin = math.cos(yaw), math.sin(yaw)
    east, north = s[plan.velocity], s[plan.velocity + 1]
    pressure_Pa = carray(_state_pointer(plan.brake_state), (1,))[0].pressure_Pa
    return (
        sane,
        (
            carray(f64_pointer(plan.time), (1,))[0],
            speed,
            yaw_rate,
            s[plan.accelerometer + 1],
            s[plan.accelerometer],
            s[plan.steering_wheel_angle],
            0.5 * (s[plan.rear_left_angle] + s[plan.rear_right_angle]),
            s[plan.superposition_angle] / plan.ratio,
            (s[plan.wheel_speed], s[plan.wheel_speed + 1], s[plan.wheel_speed + 2], s[plan.wheel_speed + 3]),
            (pressure_Pa[0], pressure_Pa[1], pressure_Pa[2], pressure_Pa[3]),
        ),
        (s[plan.position], s[plan.position + 1], yaw, cos * east + sin * north, cos * north - sin * east, yaw_rate),
    )


@inlined
def _copy(source_address, target_address, size):
    source, target = f64_pointer(source_address), f64_pointer(target_address)
    for item in range(size):
        target[item] = source[item]


@inlined
def _record(plan, tape):
    """Copies the recorded arrays onto a tape, one behind the other, and the poses of the bodies where they are due."""
    if tape.room == 0:
        return
    place = tape.row
    for index in range(N_SOURCES):
        _copy(plan.sources[index], place, plan.sizes[index])
        place += 8 * plan.sizes[index]
    if tape.rows % tape.pose_every == 0:
        _copy(plan.positions, tape.position, 3 * plan.n_bodies)
        _copy(plan.quaternions, tape.quaternion, 4 * plan.n_bodies)
        tape.position += 24 * plan.n_bodies
        tape.quaternion += 32 * plan.n_bodies
    tape.row += tape.row_bytes
    tape.rows += 1
    tape.room -= 1


_MEASUREMENT: Final = types.Tuple([types.float64] * 8 + [types.UniTuple(types.float64, 4)] * 2)
_SENSED: Final = types.Tuple([types.boolean, _MEASUREMENT, types.UniTuple(types.float64, 6)])


@compiled_call(_SENSED, types.intp)
def sense(plan_address):
    """What ideal sensors say now.

    Args:
        plan_address: Address of a `STEP_PLAN`.

    Returns:
        Whether all is well, and the members of `Measurement` and of `Motion`.
    """
    return _sense(carray(_plan_pointer(plan_address), (1,))[0])


@compiled_call(_SENSED, types.intp, DRIVER_COMMAND, ACTUATOR_COMMAND, types.intp, types.boolean)
def step(plan_address, command, asked, tape_address, torques_stand):
    """Carries out the commands, makes one step of the engine and reads everything.

    Args:
        plan_address: Address of a `STEP_PLAN`; the commands are kept where the source behind the engine's arrays is.
        command: A `DriverCommand`.
        asked: An `ActuatorCommand`.
        tape_address: Address of a `TAPE` that the step is recorded on, unless something is wrong with it; 0 for none.
        torques_stand: Whether drive and brakes have their inputs already; what driver and controller want of the drive,
            and the pedal, then do not count.

    Returns:
        Whether all is well, and the members of `Measurement` and of `Motion`.
    """
    plan = carray(_plan_pointer(plan_address), (1,))[0]
    commands_address = plan.sources[_ENGINE_ARRAYS]
    write_commands(commands_address, command, asked)
    commands = carray(_command_pointer(commands_address), (1,))[0]
    brake_torques_Nm = carray(f64_pointer(commands_address), (BRAKES + _N_WHEELS,))[BRAKES:]
    ctrl = f64_pointer(plan.ctrl)
    ctrl[plan.steering_wheel] = commands.steering_wheel_demand_rad
    ctrl[plan.superposition] = commands.superposition_demand_rad * plan.ratio
    ctrl[plan.rear_left] = commands.rear_steer_demand_rad
    ctrl[plan.rear_right] = commands.rear_steer_demand_rad
    drive_torque_Nm = 0.0
    if commands.gear != CLUTCH_OPEN:
        drive_torque_Nm = commands.drive_torque_demand_Nm + commands.drive_torque_change_Nm
    setup = carray(_setup_pointer(plan.brake_setup), (1,))[0]
    state = carray(_state_pointer(plan.brake_state), (1,))[0]
    sensors = carray(f64_pointer(plan.sensordata), (plan.sizes[0],))
    wheel_speeds, ax = sensors[plan.wheel_speed : plan.wheel_speed + _N_WHEELS], sensors[plan.accelerometer]
    if plan.n_sensors != 0:
        said = carray(f64_pointer(plan.sensor_memory), (plan.sensor_memory_size,))
        wheel_speeds, ax = said[WHEEL_SPEEDS : WHEEL_SPEEDS + _N_WHEELS], said[AX]
    pedal = 0.0 if torques_stand else commands.brake_pedal
    drive_torque_Nm = step_brakes(
        setup, state, wheel_speeds, ax, pedal, drive_torque_Nm, brake_torques_Nm, commands.side_difference_Pa
    )
    for wheel in range(_N_WHEELS):
        if not torques_stand:
            # + 0.0: a wheel that is not driven would get -0.0 while the engine brakes.
            ctrl[plan.drives[wheel]] = plan.drive_fractions[wheel] * drive_torque_Nm + 0.0
            ctrl[plan.brakes[wheel]] = commands.parking_brake * setup.parking_torque_Nm[wheel]
        ctrl[plan.brakes[wheel]] += setup.torque_per_pressure_NmpPa[wheel] * state.pressure_Pa[wheel]
    advance(carray(implicit_plan_pointer(plan.implicit), (1,))[0])
    sane, truth, motion = _sense(plan)
    if tape_address != 0 and sane:
        _record(plan, carray(_tape_pointer(tape_address), (1,))[0])
    if plan.n_sensors == 0:
        return sane, truth, motion
    chains = carray(_chain_pointer(plan.sensors), (plan.n_sensors,))
    memory = carray(f64_pointer(plan.sensor_memory), (plan.sensor_memory_size,))
    return sane, measured(chains, memory, plan.wheel_radii_m, plan.timestep_s, truth), motion


@compiled_call(types.void, types.intp, types.Array(types.float64, 2, "C"))
def replay(plan_address, inputs):
    """Makes a step of the engine for each row of inputs, and nothing else.

    Args:
        plan_address: Address of a `STEP_PLAN`.
        inputs: Inputs of all actuators, shape (steps, number of actuators).
    """
    plan = carray(_plan_pointer(plan_address), (1,))[0]
    implicit = carray(implicit_plan_pointer(plan.implicit), (1,))[0]
    ctrl = f64_pointer(plan.ctrl)
    for step in range(len(inputs)):
        for actuator in range(inputs.shape[1]):
            ctrl[actuator] = inputs[step, actuator]
        advance(implicit)

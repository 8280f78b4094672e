"""The closed loop in one native call: many steps of many cars, without Python's lock.

It carries out the laws of the package's own driver and controllers, each on a record of the object (`native_blocks`),
and steps each car as `ClosedLoop` does. Both give the same results to the last bit.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numba import carray, from_dtype, types

from activesteer.compilation import address_of, call_at, compiled_call, inlined
from activesteer.controllers.law_interface import N_HELD, N_STEERING
from activesteer.controllers.native_laws import UNIT, decide
from activesteer.driver.constant_radius import circle_angle, correct_circle
from activesteer.driver.human import HumanDriver
from activesteer.driver.open_loop import turned
from activesteer.driver.path_preview import SPEED_STEP_MPS, look, looks, moved
from activesteer.native_blocks import ARRAY, record_type
from activesteer.native_memory import array_of, f64_pointer, pointer_to, word_pointer
from activesteer.native_messages import load_numbers, native_type, store_numbers
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, Motion, numbers_of, widths_of
from activesteer.vehicle import native_step
from activesteer.vehicle.powertrain import drive_limits, engine_speed

ANGLE, CURVATURE, PATH = range(3)
"""Kinds of a setpoint: steering wheel angle, curvature, path."""
GIVEN, HUMAN = range(2)
"""Kinds of drivers: the row of commands holds, or `HumanDriver` decides."""
DONE, NEEDS_PYTHON, INSANE = range(3)
"""Reasons why a car has stopped: all its steps are made; the next step needs Python, which knows the driver's gains at
a new speed; a value is beyond all reason."""

SETPOINT: Final = np.dtype(
    (
        np.record,
        [
            *((name, np.float64) for name in ("steering_wheel_rad", "speed_mps", "brake_pedal", "parking_brake")),
            ("curvature_1pm", np.float64),
            *((name, np.intp) for name in ("kind", "holds_speed", "torques_set")),
        ],
    )
)
"""A `Setpoint` for compiled code."""
TORQUES: Final = np.dtype((np.record, [("drive_Nm", np.float64, (4,)), ("brake_Nm", np.float64, (4,))]))
CAR: Final = np.dtype(
    (
        np.record,
        [
            ("bindings", np.intp),
            ("drive_fractions", np.float64, (4,)),
            ("drive_numbers", np.float64, (4,)),
            ("driver_kind", np.intp),
            ("driver", record_type(HumanDriver)),
            ("controller_kind", np.intp),
            *UNIT,
            *((name, np.intp) for name in ("every", "calls", "on_bus", "numbers", "estimate")),
            ("bus", ARRAY),
            ("held", np.float64, (N_HELD,)),
            ("steering_ratio", np.float64),
            *((name, np.intp) for name in ("setpoints", "torques", "n_setpoints", "first")),
            ("spacing_m", np.float64),
            *((name, ARRAY) for name in ("path_x_m", "path_y_m")),
            ("headings_rad", np.float64, (2,)),
            *((name, np.intp) for name in ("driver_command", "actuator_command", "measurement", "motion")),
            *((name, np.intp) for name in ("step", "left", "status")),
        ],
    )
)
"""A car with its loop: see `native_car`."""

_ARGUMENTS: Final = (types.intp, native_type(DriverCommand), native_type(ActuatorCommand), types.boolean)
_step: Final = call_at(types.Tuple([types.boolean, native_type(Measurement), native_type(Motion)]), *_ARGUMENTS)
_setpoint_pointer: Final = pointer_to(from_dtype(SETPOINT))
_torques_pointer: Final = pointer_to(from_dtype(TORQUES))


def _blank(message: type[Any]) -> tuple[Any, ...]:
    return tuple(None if width == 0 else 0.0 if width == 1 else (0.0,) * width for width in widths_of(message))


_DRIVER_COMMAND, _ACTUATOR_COMMAND = _blank(DriverCommand), _blank(ActuatorCommand)
_DRIVER_NUMBERS: Final = [number.name for number in numbers_of(DriverCommand)]
_WHEEL, _DRIVE, _PEDAL, _SATURATED, _GEAR, _FRONT, _PARKING = map(
    _DRIVER_NUMBERS.index,
    ("steering_wheel_demand_rad", "drive_torque_demand_Nm", "brake_pedal", "saturated", "gear",
     "front_steer_demand_rad", "parking_brake"),
)  # fmt: skip
_MEASURED: Final = [number.name for number in numbers_of(Measurement)]
_SPEED, _YAW_RATE, _STEERING_WHEEL, _WHEEL_SPEEDS = map(
    _MEASURED.index, ("speed_mps", "yaw_rate_radps", "steering_wheel_rad", "fl_wheel_speed_radps")
)
_N_MEASURED, _N_MOTION, _N_DRIVER = len(_MEASURED), len(numbers_of(Motion)), len(_DRIVER_NUMBERS)
_MOTION_SPEED: Final = Motion._fields.index("speed_mps")


@inlined
def _drive(car, setpoint, measured, motion, command):
    """Write the command of the driver; False if Python must prepare the step."""
    human, robot = car.driver, car.driver._open_loop
    angle, slow_arms = setpoint.steering_wheel_rad, False
    if setpoint.kind == PATH:
        path = human._path
        if path._steps % path._preview_every_steps == 0:
            decided, address = array_of(path._decided_rad), 0
            if looks(motion[_MOTION_SPEED]):
                rounded = int(np.rint(motion[_MOTION_SPEED] / SPEED_STEP_MPS))
                if rounded < path._known.size:
                    address = word_pointer(path._known.address)[rounded]
                if address == 0:
                    return False
            gains = carray(f64_pointer(address), (path._row_size,)) if address != 0 else decided
            look(
                path, robot.steering_wheel_limit_rad, decided,
                motion[0], motion[1], motion[2], motion[3], motion[4], motion[5],
                car.spacing_m, array_of(car.path_x_m), array_of(car.path_y_m), car.headings_rad[0], car.headings_rad[1],
                gains,
            )  # fmt: skip
        path._steps += 1
        angle, slow_arms = moved(path)
    elif setpoint.kind == CURVATURE:
        angle = circle_angle(human._constant_radius, robot, setpoint.curvature_1pm)
    engine_radps, low, high = 0.0, 0.0, 0.0
    if setpoint.holds_speed != 0:
        engine_radps = engine_speed(car.drive_fractions, measured[_WHEEL_SPEEDS : _WHEEL_SPEEDS + 4])
        n = car.drive_numbers
        low, high = drive_limits(engine_radps, 1 if setpoint.speed_mps >= 0.0 else -1, n[0], n[1], n[2], n[3])
    turn, torque, saturated, gear = turned(
        robot, angle, setpoint.holds_speed != 0, setpoint.speed_mps, measured[_SPEED], engine_radps, low, high
    )
    if setpoint.kind == PATH:
        human._path._wheel_rad = turn
    elif setpoint.kind == CURVATURE and turn == angle:
        correct_circle(human._constant_radius, setpoint.curvature_1pm, measured[_YAW_RATE], measured[_SPEED])
    command[_WHEEL], command[_DRIVE], command[_PEDAL] = turn, torque, setpoint.brake_pedal
    command[_SATURATED], command[_GEAR] = 1.0 if saturated or slow_arms else 0.0, float(gear)
    command[_FRONT], command[_PARKING] = turn / robot.steering_ratio, setpoint.parking_brake
    return True


@inlined
def _control(car, measured, driver, command):
    """Write the command of the controller that reaches the actuators, and its estimate."""
    held = car.held
    if car.calls % car.every == 0:
        front_rad = driver[_FRONT]
        if car.steering_ratio != 0.0:
            front_rad = measured[_STEERING_WHEEL] / car.steering_ratio
        decide(car, car.controller_kind, car.measurement, front_rad, driver[_PEDAL], held.ctypes.data)
    length, bus = car.on_bus + 1, array_of(car.bus)
    newest, oldest = car.calls % length * car.numbers, (car.calls + 1) % length * car.numbers
    for index in range(car.numbers):
        bus[newest + index] = held[index]
    for index in range(N_STEERING):
        command[index] = bus[oldest + index]
    if car.estimate != 0:
        estimate = f64_pointer(car.estimate)
        for index in range(N_STEERING, car.numbers):
            estimate[index - N_STEERING] = bus[oldest + index]
    car.calls += 1


@inlined
def _torques(car, row, ctrl, drives, brakes):
    torques: Any = carray(_torques_pointer(car.torques), (car.n_setpoints,))[row]
    for wheel in range(4):
        ctrl[drives[wheel]], ctrl[brakes[wheel]] = torques.drive_Nm[wheel], torques.brake_Nm[wheel]


@compiled_call(types.void, types.Array(from_dtype(CAR), 1, "C"), types.intp, types.intp, types.intp)
def drive_cars(cars, first, last, step_address):
    """Drive each of some cars for the number of steps in `left`, or until one needs Python.

    Args:
        cars: Records of `CAR`; changed.
        first: First car.
        last: Car after the last one.
        step_address: Address of `native_step.step`.
    """
    for index in range(first, last):
        car = cars[index]
        setpoints: Any = carray(_setpoint_pointer(car.setpoints), (car.n_setpoints,))
        measured = carray(f64_pointer(car.measurement), (_N_MEASURED,))
        motion = carray(f64_pointer(car.motion), (_N_MOTION,))
        driver = carray(f64_pointer(car.driver_command), (_N_DRIVER,))
        bindings = carray(native_step._bindings_pointer(car.bindings), (1,))[0]
        car.status = DONE
        while car.left > 0:
            row = min(car.step - car.first, car.n_setpoints - 1)
            torques_set = False
            if car.driver_kind == HUMAN:
                if not _drive(car, setpoints[row], measured, motion, driver):
                    car.status = NEEDS_PYTHON
                    break
                torques_set = setpoints[row].torques_set != 0
            if car.controller_kind != 0:
                _control(car, measured, driver, f64_pointer(car.actuator_command))
            if torques_set:
                _torques(car, row, f64_pointer(bindings.ctrl), bindings.drives, bindings.brakes)
            sane, measurement, moving = _step(
                step_address,
                (
                    car.bindings,
                    load_numbers(car.driver_command, _DRIVER_COMMAND),
                    load_numbers(car.actuator_command, _ACTUATOR_COMMAND),
                    torques_set,
                ),
            )
            store_numbers(car.measurement, measurement)
            store_numbers(car.motion, moving)
            car.step += 1
            car.left -= 1
            if not sane:
                car.status = INSANE
                break


STEP_ADDRESS: Final = address_of(native_step.step)
"""Address of the step; 0 where numba is switched off, and there is no native loop."""

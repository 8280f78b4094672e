"""The loop: setpoint -> driver -> controller -> vehicle with faults, sensors and recorded row, once every step.

Every run of every car passes through `drive_cars`: one car or many, with native and with Python blocks. It stops where
Python has to act, returns the reason, and continues from there; see `closed_loop`.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numba import carray, from_dtype, types

from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, Motion, numbers_of
from activesteer.driver.human import LINE, SETPOINT, HumanDriver, follow
from activesteer.native.compilation import address_of, call_at, compiled_call, inlined
from activesteer.native.memory import (
    N_COMMAND,
    N_HELD,
    array_of,
    call_law,
    f64_pointer,
    pointer_to,
)
from activesteer.native.records import ARRAY, record_type
from activesteer.vehicle import native_step
from activesteer.vehicle.parameters import drive_limits, engine_speed

NATIVE, PYTHON = range(2)
"""Kinds of a driver or controller: compiled code; a block in Python."""
DRIVE, CONTROL, PASS_ON = range(3)
"""Stages of a step, each of which a car can stop before: the driver; the controller; its bus, and the car."""
DONE, NEEDS_BLOCKS, AT_CHANGE, TAPE_FULL, NEEDS_SETPOINTS = range(5)
NEEDS_GAINS, NEEDS_DRIVER, NEEDS_CONTROLLER, INSANE = range(5, 9)
"""Reasons why a car has stopped, such as a fault that begins or ends, or an implausibly large value (`INSANE`)."""

MESSAGES: Final[dict[str, type[Any]]] = {
    "driver_command": DriverCommand, "actuator_command": ActuatorCommand, "measurement": Measurement, "motion": Motion,
}  # fmt: skip
"""Messages by the field of `CAR` that holds their numbers."""
CAR: Final = np.dtype(
    (
        np.record,
        [
            *((name, np.intp) for name in ("step", "left", "stage", "status", "next_change", "bindings")),
            *((name, np.float64, (len(numbers_of(message)),)) for name, message in MESSAGES.items()),
            *((name, np.intp) for name in ("setpoints", "n_setpoints", "first", "last")),
            ("path", LINE),
            *((name, np.intp) for name in ("loaded", "driver_kind", "driver_given")),
            ("driver", record_type(HumanDriver)),
            ("drive_fractions", np.float64, (4,)),
            ("drive_numbers", np.float64, (4,)),
            ("torques_set", np.intp),
            ("torques_Nm", np.float64, (8,)),
            *((name, np.intp) for name in ("controller_kind", "controller_given", "law", "block")),
            *((name, np.intp) for name in ("every", "calls", "on_bus", "estimate")),
            ("steering_ratio", np.float64),
            ("seen", np.float64, (len(numbers_of(DriverCommand)),)),
            ("held", np.float64, (N_HELD,)),
            ("bus", ARRAY),
        ],
    )
)
"""Record of a car with its loop.

`step`, `left`: steps made and steps to make; `stage`, `status`: where it stands and why; `next_change`: step before
which a fault begins or ends. `bindings`: `Vehicle.address`. `first`, `last`: steps of the first setpoint and behind the
last one. `loaded`: whether driver and controller are in the record. `driver_given`, `controller_given`: whether the
current command holds. `torques_Nm`: torques of the wheels if they are set. `law`, `block`: addresses of a native
controller's law and block. `every`, `on_bus`: steps between two calls of the controller, and steps that its command
takes to arrive; `calls`: steps that it has counted. `estimate`: address of the recorded estimate, or 0.
`steering_ratio`: not 0 if the controller knows the driver's demand by the angle sensor only; `seen`: the driver's
command as it knows it. `held`, `bus`: its last decision, and those on the way (`N_HELD`)."""

_step: Final = call_at(types.boolean, *native_step.STEP)
_setpoint_pointer: Final = pointer_to(from_dtype(SETPOINT))

_DRIVER_NUMBERS: Final = [number.name for number in numbers_of(DriverCommand)]
_WHEEL, _FRONT = map(_DRIVER_NUMBERS.index, ("steering_wheel_demand_rad", "front_steer_demand_rad"))
_MEASURED: Final = [number.name for number in numbers_of(Measurement)]
_STEERING_WHEEL, _WHEEL_SPEEDS = map(_MEASURED.index, ("steering_wheel_rad", "fl_wheel_speed_radps"))
_N_DRIVER: Final = len(_DRIVER_NUMBERS)


@inlined
def _begin(car, bindings):
    """Return whether a step can begin, as a status."""
    if car.loaded == 0:
        return NEEDS_BLOCKS
    if car.step == car.next_change:
        return AT_CHANGE
    if bindings.tape != 0 and carray(native_step._tape_pointer(bindings.tape), (1,))[0].room == 0:
        return TAPE_FULL
    return DONE


@inlined
def _drive(car):
    """Find the setpoint, call the driver, and return a status."""
    if car.driver_given != 0:
        return DONE
    if car.driver_kind == PYTHON:
        return NEEDS_DRIVER
    if car.step < car.first or car.step >= car.last:
        return NEEDS_SETPOINTS
    setpoints: Any = carray(_setpoint_pointer(car.setpoints), (car.n_setpoints,))
    setpoint = setpoints[min(car.step - car.first, car.n_setpoints - 1)]
    measured: Any = car.measurement
    engine_radps, low_Nm, high_Nm = 0.0, 0.0, 0.0
    if setpoint.holds_speed != 0:
        engine_radps = engine_speed(car.drive_fractions, measured[_WHEEL_SPEEDS : _WHEEL_SPEEDS + 4])
        n = car.drive_numbers
        low_Nm, high_Nm = drive_limits(engine_radps, 1 if setpoint.speed_mps >= 0.0 else -1, n[0], n[1], n[2], n[3])
    found = follow(
        car.driver, setpoint, car.path, measured, car.motion, engine_radps, low_Nm, high_Nm, car.driver_command
    )
    if not found:
        return NEEDS_GAINS
    car.torques_set = setpoint.torques_set
    if setpoint.torques_set != 0:
        for place in range(8):
            car.torques_Nm[place] = setpoint.torques_Nm[place]
    return DONE


@inlined
def _control(car):
    """Let the controller compute a command if it is due, and return a status."""
    if car.controller_given != 0 or car.calls % car.every != 0:
        return DONE
    seen = car.driver_command
    if car.steering_ratio != 0.0:
        seen = car.seen
        for place in range(_N_DRIVER):
            seen[place] = car.driver_command[place]
        seen[_WHEEL] = car.measurement[_STEERING_WHEEL]
        seen[_FRONT] = seen[_WHEEL] / car.steering_ratio
    if car.controller_kind == PYTHON:
        return NEEDS_CONTROLLER
    call_law(car.law, (car.block, seen.ctypes.data, car.measurement.ctypes.data, car.held.ctypes.data))
    return DONE


@inlined
def _pass_on(car):
    """Send the held command over the bus, and receive the arriving command."""
    length, bus = car.on_bus + 1, array_of(car.bus)
    newest, oldest = car.calls % length * N_HELD, (car.calls + 1) % length * N_HELD
    for place in range(N_HELD):
        bus[newest + place] = car.held[place]
    estimate = f64_pointer(car.estimate)
    for place in range(N_COMMAND):
        car.actuator_command[place] = bus[oldest + place]
    if car.estimate != 0 and bus[oldest + N_HELD - 1] != 0.0:
        for place in range(N_COMMAND, N_HELD - 1):
            estimate[place - N_COMMAND] = bus[oldest + place]
    car.calls += 1


@inlined
def _advance(car, bindings, step_address):
    """Step the car, which records its row, and return a status."""
    torques_set = car.torques_set != 0
    if torques_set:
        ctrl = f64_pointer(bindings.ctrl)
        for wheel in range(4):
            ctrl[bindings.drives[wheel]] = car.torques_Nm[wheel]
            ctrl[bindings.brakes[wheel]] = car.torques_Nm[4 + wheel]
    # In the record, the numbers of the controller's command follow those of the driver's.
    sane = _step(
        step_address,
        (
            car.bindings,
            car.driver_command.ctypes.data,
            torques_set,
            car.measurement.ctypes.data,
            car.motion.ctypes.data,
        ),
    )
    car.step += 1
    car.left -= 1
    return DONE if sane else INSANE


@compiled_call(types.void, types.Array(from_dtype(CAR), 1, "C"), types.intp, types.intp, types.intp)
def drive_cars(cars, first, last, step_address):
    """Drive each car for the number of steps in `left`, or until Python must act."""
    for index in range(first, last):
        car = cars[index]
        bindings = carray(native_step._bindings_pointer(car.bindings), (1,))[0]
        car.status = DONE
        while car.left > 0:
            if car.stage == DRIVE:
                car.status = _begin(car, bindings)
                if car.status == DONE:
                    car.status = _drive(car)
                if car.status != DONE:
                    break
                car.stage = CONTROL
            if car.stage == CONTROL:
                car.status = _control(car)
                if car.status != DONE:
                    break
                car.stage = PASS_ON
            if car.stage == PASS_ON and car.controller_given == 0:
                _pass_on(car)
            car.stage = DRIVE
            car.status = _advance(car, bindings, step_address)
            if car.status != DONE:
                break


STEP_ADDRESS: Final = address_of(native_step.step)
"""Address of the step."""

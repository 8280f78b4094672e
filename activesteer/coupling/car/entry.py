"""The step of the car as a C function: commands and results as consecutive numbers."""

from __future__ import annotations

from typing import Any, Final

from numba import types

from activesteer.compilation import compiled_callback
from activesteer.native_messages import load_numbers, store_numbers
from activesteer.signals import ActuatorCommand, DriverCommand, numbers_of, widths_of
from activesteer.vehicle.native_step import carry_out

_BYTES: Final = 8


def _zeros(message: type[Any]) -> tuple[Any, ...]:
    """Return a message of zeros, with None for fields that are no numbers, as native code types it."""
    zeros = {0: None, 1: 0.0}
    return tuple(zeros.get(width, (0.0,) * width) for width in widths_of(message))


_DRIVER, _ACTUATOR = _zeros(DriverCommand), _zeros(ActuatorCommand)
_DRIVER_BYTES: Final = _BYTES * len(numbers_of(DriverCommand))


@compiled_callback(types.void, types.intp, types.intp, types.intp, types.intp)
def car_step(bindings, commands, torques_set, out):
    """Make one step of the car.

    Args:
        bindings: Address of a `STEP_BINDINGS`.
        commands: Address of the numbers of a `DriverCommand` and of an `ActuatorCommand`, float64.
        torques_set: 1 if the torques of the wheels are set in `ctrl`, else 0.
        out: Address of the result, float64: 1 if the state is sane, else 0; then the numbers of a `Measurement` and of
            a `Motion`.
    """
    driver = load_numbers(commands, _DRIVER)
    actuator = load_numbers(commands + _DRIVER_BYTES, _ACTUATOR)
    sane, measurement, motion = carry_out(bindings, driver, actuator, torques_set != 0)
    store_numbers(out, (1.0 if sane else 0.0, measurement, motion))

"""Memory, messages and controllers in compiled code, accessed by their addresses."""

from __future__ import annotations

import functools
import inspect
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import carray, from_dtype, types
from numba.extending import intrinsic, overload

from activesteer.core.signals import (
    ActuatorCommand,
    DriverCommand,
    Estimate,
    Measurement,
    numbers_of,
    record_fields,
    widths_of,
)
from activesteer.native.compilation import address_of, call_at, compiled_call, inlined
from activesteer.native.records import NativeBlock, record_type, table


def pointer_to(numba_type: types.Type) -> Any:
    """Return an intrinsic that converts an address to a pointer."""

    @intrinsic
    def cast(_typing_context, _address):
        signature = types.CPointer(numba_type)(types.intp)

        def generate(context, builder: ir.IRBuilder, sig, args):
            return builder.inttoptr(args[0], context.get_value_type(sig.return_type))

        return signature, generate

    return cast


f64_pointer = pointer_to(types.float64)
"""Convert an address (intp) to a pointer to float64."""
word_pointer = pointer_to(types.intp)
"""Convert an address (intp) to a pointer to a machine word."""


@inlined
def array_of(memory):
    """Return the array of float64 of a record of `records.ARRAY`."""
    return carray(f64_pointer(memory.address), (memory.size,))


@overload(table)
def _table(numbers):
    """Let compiled laws read the numbers of a block."""
    if isinstance(numbers, types.Record):
        return lambda numbers: array_of(numbers)  # noqa: PLW0108 - numba asks for a function of Python
    return None


@inlined
def word(address):
    """Read the machine word at an address."""
    return word_pointer(address)[0]


@inlined
def array_at(struct, offset, size):
    """Return the float64 array whose pointer is `offset` bytes into a struct, as a 1-D view of `size` elements."""
    return carray(f64_pointer(word(struct + offset)), (size,))


def records_at(kind: np.dtype[Any]) -> Any:
    """Return compiled code that views memory as an array of float64 records."""
    pointer = pointer_to(from_dtype(kind))

    @inlined
    def records(address, distance, count):
        return carray(pointer(address + 8 * int(distance)), (int(count),))

    return records


def message_pointer(message: type[Any]) -> Any:
    """Return an intrinsic that converts an address to a pointer to the numbers of a message."""
    return pointer_to(from_dtype(np.dtype((np.record, record_fields(message)))))


_command_pointer, measurement_pointer = message_pointer(DriverCommand), message_pointer(Measurement)

_IGNORED: Final = types.none
"""Type of a field that holds no number: native code ignores its value."""
_TYPES: Final = {0: _IGNORED, 1: types.float64}


def native_type(message: type[Any]) -> types.Tuple:
    """Return the numba type of a message from Python, whose numbers become float64."""
    # Check class and length of a message first: one that is too short ends the process.
    widths = widths_of(message)
    return types.Tuple([_TYPES.get(width) or types.UniTuple(types.float64, width) for width in widths])


def _places(kind: Any) -> list[tuple[int, ...]]:
    """Return the indices of all numbers of a nested tuple, in order."""
    places: list[tuple[int, ...]] = []
    for index, part in enumerate(kind):
        if isinstance(part, types.BaseTuple):
            places += [(index, *inner) for inner in _places(part)]
        elif part != _IGNORED:
            places.append((index,))
    return places


def _store(_typing_context, address, message):
    def generate(context, builder, _signature, arguments):
        start = builder.inttoptr(arguments[0], ir.DoubleType().as_pointer())
        for place, path in enumerate(_places(message)):
            pointer = builder.gep(start, [ir.Constant(ir.IntType(64), place)])
            builder.store(builder.extract_value(arguments[1], path), pointer)
        return context.get_dummy_value()

    return types.void(address, message), generate


store_numbers: Final[Any] = intrinsic(_store)
"""Write the numbers of a tuple as consecutive float64, in compiled code: `store_numbers(address, message)`."""


N_STEERING: Final = 6
"""Numbers of an `ActuatorCommand` that a controller with a native law decides; the others are 0."""
N_COMMAND: Final = len(numbers_of(ActuatorCommand))
"""Numbers of an `ActuatorCommand`."""
N_HELD: Final = N_COMMAND + len(Estimate._fields) + 1
"""Numbers of a decision: the command, its estimate, and 1 if there is an estimate."""
CALL: Final = (types.intp, types.intp, types.intp, types.intp)
"""Addresses of a law's block, numbers of `DriverCommand` and `Measurement`, and `N_HELD` numbers to write."""
assert [number.name for number in numbers_of(ActuatorCommand)[:N_STEERING]] == [
    "rear_steer_demand_rad", "superposition_demand_rad", "yaw_rate_desired_radps", "prediction_rad", "correction_rad",
    "saturated",
]  # fmt: skip


call_law: Final = call_at(types.void, *CALL)
"""Call a law in compiled code: `call_law(address, (block, command, measurement, held))`."""


def law_address(controller: Any) -> int:
    """Return the address of the compiled law of a controller, or 0 if it has none or its `step` is watched."""
    if not isinstance(controller, NativeBlock) or controller.is_watched:
        return 0
    kind = type(controller)
    # A class that inherits a law may change the step.
    if "compiled_in" in vars(kind):
        return import_module(vars(kind)["compiled_in"]).ADDRESS
    return _compiled(kind) if "law" in vars(kind) else 0


@functools.cache
def _compiled(kind: type[Any]) -> int:
    """Return the address of the compiled law of a kind of controller."""
    law, block_pointer = kind.law, pointer_to(from_dtype(record_type(kind)))

    @compiled_call(types.void, *CALL, about=(kind.__name__, Path(inspect.getfile(kind))))
    def decide(block, command, measurement, held):
        answer: Any = law(
            carray(block_pointer(block), (1,))[0],
            carray(_command_pointer(command), (1,))[0],
            carray(measurement_pointer(measurement), (1,))[0],
        )
        numbers = f64_pointer(held)
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4] = answer[:5]
        numbers[5] = 1.0 if answer[5] else 0.0

    return address_of(decide)

"""Memory and messages in compiled code: addresses, rows of records, fields."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import carray, from_dtype, types
from numba.extending import intrinsic, overload

from activesteer.compilation import inlined
from activesteer.native_records import table
from activesteer.signals import widths_of


def pointer_to(numba_type: types.Type) -> Any:
    """Return an intrinsic: address (intp) -> pointer to a type."""

    @intrinsic
    def cast(_typing_context, _address):
        signature = types.CPointer(numba_type)(types.intp)

        def generate(context, builder: ir.IRBuilder, sig, args):
            return builder.inttoptr(args[0], context.get_value_type(sig.return_type))

        return signature, generate

    return cast


f64_pointer = pointer_to(types.float64)
"""Address (intp) -> pointer to float64."""
word_pointer = pointer_to(types.intp)
"""Address (intp) -> pointer to a machine word."""


@inlined
def array_of(memory):
    """Return the array of float64 of a record of `native_records.ARRAY`."""
    return carray(f64_pointer(memory.address), (memory.size,))


@overload(table)
def _table(numbers):
    """Let a law that Python and compiled code share read the numbers of a block."""
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
    """Return compiled code: address, distance from it in numbers, count -> array of records of float64."""
    pointer = pointer_to(from_dtype(kind))

    @inlined
    def records(address, distance, count):
        return carray(pointer(address + 8 * int(distance)), (int(count),))

    return records


_IGNORED: Final = types.none
"""Type of a field that holds no number: native code ignores its value."""
_TYPES: Final = {0: _IGNORED, 1: types.float64}


def native_type(message: type[Any]) -> types.Tuple:
    """The type by which compiled code takes a message from Python.

    Every number is converted to float64. Check class and length of a message first: one that is too short ends the
    process.
    """
    widths = widths_of(message)
    return types.Tuple([_TYPES.get(width) or types.UniTuple(types.float64, width) for width in widths])


def zeros_of(message: type[Any]) -> tuple[Any, ...]:
    """Return a message of zeros of the type by which compiled code takes it, None for fields that hold no number."""
    return tuple(None if width == 0 else 0.0 if width == 1 else (0.0,) * width for width in widths_of(message))


def _places(kind: Any) -> list[tuple[int, ...]]:
    """Indices of the numbers of a tuple and of the tuples within it, one after the other."""
    places: list[tuple[int, ...]] = []
    for index, part in enumerate(kind):
        if isinstance(part, types.BaseTuple):
            places += [(index, *inner) for inner in _places(part)]
        elif part != _IGNORED:
            places.append((index,))
    return places


def _numbers_at(builder: ir.IRBuilder, address: Any) -> Callable[[int], Any]:
    """Pointer to a float64 by its place behind an address."""
    start = builder.inttoptr(address, ir.DoubleType().as_pointer())
    return lambda place: builder.gep(start, [ir.Constant(ir.IntType(64), place)])


def _store(_typing_context, address, message):
    def generate(context, builder, _signature, arguments):
        pointer = _numbers_at(builder, arguments[0])
        for place, path in enumerate(_places(message)):
            builder.store(builder.extract_value(arguments[1], path), pointer(place))
        return context.get_dummy_value()

    return types.void(address, message), generate


def _load(_typing_context, address, like):
    def generate(_context, builder, _signature, arguments):
        pointer, message = _numbers_at(builder, arguments[0]), arguments[1]
        for place, path in enumerate(_places(like)):
            message = builder.insert_value(message, builder.load(pointer(place)), path)
        return message

    return like(address, like), generate


store_numbers: Final[Any] = intrinsic(_store)
"""`store_numbers(address, message)` in compiled code: write the numbers of a tuple as consecutive float64."""
load_numbers: Final[Any] = intrinsic(_load)
"""`load_numbers(address, like)` in compiled code: read a tuple of the type of another one from consecutive float64."""

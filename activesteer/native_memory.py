"""Access to memory from compiled code: addresses become numba pointers and arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, from_dtype, types
from numba.extending import intrinsic, overload

from activesteer.compilation import inlined
from activesteer.native_blocks import table


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
    """Return the array of float64 of a record of `native_blocks.ARRAY`."""
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

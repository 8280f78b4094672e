"""Messages in native code: the types of their fields, and their numbers in consecutive memory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from activesteer.signals import widths_of

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

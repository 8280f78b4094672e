"""Records of numbers, and blocks of parameters for compiled code.

The law of such a block is a function whose first argument is the block (`compilation.shared`). Python passes the
object, compiled code passes its record. There is one law, and both results are bit-identical.
"""

from __future__ import annotations

import functools
from array import array
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, ClassVar, Final, NoReturn, get_origin, get_type_hints

import numpy as np

from activesteer.core.signals import PerWheel
from activesteer.errors import ParameterError

if TYPE_CHECKING:
    Table = array[float]
else:
    Table = array  # which takes no type before Python 3.12


def numbers_type(*fields: str | tuple[str, int], words: Iterable[str] = ()) -> np.dtype[Any]:
    """Return a record type of numbers, or of arrays where a length is given."""
    rows = [(field, np.float64) if isinstance(field, str) else (field[0], np.float64, (field[1],)) for field in fields]
    return np.dtype((np.record, [*((name, np.intp) for name in words), *rows]))


ARRAY: Final = np.dtype((np.record, [("address", np.intp), ("size", np.intp)]))
"""Memory of an array that belongs to the object."""
_NUMBERS: Final = {float: np.dtype(np.float64), int: np.dtype(np.intp), bool: np.dtype(np.intp)}


class NativeBlock:
    """Base of a block with a record of all attributes that the class annotates.

    An annotation is `float`, `int`, `bool`, `PerWheel`, another such block, an array of float64 or records, or
    `Table`, whose numbers Python reads faster one by one; see `table`.
    """

    _written_step: ClassVar[Any] = None

    def __init_subclass__(cls, **given: Any) -> None:
        """Store the original method `step`."""
        super().__init_subclass__(**given)
        cls._written_step = getattr(cls, "step", None)

    @property
    def is_watched(self) -> bool:
        """True if the method `step` is replaced, for example to watch it."""
        kind: Any = type(self)
        return "step" in vars(self) or kind.step is not kind._written_step


def table(numbers: Table) -> Table:
    """Return the record of a block, whose memory compiled code reads."""
    return numbers


@functools.cache
def _members(kind: type[NativeBlock]) -> dict[str, Any]:
    return {name: hint for name, hint in get_type_hints(kind).items() if get_origin(hint) is not ClassVar}


@functools.cache
def record_type(kind: type[NativeBlock]) -> np.dtype[Any]:
    """Return the type of a block's record."""
    fields: list[tuple[Any, ...]] = []
    for name, hint in _members(kind).items():
        if hint in _NUMBERS:
            fields.append((name, _NUMBERS[hint]))
        elif hint == PerWheel:
            fields.append((name, np.float64, (4,)))
        else:
            # An annotated array is another kind of object in each version of numpy, a block always a class.
            is_block = isinstance(hint, type) and issubclass(hint, NativeBlock)
            fields.append((name, record_type(hint) if is_block else ARRAY))
    return np.dtype((np.record, fields))


def values(block: NativeBlock) -> tuple[Any, ...]:
    """Return the attributes of a block in the form of its record."""
    found: list[Any] = []
    for name in _members(type(block)):
        value = getattr(block, name)
        if isinstance(value, NativeBlock):
            value = values(value)
        elif isinstance(value, np.ndarray):
            assert value.flags.c_contiguous
            assert value.dtype.names or value.dtype == np.float64
            value = value.ctypes.data, value.size
        elif isinstance(value, array):
            value = value.buffer_info()
        found.append(value)
    return tuple(found)


def take(block: NativeBlock, record: tuple[Any, ...]) -> None:
    """Set the attributes of a block from its record (see `values`)."""
    for (name, hint), value in zip(_members(type(block)).items(), record, strict=True):
        if hint in _NUMBERS:
            setattr(block, name, hint(value))
        elif isinstance(part := getattr(block, name), NativeBlock):
            take(part, value)


class Uncopyable:
    """Base of objects that can be neither copied nor pickled."""

    def _refuse(self, *_: Any) -> NoReturn:
        raise ParameterError(
            f"a {type(self).__name__} holds native memory and cannot be copied or pickled; copy the Simulation "
            "(Simulation.copy, copy.deepcopy, pickle)"
        )

    __copy__ = __deepcopy__ = __reduce_ex__ = _refuse

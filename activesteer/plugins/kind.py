"""Kind of a block (controller or driver): its names, its command, and the check of the command."""

from __future__ import annotations

import dataclasses
import difflib
import os
import sysconfig
import traceback
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.config import Range
from activesteer.core.conventions import Array
from activesteer.core.signals import numbers_of, widths_of
from activesteer.errors import ActiveSteerError, nearest_names, shown

_USUAL: Final = frozenset({float, bool, np.float64})
"""Types of nearly all numbers in a command. Numbers of other types take the slow check."""
_LIMITED: Final = _USUAL | {int}
"""Types of nearly all numbers with a range, which keeps a whole number within the range of float64."""
_LIBRARIES: Final = tuple({sysconfig.get_path(name) for name in ("stdlib", "platlib", "purelib")})
"""Folders of code that no user wrote."""
_OURS: Final = "activesteer."
"""Start of the names of our modules."""


@dataclass(frozen=True)
class Kind:
    """A kind of block that users can replace with their own."""

    word: str  # name of the kind, such as `controller`
    table: str  # table of the keys of its parameters, such as `controllers`
    example: str  # form of a block in a file, such as `my_file.py:MyController`
    inputs: str  # arguments of the method `step`, as text
    built_in: Mapping[str, Any]  # name -> class of the blocks in the package
    result: type[Any]  # message that `step` returns
    ranges: Mapping[str, Range]  # field of the result -> its range
    error: type[ActiveSteerError]  # error class of this kind
    unchecked: tuple[str, ...] = ()  # fields of the result that are not plain numbers
    # function that returns the names of the blocks that are data files of the package
    data: Callable[[], list[str]] = list
    reserved: tuple[str, ...] = ()  # keys of the table that no block of a user may have as its name
    filled: tuple[str, ...] = ()  # fields of the result that `completed` fills in
    _places: tuple[tuple[int, float, float], ...] = field(init=False)
    _unlimited: Callable[[Any], tuple[Any, ...]] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        """Look up the indices of the fields, because every step checks them."""
        fields = self.result._fields
        object.__setattr__(self, "_places", tuple((fields.index(key), *limits) for key, limits in self.ranges.items()))
        unlimited = (i for i, key in enumerate(fields) if key not in self.unchecked and key not in self.ranges)
        object.__setattr__(self, "_unlimited", itemgetter(*unlimited))

    def names(self) -> list[str]:
        """Names of all blocks in the package."""
        return [*self.built_in, *self.data()]

    def is_data(self, given: Any) -> bool:
        """Return whether a block is given as data: by name or path of a data file."""
        return isinstance(given, (str, os.PathLike)) and (os.fspath(given).endswith(".toml") or given in self.data())

    def fail(self, name: str, problem: str, value: Any = None, allowed: Any = None) -> ActiveSteerError:
        """Return an error about the user's block."""
        return self.error(problem, key=f"{self.word} {name}".rstrip(), value=value, allowed=allowed)

    def checked(self, command: Any, name: str, setup: Any, said: str = "step returned") -> Any:
        """Check and complete a command."""
        try:
            if not self._is_usual(command):
                command = self._check(command, name, said)
            return self.completed(command, name, setup, said)
        except (ArithmeticError, TypeError, ValueError) as reason:  # such as a whole number beyond all floats
            raise self.fail(name, f"{said} {shown(command)}; {in_one_line(reason)}", command) from reason

    def completed(self, command: Any, name: str, setup: Any, said: str) -> Any:
        """Check and complete the fields other than plain numbers (see `checked`)."""
        return command

    def _is_usual(self, command: Any) -> bool:
        if (
            command.__class__ is not self.result
            or len(command) != len(self.result._fields)
            or not _USUAL.issuperset(map(type, self._unlimited(command)))
        ):
            return False
        for index, low, high in self._places:
            value = command[index]
            if value.__class__ not in _LIMITED or not low <= value <= high:
                return False
        return True

    def _check(self, command: Any, name: str, said: str) -> Any:
        if not isinstance(command, self.result) or len(command) != len(self.result._fields):
            needed = f"a complete activesteer.{self.result.__name__} is needed"
            raise self.fail(name, f"{said} {shown(command)}; {needed}", command, self.result)
        for key, value in zip(self.result._fields, command, strict=True):
            limits = self.ranges.get(key)
            if key in self.unchecked:
                continue
            if not isinstance(value, (float, int, np.number, np.bool_)):
                needed = "a number is needed"
            elif limits is None:
                float(value)  # a whole number may be too large
                continue
            elif limits.low <= value <= limits.high:
                continue
            elif key.endswith("_rad"):
                needed = (
                    f"a finite angle of at most {limits.high:g} rad to either side is needed (radians, not degrees)"
                )
            else:
                needed = f"a number from {limits.low:g} to {limits.high:g} is needed"
            raise self.fail(name, f"{said} {key} = {shown(value)}; {needed}", value, limits)
        return self.result(*command)

    def rows(self, message: Any, n: int) -> Array:
        """Check a command for many cars, with numbers or arrays as fields, and return its numbers by car."""
        if not isinstance(message, self.result):
            problem = f"is {shown(message)}; an activesteer.{self.result.__name__} of arrays is needed"
            raise self.fail("", problem, message)
        rows, place = np.zeros((n, len(numbers_of(self.result)))), 0
        for name, width, value in zip(message._fields, widths_of(self.result), message, strict=True):
            given = rows[:, place : place + width]
            place += width
            if width:
                self._fill(given, name, value)
            elif value is not None:
                raise self.fail("", f"{name} is not allowed for a batch; leave it out", value)
        return rows

    def _fill(self, rows: Array, name: str, value: Any) -> None:
        """Check a field of a command for many cars, and store its numbers."""
        n, width = rows.shape
        if value is self.result._field_defaults.get(name) and not value:
            return
        if np.iscomplexobj(value):
            raise self.fail("", f"{name} is {shown(value)}; real numbers are needed")
        try:
            rows[:] = np.reshape(value, (-1, width)) if np.ndim(value) else value
        except (TypeError, ValueError, OverflowError) as reason:
            shape = f"({n},)" if width == 1 else f"({n}, {width})"
            problem = f"{name} is {shown(value)}; a number, or an array of shape {shape}, is needed"
            raise self.fail("", problem) from reason
        low, high = self.ranges.get(name, Range())
        wrong = ~((rows >= low) & (rows <= high)).all(axis=1)
        if name not in self.filled and wrong.any():
            car = int(np.argmax(wrong))
            problem = f"{name} of car {car} is {shown(rows[car].tolist())}; {low:g} to {high:g} is allowed"
            raise self.fail("", problem)


def in_one_line(error: BaseException, files: Collection[str] = ()) -> str:
    """Describe an error of foreign code in one line, with its last place in the user's files or outside libraries."""
    if isinstance(error, SyntaxError) and error.filename:  # its text names the file and the line
        return _words(error)
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if Path(frame.filename).name in files]
    outside = [frame for frame in frames if not frame.filename.startswith(_LIBRARIES)]
    last = (own or outside or frames)[-1:]
    places = [f" ({Path(frame.filename).name}, line {frame.lineno})" for frame in last]
    words = _words(error)
    if isinstance(error, AttributeError) and error.name and type(error.obj).__module__.startswith(_OURS):
        words += f"; {_nearest_attributes(error.obj, error.name)}"
    return words + "".join(places)


def _words(error: BaseException) -> str:
    """Return class and message of an error of foreign code, even if creating the message fails."""
    name = type(error).__name__
    try:
        return f"{name}: {error}".removesuffix(": ")
    except KeyboardInterrupt:
        raise
    except BaseException as reason:
        return f"{name}, whose text raises {type(reason).__name__}"


def _nearest_attributes(given: Any, name: str) -> str:
    """Return a hint with the attributes closest to a wrong name, including the attributes of inner dataclasses."""
    known = _attributes(given)
    last = {path.rpartition(".")[2]: path for path in sorted(known, key=lambda path: -path.count("."))}
    close = difflib.get_close_matches(name, last, n=3, cutoff=0.6)
    return f"did you mean {' or '.join(last[match] for match in close)}?" if close else nearest_names(name, known)


def _attributes(given: Any) -> list[str]:
    """Return the public values of an object and, by dotted name, of its dataclasses."""
    names = [*getattr(given, "_fields", ()), *vars(type(given)), *getattr(given, "__dict__", ())]
    found = [name for name in dict.fromkeys(names) if name[0] != "_" and not callable(getattr(given, name, None))]
    for name in tuple(found):
        if dataclasses.is_dataclass(inner := getattr(given, name)):
            found += [f"{name}.{path}" for path in _attributes(inner)]
    return found

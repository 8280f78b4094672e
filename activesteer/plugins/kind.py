"""What all controllers, or all drivers, have in common: their names, what they return, and how that is checked."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.config import Range
from activesteer.errors import ActiveSteerError, shown

_USUAL: Final = frozenset({float, int, bool, np.float64})
"""Types of nearly all numbers in a command; others are looked at in full."""


@dataclass(frozen=True)
class Kind:
    """A kind of block that a user can replace by his own.

    Attributes:
        word: What it is called, as in `controller`.
        example: How one in a file is given, as in `my_file.py:MyController`.
        inputs: Arguments of its method `step`, as text.
        built_in: Name -> class of those that come with the package.
        result: Named tuple that `step` returns.
        ranges: Field of the result -> what it may be.
        error: Raised where something is wrong.
        unchecked: Fields of the result that are no plain numbers.
        data: Gives the names of those that come with it as data files.
    """

    word: str
    example: str
    inputs: str
    built_in: Mapping[str, Any]
    result: type[Any]
    ranges: Mapping[str, Range]
    error: type[ActiveSteerError]
    unchecked: tuple[str, ...] = ()
    data: Callable[[], list[str]] = list
    _places: tuple[tuple[int, float, float], ...] = field(init=False)
    _numbers: Callable[[Any], tuple[Any, ...]] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        """Looks up where the fields stand: they are checked in every step."""
        fields = self.result._fields
        object.__setattr__(self, "_places", tuple((fields.index(key), *limits) for key, limits in self.ranges.items()))
        numbers = (place for place, key in enumerate(fields) if key not in self.unchecked)
        object.__setattr__(self, "_numbers", itemgetter(*numbers))

    def names(self) -> list[str]:
        """Names of all that come with the package."""
        return [*self.built_in, *self.data()]

    def is_data(self, given: Any) -> bool:
        """Whether one is given as data: by the name of such a file, or by its path."""
        return isinstance(given, (str, os.PathLike)) and (os.fspath(given).endswith(".toml") or given in self.data())

    def fail(self, name: str, problem: str, value: Any = None, allowed: Any = None) -> ActiveSteerError:
        """The error that says what is wrong with a block.

        Args:
            name: How it is called.
            problem: What is wrong, and what to do.
            value: What was given or returned.
            allowed: What may be.
        """
        return self.error(problem, key=f"{self.word} {name}".rstrip(), value=value, allowed=allowed)

    def checked(self, command: Any, name: str, setup: Any, said: str = "step returned") -> Any:
        """A command as it may be carried out.

        Args:
            command: What `step` returned, or what was given in its place.
            name: Who returned it, for the message.
            setup: What the block was made from.
            said: What comes before the command in the message.

        Returns:
            The command.

        Raises:
            ActiveSteerError: of the type `error`: it is no command, a value is no number, or out of its range.
        """
        if not self._is_usual(command):
            self._check(command, name, said)
        return self.completed(command, name, setup, said)

    def completed(self, command: Any, name: str, setup: Any, said: str) -> Any:
        """A command whose plain numbers are in order, with all else checked and filled in; see `checked`."""
        return command

    def _is_usual(self, command: Any) -> bool:
        if command.__class__ is not self.result or not _USUAL.issuperset(map(type, self._numbers(command))):
            return False
        for index, low, high in self._places:  # noqa: SIM110 - a generator costs more than all else here
            if not low <= command[index] <= high:
                return False
        return True

    def _check(self, command: Any, name: str, said: str) -> None:
        if not isinstance(command, self.result):
            needed = f"an activesteer.{self.result.__name__} is needed"
            raise self.fail(name, f"{said} {shown(command)}; {needed}", command, self.result)
        for key, value in zip(self.result._fields, command, strict=True):
            limits = self.ranges.get(key)
            if key in self.unchecked:
                continue
            if not isinstance(value, (float, int, np.number, np.bool_)):
                needed = "a number is needed"
            elif limits is None or limits.low <= value <= limits.high:
                continue
            elif key.endswith("_rad"):
                needed = (
                    f"a finite angle of at most {limits.high:g} rad to either side is needed (radians, not degrees)"
                )
            else:
                needed = f"a number from {limits.low:g} to {limits.high:g} is needed"
            raise self.fail(name, f"{said} {key} = {shown(value)}; {needed}", value, limits)


def in_one_line(error: BaseException) -> str:
    """An error of somebody else's code in one line, with the place where it was raised."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {error}{place}"

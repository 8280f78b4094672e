"""Where a value stands, and within what it must lie: what an error message says of it."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from activesteer.errors import ActiveSteerError, ParameterError
from activesteer.files import MAX_NUMBER


class Range(NamedTuple):
    """Allowed range of a number, both ends included."""

    low: float = -MAX_NUMBER
    high: float = MAX_NUMBER

    def __str__(self) -> str:
        """As it is said in an error message; an end that was not given is not named, in whatever unit."""
        if self.high > 0.1 * MAX_NUMBER:
            return f"at least {self.low:g}"
        if self.low < -0.1 * MAX_NUMBER:
            return f"at most {self.high:g}"
        return f"{self.low:g} to {self.high:g}"


@dataclasses.dataclass(frozen=True)
class Source:
    """Where a table came from, for error messages.

    Attributes:
        name: File name, or what to call a table that has no file.
        text: The file's text, to find lines in.
        error: Class of the errors to raise.
        overridden: Dotted keys whose values came from overrides, not from here.
    """

    name: str
    text: str = ""
    error: type[ActiveSteerError] = ParameterError
    overridden: frozenset[str] = frozenset()

    def fail(self, path: Sequence[str], problem: str, value: object = None, allowed: Any = None) -> ActiveSteerError:
        """An error that says where and what.

        Args:
            path: Keys that lead to what is wrong.
            problem: What is wrong with it, in words.
            value: What was given.
            allowed: What may be given: a range, or names.

        Returns:
            The error, to be raised.
        """
        key = ".".join(path)
        overridden = any(key == other or key.startswith(other + ".") for other in self.overridden)
        # What stands in an inline table or a list has no line of its own.
        line = next((found for end in range(len(path), 0, -1) if (found := self._line_of(path[:end]))), None)
        return self.error(
            problem, file=self.name, line=line, key=key or None, value=value, allowed=allowed, overridden=overridden
        )

    def placed(self, path: Sequence[str], reason: ActiveSteerError) -> ActiveSteerError:
        """The same error with the place that a check, which knows no file, could not know.

        Args:
            path: Keys that lead to the table that was checked.
            reason: The error of the check; its key is one inside that table.

        Returns:
            The error, to be raised.
        """
        inner = reason.key.split(".") if reason.key else ()
        return self.fail((*path, *inner), reason.problem, reason.value, reason.allowed)

    def _line_of(self, path: Sequence[str]) -> int | None:
        """Line of a key, found in the text: tomllib does not keep it."""
        wanted = ".".join(path)
        table = ""
        elements: dict[str, int] = {}
        for number, line in enumerate(self.text.splitlines(), 1):
            if header := re.fullmatch(r"\s*\[([^\[\]]+)\]\s*(#.*)?", line):
                found = table = _numbered(header.group(1), elements)
            elif header := re.fullmatch(r"\s*\[\[([^\[\]]+)\]\]\s*(#.*)?", line):
                *above, last = header.group(1).strip().split(".")
                name = ".".join((_numbered(".".join(above), elements), last)) if above else last
                elements[name] = elements.get(name, -1) + 1
                found = table = f"{name}.{elements[name]}"
            elif pair := re.match(r"""\s*["']?([\w.-]+)["']?\s*=""", line):
                found = f"{table}.{pair.group(1)}" if table else pair.group(1)
            else:
                continue
            if found == wanted:
                return number
        return None


def _numbered(name: str, elements: Mapping[str, int]) -> str:
    """A dotted key with the number of the present element behind the name of every list."""
    key = ""
    for part in name.strip().split("."):
        key = f"{key}.{part}" if key else part
        if key in elements:
            key += f".{elements[key]}"
    return key

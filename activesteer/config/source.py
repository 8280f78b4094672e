"""Place and range of a value, for error messages."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from activesteer.errors import ActiveSteerError, ParameterError
from activesteer.limits import MAX_NUMBER


class Range(NamedTuple):
    """Allowed range of a number, including both ends."""

    low: float = -MAX_NUMBER
    high: float = MAX_NUMBER

    def __str__(self) -> str:
        """Describe the range for an error message, without an end that is not set."""
        if self.high > 0.1 * MAX_NUMBER:
            return f"at least {self.low:g}"
        if self.low < -0.1 * MAX_NUMBER:
            return f"at most {self.high:g}"
        return f"{self.low:g} to {self.high:g}"


@dataclasses.dataclass(frozen=True)
class Source:
    """Origin of a table, for error messages.

    Attributes:
        name: Name of the file, or of a table without a file.
        text: Text of the file, to find lines in.
        error: Class of the errors.
        overridden: Dotted keys whose values came from overrides.
    """

    name: str
    text: str = ""
    error: type[ActiveSteerError] = ParameterError
    overridden: frozenset[str] = frozenset()

    def fail(self, path: Sequence[str], problem: str, value: object = None, allowed: Any = None) -> ActiveSteerError:
        """Return an error with file, line and key."""
        key = ".".join(path)
        overridden = any(key == other or key.startswith(other + ".") for other in self.overridden)
        # A key in an inline table or a list has no line of its own.
        line = next((found for end in range(len(path), 0, -1) if (found := self._line_of(path[:end]))), None)
        return self.error(
            problem, file=self.name, line=line, key=key or None, value=value, allowed=allowed, overridden=overridden
        )

    def placed(self, path: Sequence[str], reason: ActiveSteerError) -> ActiveSteerError:
        """Return the error of a check with the place in the file, which the check does not know."""
        inner = reason.key.split(".") if reason.key else ()
        return self.fail((*path, *inner), reason.problem, reason.value, reason.allowed)

    def _line_of(self, path: Sequence[str]) -> int | None:
        """Return the line of a key in the text; tomllib does not keep it."""
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
    """Return a dotted key with the number of the current element behind the name of every list."""
    key = ""
    for part in name.strip().split("."):
        key = f"{key}.{part}" if key else part
        if key in elements:
            key += f".{elements[key]}"
    return key

"""TOML files and tables, and places in them for error messages."""

from __future__ import annotations

import dataclasses
import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer import limits
from activesteer.errors import ActiveSteerError, ParameterError, shown
from activesteer.files import read_text
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
        """Return the line of a key in the text. Tomllib does not keep it."""
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


_DEEP_KEY: Final = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]++\s*+\.\s*+){{{limits.MAX_TOML_DEPTH}}}""")
"""Dotted key with too many parts. The time of tomllib grows with the square of their number."""


def read_toml(path: Path, error: type[ActiveSteerError] = ParameterError) -> tuple[dict[str, Any], Source]:
    """Return the table of a TOML file, and its source."""
    text = read_text(path, error)
    try:
        return _parsed(text), Source(path.name, text, error)
    except ValueError as reason:
        raise error(f"no valid TOML: {reason}", file=path.name) from reason


def _parsed(text: str) -> dict[str, Any]:
    """Parse a TOML text."""
    if _DEEP_KEY.search(text):
        raise ValueError(f"a key is nested more than {limits.MAX_TOML_DEPTH} deep")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("lists or tables are nested too deeply") from None


def parse_value(text: str) -> Any:
    """Return a value written as in TOML. Any other text is returned as it is."""
    try:
        table = _parsed(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    except ValueError as reason:
        raise ParameterError(f"{shown(text)}: {reason}", value=text) from reason
    return table["value"] if len(table) == 1 else text


def toml_value(value: Any) -> str:
    """Return a value as TOML. Texts, numbers and lists of JSON are valid TOML."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def toml_text(table: Mapping[str, Any], remarks: Mapping[str, str] | None = None) -> str:
    """Return a table as the text of a file, each inner table below its header; `read_toml` restores it.

    A list of tables is written in one line. Remarks are comments above the header of a table, by its dotted name.
    """
    return "\n".join(_lines(table, remarks or {}, "")).lstrip("\n") + "\n"


def _lines(table: Mapping[str, Any], remarks: Mapping[str, str], name: str) -> Iterator[str]:
    values = {key: value for key, value in table.items() if not isinstance(value, Mapping)}
    if name and (values or not table or name in remarks):
        yield from ("", *(f"# {line}" for line in remarks.get(name, "").splitlines()), f"[{name}]")
    yield from (f"{key} = {toml_value(value)}" for key, value in values.items())
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _lines(value, remarks, f"{name}.{key}" if name else key)

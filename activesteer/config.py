"""TOML tables into frozen dataclasses: every key known, every value of the right type and within its range.

A field's type is its check: `float`, `int`, `bool`, `str`, tuples of floats, a nested dataclass, a dict or a tuple of
nested dataclasses, or one of these `| None`. An element of a tuple has its number for a key: `road.patches.0.mu` is the
`mu` of the first [[road.patches]]. A range is written `Annotated[float, Range(low, high)]`. Inside, everything is SI
and radians; in a file a key may carry an edge unit instead: `speed_kmh` fills `speed_mps`, `angle_deg` fills
`angle_rad`.
"""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

from activesteer.errors import ActiveSteerError, ParameterError, nearest_names

T = TypeVar("T")

_EDGE_UNITS: Final = {
    "_deg": ("_rad", math.pi / 180.0),
    "_degps": ("_radps", math.pi / 180.0),
    "_kmh": ("_mps", 1.0 / 3.6),
    "_g": ("_mps2", 9.81),
}
"""Suffix of a key in a file -> suffix of the field it fills, and the factor."""


class Range(NamedTuple):
    """Allowed range of a number, both ends included."""

    low: float = -math.inf
    high: float = math.inf

    def __str__(self) -> str:
        """As it is said in an error message."""
        if math.isinf(self.high):
            return f"at least {self.low:g}"
        if math.isinf(self.low):
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

    def fail(self, path: Sequence[str], problem: str) -> ActiveSteerError:
        """An error that says where and what."""
        key = ".".join(path)
        if any(key == other or key.startswith(other + ".") for other in self.overridden):
            return self.error(f"override {key}: {problem}")
        # What stands in an inline table or a list has no line of its own.
        line = next((found for end in range(len(path), 0, -1) if (found := self._line_of(path[:end]))), None)
        where = f"{self.name}, line {line}" if line else self.name
        return self.error(f"{where}: {key}: {problem}" if key else f"{where}: {problem}")

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
            elif pair := re.match(r"\s*([\w.-]+)\s*=", line):
                found = f"{table}.{pair.group(1)}" if table else pair.group(1)
            else:
                continue
            if found == wanted:
                return number
        return None


def read_toml(path: Path, error: type[ActiveSteerError] = ParameterError) -> tuple[dict[str, Any], Source]:
    """Reads a TOML file.

    Args:
        path: The file.
        error: Class of the error to raise.

    Returns:
        The table and its source.

    Raises:
        ActiveSteerError: the file cannot be read or is no TOML; of class `error`.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as reason:
        msg = f"cannot read {path}: {reason}"
        raise error(msg) from reason
    try:
        return tomllib.loads(text), Source(path.name, text, error)
    except tomllib.TOMLDecodeError as reason:
        msg = f"{path}: no valid TOML: {reason}"
        raise error(msg) from reason


def build(cls: type[T], table: Mapping[str, Any], source: Source, path: Sequence[str] = ()) -> T:
    """Makes a dataclass from a table.

    Args:
        cls: Dataclass to make.
        table: Keys and values; edge units are converted.
        source: For error messages.
        path: Keys that lead to this table.

    Returns:
        The dataclass.

    Raises:
        ActiveSteerError: a key is unknown, missing or given twice, or a value is wrong.
    """
    hints = typing.get_type_hints(cls, include_extras=True)
    fields = {field.name: field for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for key, raw in table.items():
        name, factor = _field_of(key, fields)
        where = (*path, key)
        if name is None:
            raise source.fail(where, f"there is no such key; {nearest_names(key, _names_in_file(fields))}")
        if name in values:
            first = next(other for other in table if _field_of(other, fields)[0] == name)
            raise source.fail(where, f"{first} and {key} are the same in two units; give one of them")
        values[name] = _convert(hints[name], raw, factor, source, where)
    for name, field in fields.items():
        if name in values or field.default is not dataclasses.MISSING:
            continue
        if field.default_factory is not dataclasses.MISSING:
            continue
        raise source.fail(path, f"the key {' or '.join(_spellings(name))} is missing")
    try:
        return cls(**values)
    except ActiveSteerError as reason:  # from the class's own checks, which know no file
        raise source.fail(path, str(reason)) from reason


def merged(cls: type, table: Mapping[str, Any], path: Sequence[str], value: object, source: Source) -> dict[str, Any]:
    """The table with one key replaced, whatever unit it is written in.

    Args:
        cls: Dataclass that the table will become.
        table: The table.
        path: Keys that lead to the one to replace.
        value: What to put there.
        source: For error messages.

    Returns:
        A new table.

    Raises:
        ActiveSteerError: there is no such key.
    """
    hints = typing.get_type_hints(cls)
    fields = {field.name: field for field in dataclasses.fields(cls)}
    key, rest = path[0], path[1:]
    name, _ = _field_of(key, fields)
    if name is None:
        raise source.fail((key,), f"there is no such key; {nearest_names(key, _names_in_file(fields))}")
    result = dict(table)
    if not rest:
        for present in table:
            if _field_of(present, fields)[0] == name:
                del result[present]
        result[key] = value
        return result
    inner = _dataclass_in(hints[name])
    if inner is None and (element := _element_of(hints[name])) is not None:
        elements = list(result.get(key, ()))
        number = int(rest[0]) if rest[0].isdecimal() else len(elements)
        if number >= len(elements):
            numbers = f"0 to {len(elements) - 1}" if elements else "none: the list is empty"
            raise source.fail(path, f"there is no element {rest[0]!r} of {key}; there are {numbers}")
        elements[number] = merged(element, elements[number], rest[1:], value, source) if rest[1:] else value
        result[key] = elements
        return result
    if inner is None and typing.get_origin(hints[name]) is dict:
        inner = typing.get_args(hints[name])[1]
        branch = dict(result.get(key, {}))
        if rest[0] not in branch or len(rest) == 1:
            raise source.fail(path, f"there is no such key; {nearest_names(rest[0], branch)}")
        branch[rest[0]] = merged(inner, branch[rest[0]], rest[1:], value, source)
        result[key] = branch
        return result
    if inner is None:
        raise source.fail(path, f"{key} is a value, not a table")
    result[key] = merged(inner, result.get(key, {}), rest, value, source)
    return result


def key_paths(cls: type, prefix: str = "") -> list[str]:
    """All dotted keys that a table for `cls` may have, for messages about keys that do not exist."""
    paths: list[str] = []
    hints = typing.get_type_hints(cls)
    for field in dataclasses.fields(cls):
        inner = _dataclass_in(hints[field.name])
        if inner is not None:
            paths += key_paths(inner, f"{prefix}{field.name}.")
        else:
            paths += [prefix + spelling for spelling in _spellings(field.name)]
    return paths


def to_table(value: Any) -> Any:
    """A dataclass as plain tables, ready for JSON; fields that are None are left out, so that `build` takes it back."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: to_table(getattr(value, field.name))
            for field in dataclasses.fields(value)
            if getattr(value, field.name) is not None
        }
    if isinstance(value, dict):
        return {key: to_table(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_table(item) for item in value]
    return value


def _spellings(name: str) -> list[str]:
    edges = [name[: -len(si)] + edge for edge, (si, _) in _EDGE_UNITS.items() if name.endswith(si)]
    return [name, *edges]


def _names_in_file(fields: Mapping[str, Any]) -> list[str]:
    return [spelling for name in fields for spelling in _spellings(name)]


def _field_of(key: str, fields: Mapping[str, Any]) -> tuple[str | None, float]:
    if key in fields:
        return key, 1.0
    for edge, (si, factor) in _EDGE_UNITS.items():
        if key.endswith(edge) and key[: -len(edge)] + si in fields:
            return key[: -len(edge)] + si, factor
    return None, 1.0


def _numbered(name: str, elements: Mapping[str, int]) -> str:
    """A dotted key with the number of the present element behind the name of every list."""
    key = ""
    for part in name.strip().split("."):
        key = f"{key}.{part}" if key else part
        if key in elements:
            key += f".{elements[key]}"
    return key


def _dataclass_in(hint: Any) -> type | None:
    for candidate in (hint, *typing.get_args(hint)):
        if isinstance(candidate, type) and dataclasses.is_dataclass(candidate):
            return candidate if typing.get_origin(hint) not in (dict, tuple) else None
    return None


def _element_of(hint: Any) -> type | None:
    """The dataclass that the elements of a tuple are made of, or None."""
    item = typing.get_args(hint)[0] if typing.get_origin(hint) is tuple else None
    return item if isinstance(item, type) and dataclasses.is_dataclass(item) else None


def _convert(hint: Any, raw: Any, factor: float, source: Source, path: Sequence[str]) -> Any:
    """One value, checked against its type hint."""
    limits = None
    if typing.get_origin(hint) is typing.Annotated:
        hint, *notes = typing.get_args(hint)
        limits = next((note for note in notes if isinstance(note, Range)), None)
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        if raw is None:
            return None
        hint = next(option for option in typing.get_args(hint) if option is not type(None))
        return _convert(hint if limits is None else typing.Annotated[hint, limits], raw, factor, source, path)
    origin = typing.get_origin(hint)
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        if not isinstance(raw, Mapping):
            raise source.fail(path, f"{raw!r} is no table; a table [{'.'.join(path)}] is needed")
        return build(hint, raw, source, path)
    if origin is dict:
        if not isinstance(raw, Mapping):
            raise source.fail(path, f"{raw!r} is no table")
        item = typing.get_args(hint)[1]
        return {key: _convert(item, value, 1.0, source, (*path, key)) for key, value in raw.items()}
    if origin is tuple:
        return _elements(hint, raw, factor, limits, source, path)
    return _scalar(hint, raw, factor, limits, source, path)


def _elements(
    hint: Any, raw: Any, factor: float, limits: Range | None, source: Source, path: Sequence[str]
) -> tuple[Any, ...]:
    """A list of numbers, or of tables."""
    element = _element_of(hint)
    if not isinstance(raw, (list, tuple)):
        wanted = "no list of numbers" if element is None else f"no list; tables [[{'.'.join(path)}]] are needed"
        raise source.fail(path, f"{raw!r} is {wanted}")
    if element is not None:
        return tuple(_convert(element, value, 1.0, source, (*path, str(number))) for number, value in enumerate(raw))
    item = typing.get_args(hint)[0]
    if limits is not None:
        item = typing.Annotated[item, limits]
    return tuple(_convert(item, value, factor, source, path) for value in raw)


def _scalar(hint: Any, raw: Any, factor: float, limits: Range | None, source: Source, path: Sequence[str]) -> Any:
    wanted = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}[hint]
    good = isinstance(raw, hint) or (hint is float and isinstance(raw, int))
    if not good or (isinstance(raw, bool) and hint is not bool):
        raise source.fail(path, f"{raw!r} is not {wanted}")
    if hint in (bool, str):
        return raw
    try:
        value = raw * factor if factor != 1.0 else hint(raw)
    except OverflowError:  # a whole number too large for a float
        value = math.inf
    if not math.isfinite(value):
        raise source.fail(path, f"{raw!r} is not finite")
    if limits is not None and not limits.low <= value <= limits.high:
        shown = Range(limits.low / factor, limits.high / factor)
        raise source.fail(path, f"{raw!r} is out of range; allowed is {shown}")
    return value

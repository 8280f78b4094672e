"""TOML tables into frozen dataclasses: every key known, every value of the right type and within its range.

A field's type is its check: `float`, `int`, `bool`, `str`, a `Literal` of some words, tuples of floats, a nested
dataclass, a dict or a tuple of nested dataclasses, or one of these `| None`. An element of a tuple has its number for a
key: `road.patches.0.mu` is the `mu` of the first [[road.patches]]. A range is written
`Annotated[float, Range(low, high)]`. Inside, everything is SI and radians; in a file a key may carry an edge unit
instead: `speed_kmh` fills `speed_mps`, `angle_deg` fills `angle_rad`.

A class may name, in `KEY_HINTS`, keys that people look for in vain, and what to say to them; and in `OVERRULED`, keys
that have no effect where other keys have certain values: key -> {other key: its value, None for any}.
"""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
import types
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

from activesteer.conventions import GRAVITY_MPS2
from activesteer.errors import ActiveSteerError, ParameterError, nearest_names, shown
from activesteer.files import read_text

T = TypeVar("T")

_EDGE_UNITS: Final = {
    "_deg": ("_rad", math.pi / 180.0),
    "_degps": ("_radps", math.pi / 180.0),
    "_kmh": ("_mps", 1.0 / 3.6),
    "_g": ("_mps2", GRAVITY_MPS2),
}
"""Suffix of a key in a file -> suffix of the field it fills, and the factor."""


_MAX_NUMBER: Final = 1e12
"""Beyond this no number of a file has a meaning, in whatever unit."""
_MAX_DEPTH: Final = 32
_DEEP_KEY: Final = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]++\s*+\.\s*+){{{_MAX_DEPTH}}}""")
"""A dotted key of more than so many parts; the time that tomllib takes grows with the square of their number."""
_MAX_TEXT: Final = 1000
"""Longest text [characters]."""


class Range(NamedTuple):
    """Allowed range of a number, both ends included."""

    low: float = -_MAX_NUMBER
    high: float = _MAX_NUMBER

    def __str__(self) -> str:
        """As it is said in an error message; an end that was not given is not named, in whatever unit."""
        if self.high > 0.1 * _MAX_NUMBER:
            return f"at least {self.low:g}"
        if self.low < -0.1 * _MAX_NUMBER:
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
    text = read_text(path, error)
    try:
        return _parsed(text), Source(path.name, text, error)
    except ValueError as reason:
        raise error(f"no valid TOML: {reason}", file=path.name) from reason


def _parsed(text: str) -> dict[str, Any]:
    """A TOML text's table.

    Raises:
        ValueError: it is no TOML, has a number of too many digits, or is nested too deeply.
    """
    if _DEEP_KEY.search(text):
        raise ValueError(f"a key is nested more than {_MAX_DEPTH} deep")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("lists or tables are nested too deeply") from None


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
    fields = _fields(cls)
    values: dict[str, Any] = {}
    for key, raw in table.items():
        where = (*path, str(key))
        name, factor = field_in_unit(key, fields)
        if name is None:
            raise _no_such_key(cls, source, where)
        if name in values:
            first = next(other for other in table if field_in_unit(other, fields)[0] == name)
            raise source.fail(where, f"{first} and {key} are the same in two units; give one of them")
        values[name] = _convert(hints[name], raw, factor, source, where)
    for name, field in fields.items():
        if name in values or field.default is not dataclasses.MISSING:
            continue
        if field.default_factory is not dataclasses.MISSING:
            continue
        raise source.fail((*path, name), f"the key {' or '.join(spellings(name))} is missing")
    try:
        return cls(**values)
    except ActiveSteerError as reason:  # from the class's own checks, which know no file
        raise source.placed(path, reason) from reason


def merged(
    cls: type, table: Mapping[str, Any], path: Sequence[str], value: object, source: Source, above: Sequence[str] = ()
) -> dict[str, Any]:
    """The table with one key replaced, whatever unit it is written in.

    Args:
        cls: Dataclass that the table will become.
        table: The table.
        path: Keys that lead to the one to replace.
        value: What to put there.
        source: For error messages.
        above: Keys that lead to the table.

    Returns:
        A new table.

    Raises:
        ActiveSteerError: there is no such key, or one above it is no table.
    """
    where = (*above, path[0])
    if not isinstance(table, Mapping):
        raise source.fail(above, f"is {shown(table)}, which is no table and has no {path[0]}", table)
    hints, fields = typing.get_type_hints(cls), _fields(cls)
    key, rest = path[0], path[1:]
    name, _ = field_in_unit(key, fields)
    if name is None:
        raise _no_such_key(cls, source, where)
    result = dict(table)
    if not rest:
        for present in table:
            if field_in_unit(present, fields)[0] == name:
                del result[present]
        result[key] = value
        return result
    hint = hints[name]
    if (inner := dataclass_in(hint)) is not None:
        result[key] = merged(inner, result.get(key, {}), rest, value, source, where)
    elif (element := element_of(hint)) is not None:
        result[key] = _merged_list(element, result.get(key, ()), rest, value, source, where)
    elif typing.get_origin(hint) is dict:
        item, branch = typing.get_args(hint)[1], result.get(key, {})
        if not isinstance(branch, Mapping):
            raise source.fail(where, f"is {shown(branch)}, which is no table", branch)
        if rest[0] not in branch or len(rest) == 1:
            problem = f"there is no such key; {nearest_names(rest[0], branch)}"
            raise source.fail((*where, *rest), problem, rest[0], sorted(branch))
        below = merged(item, branch[rest[0]], rest[1:], value, source, (*where, rest[0]))
        result[key] = {**branch, rest[0]: below}
    else:
        raise source.fail((*where, *rest), f"{key} is a value, not a table")
    return result


def _merged_list(
    element: type, given: Any, rest: Sequence[str], value: object, source: Source, where: Sequence[str]
) -> list[Any]:
    """A list of tables with one of them, or a key of it, replaced."""
    if not isinstance(given, (list, tuple)):
        raise source.fail(where, f"is {shown(given)}, which is no list", given)
    elements = list(given)
    numbers = [str(number) for number in range(len(elements))]
    if rest[0] not in numbers:
        known = f"0 to {len(elements) - 1}" if elements else "none: the list is empty"
        problem = f"there is no element {shown(rest[0])} of {where[-1]}; there are {known}"
        raise source.fail((*where, *rest), problem, rest[0], numbers)
    number = int(rest[0])
    below = (*where, rest[0])
    elements[number] = merged(element, elements[number], rest[1:], value, source, below) if rest[1:] else value
    return elements


def key_paths(cls: type, prefix: str = "") -> list[str]:
    """All dotted keys that a table for `cls` may have, for messages about keys that do not exist."""
    paths: list[str] = []
    hints = typing.get_type_hints(cls)
    for field in dataclasses.fields(cls):
        inner = dataclass_in(hints[field.name])
        if inner is not None:
            paths += key_paths(inner, f"{prefix}{field.name}.")
        else:
            paths += [prefix + spelling for spelling in spellings(field.name)]
    return paths


def field_path(cls: type, path: Sequence[str]) -> tuple[str, ...]:
    """Keys with the names of the fields in place of other units: `speed_kmh` becomes `speed_mps`."""
    if not path:
        return ()
    name, _ = field_in_unit(path[0], _fields(cls))
    if name is None:
        return tuple(path)
    hint, rest = typing.get_type_hints(cls)[name], path[1:]
    if (inner := dataclass_in(hint)) is not None:
        return (name, *field_path(inner, rest))
    if (inner := element_of(hint)) is not None and rest:
        return (name, rest[0], *field_path(inner, rest[1:]))
    return (name, *rest)


def check_overruled(cls: type, table: Mapping[str, Any], source: Source, given: Iterable[Sequence[str]]) -> None:
    """No key may be given that others make ineffective; see `OVERRULED`.

    Args:
        cls: Dataclass that the table will become.
        table: The table.
        source: For error messages.
        given: Keys that were given, each as the names that lead to it.

    Raises:
        ActiveSteerError: there is such a key; the message names both.
    """
    for path in given:
        owner, within = cls, table
        for key in path[:-1]:
            inner = dataclass_in(typing.get_type_hints(owner).get(key))
            if inner is None or not isinstance(within := within.get(key, {}), Mapping):
                break
            owner = inner
        else:
            fields = _fields(owner)
            values = {name: field.default for name, field in fields.items()}
            values |= {field_in_unit(key, fields)[0]: value for key, value in within.items()}
            rule = getattr(owner, "OVERRULED", {}).get(field_in_unit(path[-1], fields)[0])
            if rule and all(_holds(values[other], wanted) for other, wanted in rule.items()):
                by = " and ".join(f"{other} = {shown(values[other])}" for other in rule)
                raise source.fail(path, f"has no effect beside {by}; leave one out", within.get(path[-1]))


def _holds(value: object, wanted: object) -> bool:
    return value not in (None, dataclasses.MISSING) if wanted is None else value == wanted


def leaf_keys(table: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """The keys of all values of a table, each as the names that lead to it."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from ((str(key), *below) for below in leaf_keys(value))
        else:
            yield (str(key),)


def key_hint(cls: type, key: str) -> str | None:
    """What a class, or that of a table in it, says to those who look for a dotted key that it does not have."""
    first, _, rest = key.partition(".")
    inner = dataclass_in(typing.get_type_hints(cls).get(first)) if rest else None
    return getattr(cls, "KEY_HINTS", {}).get(key) if inner is None else key_hint(inner, rest)


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


def checked_number(key: str, value: object, limits: Range) -> float:
    """An argument of a Python function, checked as a number of a file is.

    Args:
        key: Name of the argument.
        value: What was given.
        limits: Allowed range.

    Returns:
        The number.

    Raises:
        ParameterError: it is no number, or out of range.
    """
    return _scalar(float, value, 1.0, limits, Source(""), (key,))


def parse_value(text: str) -> Any:
    """A value as TOML writes it; what is no TOML value is a text.

    Raises:
        ParameterError: it is nested too deeply, or has a number of too many digits.
    """
    try:
        table = _parsed(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    except ValueError as reason:
        raise ParameterError(f"{shown(text)}: {reason}", value=text) from reason
    return table["value"] if len(table) == 1 else text


def _no_such_key(cls: type, source: Source, path: Sequence[str]) -> ActiveSteerError:
    names = _names_in_file(_fields(cls))
    help_ = key_hint(cls, path[-1]) or nearest_names(path[-1], names)
    return source.fail(path, f"there is no such key; {help_}", allowed=names)


def _fields(cls: type) -> dict[str, dataclasses.Field[Any]]:
    return {field.name: field for field in dataclasses.fields(cls)}


def spellings(name: str) -> list[str]:
    """The keys that fill a field: its own name, and the one in a unit of the edge."""
    edges = [name[: -len(si)] + edge for edge, (si, _) in _EDGE_UNITS.items() if name.endswith(si)]
    return [name, *edges]


def _names_in_file(fields: Mapping[str, Any]) -> list[str]:
    return [spelling for name in fields for spelling in spellings(name)]


def field_in_unit(key: object, fields: Collection[str]) -> tuple[str | None, float]:
    """The field that a key of a file fills.

    Args:
        key: The key, perhaps in a unit of the edge.
        fields: Names of the fields, in SI.

    Returns:
        Name of the field, None where there is none, and the factor from the key's unit to SI.
    """
    if not isinstance(key, str):
        return None, 1.0
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


def dataclass_in(hint: Any) -> type | None:
    """The dataclass of a table that a field holds, also of one that may be left out; None for other fields."""
    for candidate in (hint, *typing.get_args(hint)):
        if isinstance(candidate, type) and dataclasses.is_dataclass(candidate):
            return candidate if typing.get_origin(hint) not in (dict, tuple) else None
    return None


def element_of(hint: Any) -> type | None:
    """The dataclass that the elements of a tuple are made of, or None."""
    item = typing.get_args(hint)[0] if typing.get_origin(hint) is tuple else None
    return item if isinstance(item, type) and dataclasses.is_dataclass(item) else None


def _convert(hint: Any, raw: Any, factor: float, source: Source, path: Sequence[str]) -> Any:
    """One value, checked against its type hint."""
    limits = Range()
    if typing.get_origin(hint) is typing.Annotated:
        hint, *notes = typing.get_args(hint)
        limits = next((note for note in notes if isinstance(note, Range)), limits)
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        if raw is None:
            return None
        hint = next(option for option in typing.get_args(hint) if option is not type(None))
        return _convert(typing.Annotated[hint, limits], raw, factor, source, path)
    origin = typing.get_origin(hint)
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        if not isinstance(raw, Mapping):
            raise source.fail(path, f"{shown(raw)} is no table; a table [{'.'.join(path)}] is needed", raw)
        return build(hint, raw, source, path)
    if origin is dict:
        if not isinstance(raw, Mapping):
            raise source.fail(path, f"{shown(raw)} is no table", raw)
        item = typing.get_args(hint)[1]
        return {key: _convert(item, value, 1.0, source, (*path, str(key))) for key, value in raw.items()}
    if origin is tuple:
        return _elements(hint, raw, factor, limits, source, path)
    return _scalar(hint, raw, factor, limits, source, path)


def _elements(
    hint: Any, raw: Any, factor: float, limits: Range, source: Source, path: Sequence[str]
) -> tuple[Any, ...]:
    """A list of numbers, or of tables."""
    element = element_of(hint)
    if not isinstance(raw, (list, tuple)):
        wanted = "no list of numbers" if element is None else f"no list; tables [[{'.'.join(path)}]] are needed"
        raise source.fail(path, f"{shown(raw)} is {wanted}", raw)
    if element is not None:
        return tuple(_convert(element, value, 1.0, source, (*path, str(number))) for number, value in enumerate(raw))
    item = typing.Annotated[typing.get_args(hint)[0], limits]
    return tuple(_convert(item, value, factor, source, path) for value in raw)


def _word(words: Sequence[str], raw: Any, source: Source, path: Sequence[str]) -> str:
    if raw not in list(words):
        known = ", ".join(repr(word) for word in words[:-1])
        raise source.fail(path, f"is {shown(raw)}; allowed are {known} and {words[-1]!r}", raw, words)
    return raw


def _scalar(hint: Any, raw: Any, factor: float, limits: Range, source: Source, path: Sequence[str]) -> Any:
    if typing.get_origin(hint) is typing.Literal:
        return _word(typing.get_args(hint), raw, source, path)
    wanted = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}[hint]
    good = isinstance(raw, hint) or (hint is float and isinstance(raw, int))
    if not good or (isinstance(raw, bool) and hint is not bool):
        raise source.fail(path, f"{shown(raw)} is not {wanted}", raw, hint)
    if isinstance(raw, str) and (len(raw) > _MAX_TEXT or not raw.isprintable()):
        raise source.fail(path, f"{shown(raw)} is not {_MAX_TEXT} characters, at most, that can be printed", raw)
    if hint in (bool, str):
        return raw
    number: Any = raw
    try:
        value = number * factor if factor != 1.0 else hint(number)
        finite = math.isfinite(value)
    except OverflowError:  # a whole number too large for a float
        value, finite = math.inf, False
    if not finite:
        raise source.fail(path, f"{shown(raw)} is not finite", raw, limits)
    if abs(value) > _MAX_NUMBER:
        problem = f"{shown(raw)} is larger than anything of a car; allowed is at most {_MAX_NUMBER:g}"
        raise source.fail(path, problem, raw, limits)
    if not limits.low <= value <= limits.high:
        allowed = Range(limits.low / factor, limits.high / factor)
        raise source.fail(path, f"{shown(raw)} is out of range; allowed is {allowed}", raw, allowed)
    return value

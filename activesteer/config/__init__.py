"""Conversion of TOML tables to frozen dataclasses, with checks of keys, types and ranges.

The type of a field defines its check: `float`, `int`, `bool`, `str`, a `Literal` of words, a tuple of floats, a nested
dataclass, a dict or a tuple of nested dataclasses, or one of these `| None`. An element of a tuple has its number as a
key: `road.patches.0.mu` is the `mu` of the first [[road.patches]]. A range is written
`Annotated[float, Range(low, high)]`. Values are SI and radians. A key in a file may have a display unit instead:
`speed_kmh` fills `speed_mps`, `angle_deg` fills `angle_rad`.

A class may define `KEY_HINTS`: keys that users expect but that do not exist -> help. It may define `OVERRULED`: keys
without effect while other keys have certain values: key -> {other key: its value, None for any}.

In: TOML files and tables.
Out: frozen dataclasses in SI units, or an error with file, key and line.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import json
import math
import re
import tomllib
import types
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

from activesteer.core import limits
from activesteer.core.files import is_file, read_text, user_path
from activesteer.core.limits import MAX_NUMBER, MAX_TOML_LETTERS
from activesteer.core.units import EDGE_UNITS
from activesteer.errors import ActiveSteerError, ParameterError, nearest_names, shown


class Range(NamedTuple):
    """Allowed range of a number, including both ends."""

    low: float = -MAX_NUMBER
    high: float = MAX_NUMBER

    def __str__(self) -> str:
        """Describe the range for an error message."""
        if self.high > 0.1 * MAX_NUMBER:
            return f"at least {self.low:g}"
        if self.low < -0.1 * MAX_NUMBER:
            return f"at most {self.high:g}"
        return f"{self.low:g} to {self.high:g}"


@dataclasses.dataclass(frozen=True)
class Source:
    """Origin of a table, for error messages."""

    name: str  # name of the file, or of a table without a file
    text: str = ""  # text of the file, to find lines in
    error: type[ActiveSteerError] = ParameterError  # class of the errors
    overridden: frozenset[str] = frozenset()  # dotted keys whose values came from overrides

    def fail(self, path: Sequence[str], problem: str, value: object = None, allowed: Any = None) -> ActiveSteerError:
        """Return an error with file, line and key."""
        key = ".".join(path)
        overridden = any(key == other or key.startswith(other + ".") for other in self.overridden)
        # A key in an inline table or a list has no line of its own.
        line = next((found for end in range(len(path), 0, -1) if (found := self.line_of(path[:end]))), None)
        return self.error(
            problem, file=self.name, line=line, key=key or None, value=value, allowed=allowed, overridden=overridden
        )

    def placed(self, path: Sequence[str], reason: ActiveSteerError) -> ActiveSteerError:
        """Add the place in the file to the error of a check, and return the error."""
        inner = reason.key.split(".") if reason.key else ()
        return self.fail((*path, *inner), reason.problem, reason.value, reason.allowed)

    def line_of(self, path: Sequence[str]) -> int | None:
        """Find the line of a key in the file. tomllib does not store it."""
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
    """Return a dotted key with the current index after the name of each list."""
    key = ""
    for part in name.strip().split("."):
        key = f"{key}.{part}" if key else part
        if key in elements:
            key += f".{elements[key]}"
    return key


def find_file(name: str, folders: Sequence[Path], pattern: str, source: Source, key: Sequence[str]) -> Path:
    """Find a file that a key names, by its path or in one of the folders; the error lists the last folder's files."""
    for candidate in (*(folder / name for folder in folders), user_path(name, source.error)):
        if name.isprintable() and is_file(candidate):
            return candidate
    folder = folders[-1] if folders else Path.cwd()
    present = [path.relative_to(folder).as_posix() for path in folder.glob(pattern)]
    problem = f"there is no file {shown(name)} in {shown(folder)}; {nearest_names(name, present)}"
    raise source.fail(key, problem, name, present)


_DEEP_KEY: Final = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]++\s*+\.\s*+){{{limits.MAX_TOML_DEPTH}}}""")
"""Dotted key with too many parts. The time of tomllib grows with the square of their number."""


def read_toml(path: Path, error: type[ActiveSteerError] = ParameterError) -> tuple[dict[str, Any], Source]:
    """Return the table of a TOML file, and its source."""
    text = read_text(path, error)
    try:
        return _parsed(text), Source(path.name, text, error)
    except ValueError as reason:
        raise error(f"invalid TOML: {reason}", file=path.name) from reason


def _parsed(text: str) -> dict[str, Any]:
    """Parse a TOML text, and limit the depth of its keys, lists and tables."""
    if _DEEP_KEY.search(text):
        raise ValueError(f"a key is nested more than {limits.MAX_TOML_DEPTH} deep")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("lists or tables are nested too deeply") from None


def parse_value(text: str) -> Any:
    """Parse a value as TOML, or return it unchanged if it is not valid TOML."""
    try:
        table = _parsed(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    except ValueError as reason:
        raise ParameterError(f"{shown(text)}: {reason}", value=text) from reason
    return table["value"] if len(table) == 1 else text


def toml_value(value: Any) -> str:
    """Return a value as a TOML string."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def toml_text(table: Mapping[str, Any], remarks: Mapping[str, str] | None = None) -> str:
    """Return a table as a TOML file for `read_toml`, with remarks above tables by their dotted names."""
    return "\n".join(_lines(table, remarks or {}, "")).lstrip("\n") + "\n"


def _lines(table: Mapping[str, Any], remarks: Mapping[str, str], name: str) -> Iterator[str]:
    values = {key: value for key, value in table.items() if not isinstance(value, Mapping)}
    if name and (values or not table or name in remarks):
        yield from ("", *(f"# {line}" for line in remarks.get(name, "").splitlines()), f"[{name}]")
    yield from (f"{key} = {toml_value(value)}" for key, value in values.items())
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _lines(value, remarks, f"{name}.{key}" if name else key)


def spellings(name: str) -> list[str]:
    """Return the keys that fill a field: its own name, and its name with a display unit."""
    name = name.removesuffix("_")
    edges = [name[: -len(si)] + edge for edge, (si, _) in EDGE_UNITS.items() if name.endswith(si)]
    return [name, *edges]


def field_in_unit(key: object, fields: Collection[str]) -> tuple[str | None, float]:
    """Return the field that a key of a file fills."""
    if not isinstance(key, str):
        return None, 1.0
    for name in (key, f"{key}_"):
        if name in fields:
            return name, 1.0
    for edge, (si, factor) in EDGE_UNITS.items():
        if key.endswith(edge) and key[: -len(edge)] + si in fields:
            return key[: -len(edge)] + si, factor
    return None, 1.0


@functools.cache
def hints_of(cls: type, *, include_extras: bool = False) -> dict[str, Any]:
    """Return the types of the fields of a dataclass. They are cached, because parsing them is slow."""
    return typing.get_type_hints(cls, include_extras=include_extras)


def fields_of(cls: type) -> dict[str, dataclasses.Field[Any]]:
    """Return the fields of a dataclass by name."""
    return {field.name: field for field in dataclasses.fields(cls)}


def dataclass_in(hint: Any) -> type | None:
    """Return the dataclass that a field holds, or None for other fields."""
    for candidate in (hint, *typing.get_args(hint)):
        if isinstance(candidate, type) and dataclasses.is_dataclass(candidate):
            return candidate if typing.get_origin(hint) not in (dict, tuple) else None
    return None


def element_of(hint: Any) -> type | None:
    """Return the dataclass of the elements of a tuple, or None."""
    item = typing.get_args(hint)[0] if typing.get_origin(hint) is tuple else None
    return item if isinstance(item, type) and dataclasses.is_dataclass(item) else None


@functools.cache
def key_paths(cls: type, prefix: str = "") -> tuple[str, ...]:
    """Return all dotted keys that a table for `cls` may have. They are cached, because each override needs them."""
    paths: list[str] = []
    hints = hints_of(cls)
    for field in dataclasses.fields(cls):
        inner = dataclass_in(hints[field.name])
        if inner is not None:
            paths += key_paths(inner, f"{prefix}{field.name}.")
        else:
            paths += [prefix + spelling for spelling in spellings(field.name)]
    return tuple(paths)


def field_path(cls: type, path: Sequence[str]) -> tuple[str, ...]:
    """Return keys with the names of the fields: `speed_kmh` becomes `speed_mps`."""
    if not path:
        return ()
    name, _ = field_in_unit(path[0], fields_of(cls))
    if name is None:
        return tuple(path)
    hint, rest = hints_of(cls)[name], path[1:]
    if (inner := dataclass_in(hint)) is not None:
        return (name, *field_path(inner, rest))
    if (inner := element_of(hint)) is not None and rest:
        return (name, rest[0], *field_path(inner, rest[1:]))
    return (name, *rest)


def leaves(table: Mapping[str, Any]) -> dict[tuple[str, ...], Any]:
    """Return all values of a table and its inner tables, by their paths."""
    found: dict[tuple[str, ...], Any] = {}
    for key, value in table.items():
        below = leaves(value) if isinstance(value, Mapping) else {(): value}
        found |= {(str(key), *path): leaf for path, leaf in below.items()}
    return found


def key_hint(cls: type, key: str) -> str | None:
    """Return the hint of a class for a dotted key that does not exist."""
    first, _, rest = key.partition(".")
    inner = dataclass_in(hints_of(cls).get(first)) if rest else None
    return getattr(cls, "KEY_HINTS", {}).get(key) if inner is None else key_hint(inner, rest)


def no_such_key(cls: type, source: Source, path: Sequence[str]) -> ActiveSteerError:
    """Return the error for a key that a class does not have (see `Source.fail`)."""
    names = [spelling for name in fields_of(cls) for spelling in spellings(name)]
    help_ = key_hint(cls, path[-1]) or nearest_names(path[-1], names)
    return source.fail(path, f"there is no such key; {help_}", allowed=names)


def merged(
    cls: type, table: Mapping[str, Any], path: Sequence[str], value: object, source: Source, above: Sequence[str] = ()
) -> dict[str, Any]:
    """Return a table with one key replaced, in any of its units."""
    where = (*above, path[0])
    if not isinstance(table, Mapping):
        raise source.fail(above, f"is {shown(table)}, which is not a table and has no {path[0]}", table)
    hints, fields = hints_of(cls), fields_of(cls)
    key, rest = path[0], path[1:]
    name, _ = field_in_unit(key, fields)
    if name is None:
        raise no_such_key(cls, source, where)
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
    else:
        raise source.fail((*where, *rest), f"{key} is a value, not a table")
    return result


def _merged_list(
    element: type, given: Any, rest: Sequence[str], value: object, source: Source, where: Sequence[str]
) -> list[Any]:
    """Return a list of tables with one table, or a key of it, replaced."""
    if not isinstance(given, (list, tuple)):
        raise source.fail(where, f"is {shown(given)}, which is not a list", given)
    elements = list(given)
    numbers = [str(number) for number in range(len(elements))]
    if rest[0] not in numbers:
        known = f"0 to {len(elements) - 1}" if elements else "none: the list is empty"
        raise source.fail(
            (*where, *rest), f"there is no element {shown(rest[0])} of {where[-1]}; there are {known}", rest[0], numbers
        )
    number = int(rest[0])
    below = (*where, rest[0])
    elements[number] = merged(element, elements[number], rest[1:], value, source, below) if rest[1:] else value
    return elements


def check_overruled(cls: type, table: Mapping[str, Any], source: Source, given: Iterable[Sequence[str]]) -> None:
    """Reject keys that other keys make ineffective (see `OVERRULED`)."""
    for path in given:
        owner, within = cls, table
        for key in path[:-1]:
            inner = dataclass_in(hints_of(owner).get(key))
            if inner is None or not isinstance(within := within.get(key, {}), Mapping):
                break
            owner = inner
        else:
            fields = fields_of(owner)
            values = {name: field.default for name, field in fields.items()}
            values |= {field_in_unit(key, fields)[0]: value for key, value in within.items()}
            if rule := _overruling(owner, path[-1], values):
                by = " and ".join(f"{other} = {shown(values[other])}" for other in rule)
                raise source.fail(path, f"has no effect together with {by}; leave one out", within.get(path[-1]))


def is_overruled(owner: Any, key: str) -> bool:
    """Return whether other values of an object override one of its keys (see `OVERRULED`)."""
    return bool(_overruling(type(owner), key, vars(owner)))


def _overruling(owner: type, key: str, values: Mapping[Any, Any]) -> Mapping[str, Any]:
    """Return the rule that makes a key ineffective, empty if there is none."""
    rule = getattr(owner, "OVERRULED", {}).get(field_in_unit(key, fields_of(owner))[0], {})
    return rule if all(_holds(values[other], wanted) for other, wanted in rule.items()) else {}


def _holds(value: object, wanted: object) -> bool:
    return value not in (None, dataclasses.MISSING) if wanted is None else value == wanted


T = TypeVar("T")


def build(cls: type[T], table: Mapping[str, Any], source: Source, path: Sequence[str] = (), base: Any = None) -> T:
    """Build a dataclass from a table, and convert display units."""
    hints = hints_of(cls, include_extras=True)
    fields = fields_of(cls)
    values: dict[str, Any] = {}
    for key, raw in table.items():
        where = (*path, str(key))
        name, factor = field_in_unit(key, fields)
        if name is None:
            raise no_such_key(cls, source, where)
        if name in values:
            first = next(other for other in table if field_in_unit(other, fields)[0] == name)
            raise source.fail(where, f"{first} and {key} are the same key in two units; give one of them")
        values[name] = convert(hints[name], raw, factor, source, where, _default_of(fields[name]))
    for name, field in fields.items():
        has_default = field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING
        if name in values or has_default:
            continue
        if base is None:
            raise source.fail((*path, name), f"the key {' or '.join(spellings(name))} is missing")
        values[name] = getattr(base, name)
    try:
        return cls(**values)
    except ActiveSteerError as reason:  # from checks of the class, which do not know the file
        raise source.placed(path, reason) from reason


def _default_of(field: dataclasses.Field[Any]) -> Any:
    """Return the default of a field, or None."""
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return None if field.default is dataclasses.MISSING else field.default


def convert(hint: Any, raw: Any, factor: float, source: Source, path: Sequence[str], base: Any = None) -> Any:
    """Check a value against its type hint and convert it."""
    limits = Range()
    if typing.get_origin(hint) is typing.Annotated:
        hint, *notes = typing.get_args(hint)
        limits = next((note for note in notes if isinstance(note, Range)), limits)
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        if raw is None:
            return None
        options = [option for option in typing.get_args(hint) if option is not type(None)]
        hint = type(raw) if type(raw) in options else options[0]
        return convert(typing.Annotated[hint, limits], raw, factor, source, path, base)
    origin = typing.get_origin(hint)
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        if not isinstance(raw, Mapping):
            raise source.fail(path, f"{shown(raw)} is not a table; a table [{'.'.join(path)}] is needed", raw)
        return build(hint, raw, source, path, base)
    if origin is dict:
        if not isinstance(raw, Mapping):
            raise source.fail(path, f"{shown(raw)} is not a table", raw)
        item = typing.get_args(hint)[1]
        return {key: convert(item, value, 1.0, source, (*path, str(key))) for key, value in raw.items()}
    if origin is tuple:
        return _elements(hint, raw, factor, limits, source, path)
    return _scalar(hint, raw, factor, limits, source, path)


def _elements(
    hint: Any, raw: Any, factor: float, limits: Range, source: Source, path: Sequence[str]
) -> tuple[Any, ...]:
    """Convert a list of numbers or of tables."""
    element = element_of(hint)
    if not isinstance(raw, (list, tuple)):
        wanted = (
            "not a list of numbers, such as [0.0, 0.5]"
            if element is None
            else f"not a list; tables [[{'.'.join(path)}]] are needed"
        )
        raise source.fail(path, f"{shown(raw)} is {wanted}", raw)
    if element is not None:
        return tuple(convert(element, value, 1.0, source, (*path, str(number))) for number, value in enumerate(raw))
    item = typing.Annotated[typing.get_args(hint)[0], limits]
    return tuple(convert(item, value, factor, source, path) for value in raw)


def _scalar(hint: Any, raw: Any, factor: float, limits: Range, source: Source, path: Sequence[str]) -> Any:
    if hint is Any:
        return raw
    if typing.get_origin(hint) is typing.Literal:
        words = typing.get_args(hint)
        if raw not in list(words):
            known = ", ".join(repr(word) for word in words[:-1])
            raise source.fail(path, f"is {shown(raw)}; allowed: {known} and {words[-1]!r}", raw, words)
        return raw
    wanted = {float: "a number", int: "a whole number", bool: "true or false", str: "a string"}[hint]
    good = isinstance(raw, hint) or (hint is float and isinstance(raw, int))
    if not good or (isinstance(raw, bool) and hint is not bool):
        raise source.fail(path, f"{shown(raw)} is not {wanted}", raw, hint)
    if isinstance(raw, str) and (len(raw) > MAX_TOML_LETTERS or not raw.isprintable()):
        raise source.fail(path, f"{shown(raw)} is not a string of at most {MAX_TOML_LETTERS} printable characters", raw)
    if hint in (bool, str):
        return raw
    number: Any = raw
    try:
        value = number * factor if factor != 1.0 else hint(number)
        finite = math.isfinite(value)
    except OverflowError:  # an integer too large for a float
        value, finite = math.inf, False
    if not finite:
        raise source.fail(path, f"{shown(raw)} is not finite", raw, limits)
    if abs(value) > MAX_NUMBER:
        raise source.fail(path, f"is {shown(raw)}; the largest number allowed in a file is {MAX_NUMBER:g}", raw, limits)
    if not limits.low <= value <= limits.high:
        allowed = Range(limits.low / factor, limits.high / factor)
        raise source.fail(path, f"{shown(raw)} is out of range; allowed: {allowed}", raw, allowed)
    return value


def checked_number(key: str, value: object, limits: Range) -> float:
    """Check an argument of a Python function like a number in a file, and return it."""
    return _scalar(float, value, 1.0, limits, Source(""), (key,))


def check_points(
    key: str, points: Sequence[float], columns: Mapping[str, Sequence[float] | None], count: Range,
    error: type[ActiveSteerError] = ParameterError,
) -> None:  # fmt: skip
    """Check that the points of a curve increase, are not too few or too many, and have columns of equal length."""
    if not count.low <= len(points) <= count.high:
        raise error(f"has {len(points)} points; allowed: {count}", key=key)
    for before, after in itertools.pairwise(points):
        if not before < after:
            raise error(f"does not increase from {before:g} to {after:g}", key=key)
    for name, column in columns.items():
        if column is not None and len(column) != len(points):
            raise error(f"has {len(column)} values, but {key} has {len(points)}", key=name)


def to_table(value: Any, *, defaults: bool = True) -> Any:
    """Return a dataclass as plain tables that `build` reads."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        values = {field: getattr(value, field.name) for field in dataclasses.fields(value)}
        return {
            field.name.removesuffix("_"): to_table(item, defaults=defaults)
            for field, item in values.items()
            if item is not None and (defaults or item != field.default)
        }
    if isinstance(value, dict):
        return {key: to_table(item, defaults=defaults) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_table(item, defaults=defaults) for item in value]
    return value

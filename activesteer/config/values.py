"""Conversion of tables to dataclasses, with a check of each value against the type of its field, and back."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from activesteer.config.keys import element_of, field_in_unit, fields_of, hints_of, no_such_key, spellings
from activesteer.config.source import Range, Source
from activesteer.errors import ActiveSteerError, shown
from activesteer.limits import MAX_NUMBER, MAX_TOML_LETTERS

T = TypeVar("T")
"""Longest text [characters]."""


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
        if name in values or field.default is not dataclasses.MISSING:
            continue
        if field.default_factory is not dataclasses.MISSING:
            continue
        if base is not None:
            values[name] = getattr(base, name)
            continue
        raise source.fail((*path, name), f"the key {' or '.join(spellings(name))} is missing")
    try:
        return cls(**values)
    except ActiveSteerError as reason:  # from checks of the class, which do not know the file
        raise source.placed(path, reason) from reason


def _default_of(field: dataclasses.Field[Any]) -> Any:
    """Default of a field, or None."""
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
            raise source.fail(path, f"{shown(raw)} is no table; a table [{'.'.join(path)}] is needed", raw)
        return build(hint, raw, source, path, base)
    if origin is dict:
        if not isinstance(raw, Mapping):
            raise source.fail(path, f"{shown(raw)} is no table", raw)
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
        wanted = "no list of numbers" if element is None else f"no list; tables [[{'.'.join(path)}]] are needed"
        raise source.fail(path, f"{shown(raw)} is {wanted}", raw)
    if element is not None:
        return tuple(convert(element, value, 1.0, source, (*path, str(number))) for number, value in enumerate(raw))
    item = typing.Annotated[typing.get_args(hint)[0], limits]
    return tuple(convert(item, value, factor, source, path) for value in raw)


def _word(words: Sequence[str], raw: Any, source: Source, path: Sequence[str]) -> str:
    if raw not in list(words):
        known = ", ".join(repr(word) for word in words[:-1])
        raise source.fail(path, f"is {shown(raw)}; allowed are {known} and {words[-1]!r}", raw, words)
    return raw


def _scalar(hint: Any, raw: Any, factor: float, limits: Range, source: Source, path: Sequence[str]) -> Any:
    if hint is Any:
        return raw
    if typing.get_origin(hint) is typing.Literal:
        return _word(typing.get_args(hint), raw, source, path)
    wanted = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}[hint]
    good = isinstance(raw, hint) or (hint is float and isinstance(raw, int))
    if not good or (isinstance(raw, bool) and hint is not bool):
        raise source.fail(path, f"{shown(raw)} is not {wanted}", raw, hint)
    if isinstance(raw, str) and (len(raw) > MAX_TOML_LETTERS or not raw.isprintable()):
        raise source.fail(path, f"{shown(raw)} is not a text of at most {MAX_TOML_LETTERS} printable characters", raw)
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
        raise source.fail(path, f"{shown(raw)} is out of range; allowed is {allowed}", raw, allowed)
    return value


def checked_number(key: str, value: object, limits: Range) -> float:
    """Check the argument `key` of a Python function like a number in a file, and return it."""
    return _scalar(float, value, 1.0, limits, Source(""), (key,))


def to_table(value: Any, *, defaults: bool = True) -> Any:
    """Return a dataclass as plain tables for JSON; `build` restores it."""
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

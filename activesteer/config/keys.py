"""Keys of a dataclass in a file: fields in SI or in a display unit, in nested tables."""

from __future__ import annotations

import dataclasses
import functools
import typing
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from activesteer.config.source import Source
from activesteer.errors import ActiveSteerError, nearest_names
from activesteer.units import EDGE_UNITS


def spellings(name: str) -> list[str]:
    """Return the keys that fill a field: its name, and the name in a display unit; `class` fills `class_`."""
    name = name.removesuffix("_")
    edges = [name[: -len(si)] + edge for edge, (si, _) in EDGE_UNITS.items() if name.endswith(si)]
    return [name, *edges]


def field_in_unit(key: object, fields: Collection[str]) -> tuple[str | None, float]:
    """Return the field that a key of a file fills.

    Returns:
        Name of the field, or None, and the factor from the unit of the key to SI.
    """
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
    """Return the types of the fields of a dataclass, cached: `typing.get_type_hints` parses them at every call."""
    return typing.get_type_hints(cls, include_extras=include_extras)


def fields_of(cls: type) -> dict[str, dataclasses.Field[Any]]:
    """Return the fields of a dataclass by name."""
    return {field.name: field for field in dataclasses.fields(cls)}


def dataclass_in(hint: Any) -> type | None:
    """Return the dataclass of a table that a field holds, possibly an optional one; None for other fields."""
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
    """Return all dotted keys that a table for `cls` may have, cached: every override is looked up in them."""
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


def leaf_keys(table: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield the keys of all values of a table, each as the path of names to it."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from ((str(key), *below) for below in leaf_keys(value))
        else:
            yield (str(key),)


def key_hint(cls: type, key: str) -> str | None:
    """Return the help that a class, or the class of an inner table, gives for a dotted key that does not exist."""
    first, _, rest = key.partition(".")
    inner = dataclass_in(hints_of(cls).get(first)) if rest else None
    return getattr(cls, "KEY_HINTS", {}).get(key) if inner is None else key_hint(inner, rest)


def no_such_key(cls: type, source: Source, path: Sequence[str]) -> ActiveSteerError:
    """Return the error for a key that a class does not have; see `Source.fail`."""
    names = [spelling for name in fields_of(cls) for spelling in spellings(name)]
    help_ = key_hint(cls, path[-1]) or nearest_names(path[-1], names)
    return source.fail(path, f"there is no such key; {help_}", allowed=names)

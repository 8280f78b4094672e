"""Keys of a dataclass in a file, and overrides of keys and keys without effect beside others."""

from __future__ import annotations

import dataclasses
import functools
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

from activesteer.config.source import Source
from activesteer.errors import ActiveSteerError, nearest_names, shown
from activesteer.units import EDGE_UNITS


def spellings(name: str) -> list[str]:
    """Return the keys that fill a field: its name, and the name in a display unit. `class` fills `class_`."""
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
    """Return the types of the fields of a dataclass, cached: `typing.get_type_hints` parses them at every call."""
    return typing.get_type_hints(cls, include_extras=include_extras)


def fields_of(cls: type) -> dict[str, dataclasses.Field[Any]]:
    """Return the fields of a dataclass by name."""
    return {field.name: field for field in dataclasses.fields(cls)}


def dataclass_in(hint: Any) -> type | None:
    """Return the dataclass of a table that a field holds, possibly an optional one, or None for other fields."""
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
        raise source.fail(above, f"is {shown(table)}, which is no table and has no {path[0]}", table)
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
    elif typing.get_origin(hint) is dict:
        item, branch = typing.get_args(hint)[1], result.get(key, {})
        if not isinstance(branch, Mapping):
            raise source.fail(where, f"is {shown(branch)}, which is no table", branch)
        if rest[0] not in branch or len(rest) == 1:
            raise source.fail(
                (*where, *rest), f"there is no such key; {nearest_names(rest[0], branch)}", rest[0], sorted(branch)
            )
        below = merged(item, branch[rest[0]], rest[1:], value, source, (*where, rest[0]))
        result[key] = {**branch, rest[0]: below}
    else:
        raise source.fail((*where, *rest), f"{key} is a value, not a table")
    return result


def _merged_list(
    element: type, given: Any, rest: Sequence[str], value: object, source: Source, where: Sequence[str]
) -> list[Any]:
    """Return a list of tables with one table, or a key of it, replaced."""
    if not isinstance(given, (list, tuple)):
        raise source.fail(where, f"is {shown(given)}, which is no list", given)
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
    """Refuse keys that other keys make ineffective (see `OVERRULED`)."""
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
            rule = getattr(owner, "OVERRULED", {}).get(field_in_unit(path[-1], fields)[0])
            if rule and all(_holds(values[other], wanted) for other, wanted in rule.items()):
                by = " and ".join(f"{other} = {shown(values[other])}" for other in rule)
                raise source.fail(path, f"has no effect beside {by}; leave one out", within.get(path[-1]))


def _holds(value: object, wanted: object) -> bool:
    return value not in (None, dataclasses.MISSING) if wanted is None else value == wanted

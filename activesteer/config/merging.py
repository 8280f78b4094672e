"""Overrides of keys, and keys without effect beside others."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from activesteer.config.keys import dataclass_in, element_of, field_in_unit, fields_of, hints_of, no_such_key
from activesteer.config.source import Source
from activesteer.errors import nearest_names, shown


def merged(
    cls: type, table: Mapping[str, Any], path: Sequence[str], value: object, source: Source, above: Sequence[str] = ()
) -> dict[str, Any]:
    """Return a table with one key replaced, in any of its units.

    Raises:
        ActiveSteerError: there is no such key, or a key above it is no table.
    """
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
    """Refuse keys that other keys make ineffective; see `OVERRULED`.

    Args:
        cls: Dataclass of the table.
        table: The table.
        source: Source of the table, for error messages.
        given: Given keys, each as a path of names.

    Raises:
        ActiveSteerError: a key has no effect; the message names both keys.
    """
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

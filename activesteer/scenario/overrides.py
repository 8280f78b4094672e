"""Overrides: values that replace keys of files, controllers and users' blocks for one run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from itertools import combinations
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.config import Source, check_overruled, field_path, key_paths, merged
from activesteer.controllers import CONTROLLER, ControllerParameters, controller_spec, is_read, keys_read
from activesteer.errors import ParameterError, shown
from activesteer.plugins import Plugin


class Override(NamedTuple):
    """One replaced key, with its path and value."""

    given: str
    path: tuple[str, ...]
    value: Any


def plain(overrides: Mapping[str, Any] | None) -> dict[str, Any]:
    """Convert NumPy's numbers and arrays in overrides to Python's, which JSON can store."""
    for key in overrides or {}:
        if not isinstance(key, str):
            raise ParameterError(f"the key of an override is text such as 'road.mu', not {shown(key)}", value=key)
    return {
        key: value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value
        for key, value in (overrides or {}).items()
    }


def applied(
    cls: type, table: Mapping[str, Any], source: Source, overrides: Sequence[Override]
) -> tuple[dict[str, Any], Source]:
    """Apply overrides to the table of a file."""
    paths = [field_path(cls, override.path) for override in overrides]
    for (one, above), (other, below) in combinations(zip(overrides, paths, strict=True), 2):
        shorter = min(len(above), len(below))
        if above[:shorter] == below[:shorter]:
            raise ParameterError(
                f"replaces the value of {one.given}; leave one of the two out",
                key=other.given,
                value=other.value,
                overridden=True,
            )
    changed = frozenset(".".join(override.path) for override in overrides)
    for override in overrides:
        given = Source("", overridden=frozenset({".".join(override.path)}))
        table = merged(cls, table, override.path, override.value, given)
    check_overruled(cls, table, Source("", overridden=changed), [one.path for one in overrides])
    return dict(table), replace(source, overridden=changed)


_BUILT_IN: Final = frozenset(field.name for field in fields(ControllerParameters))


def own_path(key: str) -> tuple[str, str] | None:
    """Return class and parameter of a key of a user's controller, or None for other keys."""
    table, _, rest = key.removeprefix("vehicle.").partition(".")
    name, _, parameter = rest.partition(".")
    return (name, parameter) if table == "controllers" and name and name not in _BUILT_IN else None


def own_controllers(controllers: Sequence[Any]) -> dict[str, list[Plugin]]:
    """Return users' controllers by the names that they have in keys."""
    found: dict[str, list[Plugin]] = {}
    for plugin in map(controller_spec, controllers):
        if not plugin.is_builtin:
            found.setdefault(plugin.key, []).append(plugin)
    for name, plugins in found.items():
        if any(plugin.files != plugins[0].files for plugin in plugins):
            raise ParameterError("two controllers have this name; rename one of them", key=f"controllers.{name}")
    return found


def own_values(overrides: Sequence[Override], controllers: Mapping[str, Sequence[Plugin]]) -> dict[str, dict[str, Any]]:
    """Return the checked overrides of users' controllers, by class and parameter."""
    given: dict[str, dict[str, Any]] = {}
    for _, (name, parameter), value in overrides:
        given.setdefault(name, {})[parameter] = value
    return {name: plugin.own_values(values) for name, values in given.items() for plugin in controllers[name]}


def gain_paths(overrides: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
    """Return the overrides of the table [controllers] by key."""
    split = {key: key.removeprefix("vehicle.").split(".") for key in overrides if own_path(key) is None}
    return {
        key: field_path(ControllerParameters, rest) for key, (first, *rest) in split.items() if first == "controllers"
    }


def unread_gains(overrides: Mapping[str, Any], controllers: Sequence[Any]) -> dict[str, frozenset[str]]:
    """Return the overrides that no controller reads, with the keys that they set."""
    read = frozenset[str]().union(*map(keys_read, controllers))
    replaced = dict[str, frozenset[str]]()
    for key, path in gain_paths(overrides).items():
        inside = value if isinstance(value := overrides[key], Mapping) else ()
        is_known = (dotted := ".".join(path)) in key_paths(ControllerParameters)
        replaced[key] = frozenset({dotted}) if is_known else _BUILT_IN.intersection(path[:1] or inside)
    if own := {key: path[0] for key in overrides if (path := own_path(key))}:
        replaced |= {key: frozenset({name}) for key, name in own.items()}
        read |= own_controllers(controllers).keys()
    return {key: names for key, names in replaced.items() if names and not any(is_read(name, read) for name in names)}


def read_by(overrides: Mapping[str, Any], controller: Any) -> dict[str, Any]:
    """Return the overrides, without the gains that only other controllers read."""
    unread = unread_gains(overrides, [controller])
    return {key: value for key, value in overrides.items() if key not in unread}


def check_gains(overrides: Mapping[str, Any], controllers: Sequence[Any]) -> None:
    """Check that every override of the table [controllers] is read by one of these controllers."""
    for key, names in unread_gains(overrides, controllers).items():
        readers = [name for name in CONTROLLER.names() if any(is_read(each, keys_read(name)) for each in names)]
        if own_path(key):
            problem = f"has no effect: no controller {', '.join(names)} drives here"
            raise ParameterError(problem, key=key, value=overrides[key], overridden=True)
        driving = " and ".join(controller_spec(given).label for given in controllers)
        read = sorted(frozenset[str]().union(*map(keys_read, controllers)))
        tables = sorted({each.partition(".")[0] for each in read})
        parts = [each for each in read if any(name.startswith(each.partition(".")[0] + ".") for name in names)]
        allowed = [f"controllers.{name}" for name in parts or tables]
        words = "controller {} reads" if len(controllers) == 1 else "controllers {} read"
        here = f"{words.format(driving)} {', '.join(allowed)}" if controllers else "no controller drives here"
        if parts:
            table = parts[0].partition(".")[0]
            inside = ", ".join(each.removeprefix(f"{table}.") for each in parts)
            here = f"of controllers.{table}, {words.format(driving)} {inside}"
        given = ", ".join(f"controllers.{name}" for name in sorted(names))
        raise ParameterError(
            f"has no effect: {here}; {given} is read by {', '.join(readers)}",
            key=key, value=overrides[key], allowed=allowed, overridden=True,
        )  # fmt: skip


def each_overrides(overrides: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None, n: int) -> list[dict[str, Any]]:
    """Return the overrides of each car."""
    if overrides is None or isinstance(overrides, Mapping):
        table = dict(overrides or {})
        arrays = {key: value for key, value in table.items() if isinstance(value, np.ndarray) and value.ndim}
        for key, value in arrays.items():
            if len(value) != n:
                needed = f"one for each of {n} cars is needed in an array, and a list is one value for all"
                raise ParameterError(f"has {len(value)} values; {needed}", key=key)
        return [table | {key: value[car].tolist() for key, value in arrays.items()} for car in range(n)]
    if isinstance(overrides, (str, bytes)) or not all(isinstance(changes, Mapping) for changes in overrides):
        raise ParameterError(f"is {shown(overrides)}; a table, or a list of tables, is needed", key="overrides")
    if len(overrides) != n:
        raise ParameterError(f"has {len(overrides)} entries; one for each of {n} cars is needed", key="overrides")
    return [dict(changes) for changes in overrides]

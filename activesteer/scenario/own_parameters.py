"""Overrides of the parameters of users' controllers: keys such as `controllers.YawBeta.k_beta`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, Final

from activesteer.controllers import ControllerParameters, find_controller
from activesteer.errors import ParameterError
from activesteer.plugins import Plugin

_BUILT_IN: Final = frozenset(field.name for field in fields(ControllerParameters))


def own_path(key: str) -> tuple[str, str] | None:
    """Return the class and the parameter of a key of a user's controller; None for other keys."""
    table, _, rest = key.removeprefix("vehicle.").partition(".")
    name, _, parameter = rest.partition(".")
    return (name, parameter) if table == "controllers" and name and name not in _BUILT_IN else None


def own_controllers(controllers: Sequence[Any]) -> dict[str, list[Plugin]]:
    """Return users' controllers by the names that they have in keys; the same class may drive with other parameters.

    Raises:
        ParameterError: classes of two files have the same name.
    """
    found: dict[str, list[Plugin]] = {}
    for plugin in map(find_controller, controllers):
        if not plugin.ours:
            found.setdefault(plugin.key, []).append(plugin)
    for name, plugins in found.items():
        if any(plugin.files != plugins[0].files for plugin in plugins):
            raise ParameterError("two controllers have this name; rename one of them", key=f"controllers.{name}")
    return found


def own_values(overrides: Mapping[str, Any], controllers: Mapping[str, Sequence[Plugin]]) -> dict[str, dict[str, Any]]:
    """Return the checked overrides of users' controllers: class -> name -> value."""
    given: dict[str, dict[str, Any]] = {}
    for key, value in overrides.items():
        name, parameter = own_path(key) or ("", "")
        given.setdefault(name, {})[parameter] = value
    return {name: plugin.own_values(values) for name, values in given.items() for plugin in controllers[name]}

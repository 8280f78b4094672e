"""Overrides of the table [controllers], and the check that a controller reads them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, Final

from activesteer.config import field_path
from activesteer.controllers import CONTROLLER, ControllerParameters, find_controller, keys_read
from activesteer.errors import ParameterError
from activesteer.scenario.own_parameters import own_controllers, own_path

_KEYS: Final = frozenset(field.name for field in fields(ControllerParameters))


def gain_paths(overrides: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
    """Return the overrides of the table [controllers]: key -> names of the fields on the path to its value."""
    split = {key: key.removeprefix("vehicle.").split(".") for key in overrides if own_path(key) is None}
    return {
        key: field_path(ControllerParameters, rest) for key, (first, *rest) in split.items() if first == "controllers"
    }


def unread_gains(overrides: Mapping[str, Any], controllers: Sequence[Any]) -> dict[str, frozenset[str]]:
    """Return the overrides that none of these controllers reads: key -> keys of the table [controllers] it replaces."""
    read = frozenset[str]().union(*map(keys_read, controllers))
    replaced = {
        key: _KEYS.intersection(path[:1] or (value if isinstance(value := overrides[key], Mapping) else ()))
        for key, path in gain_paths(overrides).items()
    }
    if own := {key: path[0] for key in overrides if (path := own_path(key))}:
        replaced |= {key: frozenset({name}) for key, name in own.items()}
        read |= own_controllers(controllers).keys()
    return {key: names for key, names in replaced.items() if names and not names & read}


def read_by(overrides: Mapping[str, Any], controller: Any) -> dict[str, Any]:
    """Return the overrides without those of the table [controllers] that only other controllers read."""
    unread = unread_gains(overrides, [controller])
    return {key: value for key, value in overrides.items() if key not in unread}


def check_gains(overrides: Mapping[str, Any], controllers: Sequence[Any]) -> None:
    """Check that every override of the table [controllers] is read by one of these controllers.

    Raises:
        ParameterError: no controller reads an override; `allowed` has the keys that they read.
    """
    for key, names in unread_gains(overrides, controllers).items():
        readers = [name for name in CONTROLLER.names() if names & keys_read(name)]
        if own_path(key):
            problem = f"has no effect: no controller {', '.join(names)} drives here"
            raise ParameterError(problem, key=key, value=overrides[key], overridden=True)
        driving = " and ".join(find_controller(given).label for given in controllers)
        allowed = [f"controllers.{name}" for name in sorted(frozenset[str]().union(*map(keys_read, controllers)))]
        words = "controller {} reads" if len(controllers) == 1 else "controllers {} read"
        here = f"{words.format(driving)} {', '.join(allowed)}" if controllers else "no controller drives here"
        given = ", ".join(f"controllers.{name}" for name in sorted(names))
        raise ParameterError(
            f"has no effect: {here}; {given} is read by {', '.join(readers)}",
            key=key, value=overrides[key], allowed=allowed, overridden=True,
        )  # fmt: skip

"""What was given as a controller or driver: how it is called, made and recorded."""

from __future__ import annotations

import copy
import functools
import inspect
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from activesteer.errors import nearest_names, shown
from activesteer.plugins.file import from_file
from activesteer.plugins.kind import Kind, in_one_line

_PLAIN: Final = (bool, int, float, str)
_SETUP: Final = "setup"
"""An argument of this name gets what is known of the car."""


@dataclass(frozen=True)
class Plugin:
    """A controller or driver that can be made, any number of times, for any car.

    Attributes:
        kind: Which of the two.
        name: How it is called in messages and in recordings, as `my_file.py:MyController?gain=2`.
        label: How it is called in tables and names of files, as `MyController-gain=2`; `+truth` where it uses that.
        origin: What it is made from: a class, a function, or an object that is copied.
        parameters: What it is made with, by name.
        files: The file that it is in, to be kept with the recording.
        ours: Whether its code is the package's own, which needs no watching.
    """

    kind: Kind
    name: str
    label: str
    origin: Any
    parameters: Mapping[str, Any]
    files: Mapping[str, bytes]
    ours: bool = False

    def __post_init__(self) -> None:
        """A block that uses the truth says so in its label, wherever its results are shown."""
        if self.uses_truth:
            object.__setattr__(self, "label", f"{self.label}+truth")

    @property
    def uses_truth(self) -> bool:
        """Whether it asks, by an attribute of this name, for what no sensor of a car says."""
        return bool(getattr(self.origin, "uses_truth", False))

    def make(self, setup: Any) -> Any:
        """Makes the block, always in the state in which it was given: nothing is carried over from one run to the next.

        Args:
            setup: What it may know of the car.

        Returns:
            The block; a user's own inside one that explains what goes wrong in it.

        Raises:
            ActiveSteerError: of the kind's type: it cannot be made.
        """
        kind, origin = self.kind, self.origin
        if self.ours:
            return origin.from_vehicle(setup)
        try:
            made = self._made(setup)
        except Exception as reason:
            what = getattr(origin, "__name__", type(origin).__name__)
            raise kind.fail(self.name, f"{what} cannot be made: {in_one_line(reason)}") from reason
        if not callable(getattr(made, "step", None)):
            raise kind.fail(self.name, f"{type(made).__name__} has no method step({kind.inputs})", made)
        return Watched(made, kind, self.name, setup)

    def _made(self, setup: Any) -> Any:
        if is_instance(self.origin):
            return copy.deepcopy(self.origin)
        if hasattr(self.origin, "from_vehicle"):
            return self.origin.from_vehicle(setup, **self.parameters)
        given = {_SETUP: setup} if _SETUP in _arguments(self.origin) else {}
        return self.origin(**self.parameters, **given)


class Watched:
    """A user's block, watched: an error that it raises or a wrong command is reported with its file and class.

    Attributes:
        inner: The user's object.
    """

    def __init__(self, inner: Any, kind: Kind, name: str, setup: Any) -> None:
        """Wraps it.

        Args:
            inner: The user's object.
            kind: What it is.
            name: How it is called in messages.
            setup: What it may know of the car.
        """
        self.inner = inner
        self._about = kind, name, setup

    def step(self, *inputs: Any) -> Any:
        """What the user's step returns.

        Raises:
            ActiveSteerError: of the kind's type: it raised something, or returned no command.
        """
        kind, name, setup = self._about
        try:
            command = self.inner.step(*inputs)
        except Exception as reason:
            raise kind.fail(name, f"step raised {in_one_line(reason)}") from reason
        return kind.checked(command, name, setup)

    def __deepcopy__(self, memo: dict[int, Any]) -> Watched:
        kind, name, setup = self._about
        try:
            return Watched(copy.deepcopy(self.inner, memo), kind, name, setup)
        except Exception as reason:
            raise kind.fail(name, f"its state cannot be copied: {in_one_line(reason)}") from reason


def find(given: Any, kind: Kind) -> Plugin:
    """Finds a controller or driver and checks what can be checked before it is made.

    Args:
        given: Name of a built-in one; `my_file.py:MyController`, with `?gain=2&limit_rad=0.05` where it takes
            parameters; a class; an object with a method `step`; or a function that makes one. A class is made by its
            classmethod `from_vehicle` where it has one. Where an argument is called `setup`, it gets what is known of
            the car (`ControllerSetup`, `DriverSetup`).
        kind: Controller or driver.

    Raises:
        ActiveSteerError: of the kind's type: there is no such thing, or it has no such parameter.
    """
    if isinstance(given, Plugin):
        return given
    if isinstance(given, os.PathLike):
        given = os.fspath(given)
    if isinstance(given, str):
        if given in kind.built_in:
            return Plugin(kind, given, given, kind.built_in[given], {}, {}, ours=True)
        path, content, origin, parameters = from_file(given, kind)
        _check_parameters(origin, parameters, given, kind)
        label = "-".join([given.partition("?")[0].rpartition(":")[2], *(f"{k}={v}" for k, v in parameters.items())])
        return Plugin(kind, given, re.sub(r"[^\w=.+-]+", "_", label), origin, parameters, {path.name: content})
    if not is_instance(given) and not callable(given):
        names = ", ".join(kind.names())
        needed = f"a name ({names}), a file ({kind.example}), a class, an object with the method step({kind.inputs})"
        raise kind.fail(
            "", f"is {shown(given)}; {needed}, or a function that makes one is needed", given, tuple(kind.names())
        )
    return _from_object(given, kind)


def is_instance(given: Any) -> bool:
    """Whether something is a block already, not a class or function that makes one."""
    return not isinstance(given, type) and callable(getattr(given, "step", None))


def _from_object(given: Any, kind: Kind) -> Plugin:
    origin, parameters = given, {}
    if isinstance(given, functools.partial):
        parameters = _plain(given.keywords)
    elif is_instance(given):
        parameters = _plain(getattr(given, "__dict__", {}))
    about = type(given) if is_instance(given) else getattr(given, "func", given)
    label = re.sub(r"[^\w.]+", "_", getattr(about, "__qualname__", type(given).__name__)).strip("_")
    label = label.rpartition("locals_.")[2]
    try:
        source = Path(inspect.getsourcefile(about) or "")
        files = {source.name: source.read_bytes()} if source.is_file() else {}
    except (TypeError, OSError):  # typed in at a prompt
        files = {}
    name = f"{next(iter(files))}:{label}" if files else label
    if isinstance(given, type) and not callable(getattr(given, "step", None)):
        raise kind.fail(name, f"{label} has no method step({kind.inputs})", given)
    return Plugin(kind, name, label, origin, parameters, files)


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """What of it can be recorded."""
    return {key: value for key, value in values.items() if isinstance(value, _PLAIN) and not key.startswith("_")}


def _arguments(maker: Any) -> dict[str, inspect.Parameter]:
    try:
        return dict(inspect.signature(maker).parameters)
    except (TypeError, ValueError):  # some of what is written in C
        return {}


def _check_parameters(origin: Any, parameters: Mapping[str, Any], name: str, kind: Kind) -> None:
    if is_instance(origin):
        known = []
    elif hasattr(origin, "from_vehicle"):
        known = list(_arguments(origin.from_vehicle).values())[1:]
    else:
        known = [argument for key, argument in _arguments(origin).items() if key != _SETUP]
    names = [
        argument.name for argument in known if argument.kind in (argument.POSITIONAL_OR_KEYWORD, argument.KEYWORD_ONLY)
    ]
    for key in () if any(argument.kind is argument.VAR_KEYWORD for argument in known) else parameters:
        if key not in names:
            raise kind.fail(name, f"there is no parameter {key!r}; {nearest_names(key, names)}", key, tuple(names))

"""A user's driver or controller as a plug-in, and the kinds of plug-ins."""

from __future__ import annotations

import copy
import dataclasses
import functools
import inspect
import os
import re
import types
import typing
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.config import Range, Source, convert, field_in_unit, spellings
from activesteer.core.units import unit_of
from activesteer.errors import ParameterError, nearest_names, shown
from activesteer.plugins.file import format_of, from_file, is_user_module
from activesteer.plugins.kind import Kind, in_one_line

SETUP: Final = "setup"
"""Name of the argument that gets the properties of the car."""
_NOTES: Final = ("default", "range", "unit")
"""Keys of an entry of `PARAMETERS`."""
_SIMPLE: Final = (float, int, bool, str, type(None))
_EMPTY: Final = inspect.Parameter.empty


class Declared(NamedTuple):
    """A declared parameter of a user's block."""

    default: Any = None  # None if there is none
    unit: str = ""  # unit of the value; empty for a pure number
    limits: Range = Range()  # range of a number
    hint: Any = Any  # type, as for a field of `activesteer.config`; `Any` if the declaration does not tell it


def declared_by(origin: Any) -> dict[str, Declared]:
    """Return the declared parameters of a class or function by name.

    They are the arguments of `from_vehicle`, else of the constructor, without `setup`. An annotation
    `Annotated[float, Range(0.0, 2.0), "rad/rad"]` gives range and unit, and so does an entry of the attribute
    `PARAMETERS`, as in `{"gain": {"unit": "rad/rad", "range": (0.0, 2.0)}}`. The end of a name such as `_s` tells the
    unit otherwise. An origin that takes any keywords declares all its parameters in `PARAMETERS`, with `default`.
    """
    notes = getattr(getattr(origin, "func", origin), "PARAMETERS", {})
    maker = getattr(origin, "from_vehicle", origin)
    arguments = [argument for argument in _arguments(maker).values() if argument.name != SETUP]
    named = {
        argument.name: argument
        for argument in (arguments[1:] if maker is not origin and SETUP not in _arguments(maker) else arguments)
        if argument.kind in (argument.POSITIONAL_OR_KEYWORD, argument.KEYWORD_ONLY)
    }
    names = [*named, *(() if all(a.kind is not a.VAR_KEYWORD for a in arguments) else notes)]
    for name, note in notes.items():
        if name not in names:
            raise ValueError(f"PARAMETERS names {name!r}, which is not an argument; {nearest_names(str(name), names)}")
        if wrong := [key for key in note if key not in _NOTES]:
            raise ValueError(f"PARAMETERS[{name!r}]: {wrong[0]!r} is not one of {', '.join(_NOTES)}")
    return {name: _declared(name, named.get(name), notes.get(name, {})) for name in dict.fromkeys(names)}


def declared_in(table: Any, keys: Collection[str], prefix: str) -> dict[str, Declared]:
    """Return the values of a dataclass and of its tables as declared parameters, by dotted key."""
    found: dict[str, Declared] = {}
    for name, annotation in typing.get_type_hints(type(table), include_extras=True).items():
        value = getattr(table, name)
        if name in keys and dataclasses.is_dataclass(value):
            inner = [field.name for field in dataclasses.fields(value)]
            found |= declared_in(value, inner, f"{prefix}{name}.")
        elif name in keys:
            hint, *notes = _parts(annotation)
            limits = next((note for note in notes if isinstance(note, Range)), Range())
            found[prefix + name] = Declared(value, unit_of(name), limits, hint)
    return found


def takes_any(origin: Any) -> bool:
    """Return whether a class or function accepts any keyword without declaring one."""
    arguments = _arguments(getattr(origin, "from_vehicle", origin)).values()
    return any(argument.kind is argument.VAR_KEYWORD for argument in arguments) and not hasattr(origin, "PARAMETERS")


def read_values(
    declared: Mapping[str, Declared], values: Mapping[str, Any], source: Source, path: tuple[str, ...]
) -> dict[str, Any]:
    """Check values of declared parameters, and return them by argument name in the unit of the argument."""
    found: dict[str, Any] = {}
    for key, value in values.items():
        name, factor = field_in_unit(key, declared)
        if name is None:
            names = [spelling for each in declared for spelling in spellings(each)]
            problem = f"there is no parameter {shown(key)}; {nearest_names(key, names)}"
            raise source.fail((*path, key), problem, key, tuple(declared))
        if name in found:
            raise source.fail((*path, key), "is given twice; leave one out", value)
        hint = typing.Annotated[declared[name].hint, declared[name].limits]
        found[name] = convert(hint, value, factor, source, (*path, key))
    return found


def _arguments(maker: Any) -> Mapping[str, inspect.Parameter]:
    try:
        return inspect.signature(maker, eval_str=True).parameters
    except (TypeError, ValueError):  # some functions written in C
        return {}
    except Exception:  # an annotation that cannot be evaluated
        return inspect.signature(maker).parameters


def _declared(name: str, argument: inspect.Parameter | None, note: Mapping[str, Any]) -> Declared:
    given = _EMPTY if argument is None else argument.default
    default = note.get("default", None if given is _EMPTY else given)
    hint, *extras = _parts(_EMPTY if argument is None else argument.annotation)
    limits = next((extra for extra in extras if isinstance(extra, Range)), Range())
    unit = next((extra for extra in extras if isinstance(extra, str)), unit_of(name))
    return Declared(default, note.get("unit", unit), Range(*note.get("range", limits)), _hint(hint, default))


def _parts(annotation: Any) -> tuple[Any, ...]:
    return typing.get_args(annotation) if typing.get_origin(annotation) is typing.Annotated else (annotation,)


def _hint(hint: Any, default: Any) -> Any:
    """Return the type of an annotation if it can be checked, otherwise the type of the default, or `Any`."""
    if hint is _EMPTY:
        kind = type(default)
        return float | int if kind in (float, int) else kind if kind in (bool, str) else Any
    options = typing.get_args(hint) if typing.get_origin(hint) in (typing.Union, types.UnionType) else (hint,)
    return hint if all(each in _SIMPLE or typing.get_origin(each) is typing.Literal for each in options) else Any


_PLAIN: Final = (bool, int, float, str)


@dataclass(frozen=True)
class Plugin:
    """A controller or driver that can be created any number of times, for any car.

    Attributes:
        kind: Controllers or drivers.
        name: Name in messages and recordings, such as `my_file.py:MyController?gain=2`.
        label: Name in tables and file names, such as `MyController-gain=2`; with `+truth` if it uses the truth.
        origin: A class, a function, or an object that is copied.
        parameters: Arguments by name.
        files: File of the code and the neighbouring modules that it imports, to be kept with the recording.
        is_builtin: Whether the code belongs to the package and needs no watching.
    """

    kind: Kind
    name: str
    label: str
    origin: Any
    parameters: Mapping[str, Any]
    files: Mapping[str, bytes]
    is_builtin: bool = False

    def __post_init__(self) -> None:
        """Mark in the label, only once, that a block uses the true motion."""
        if self.uses_truth and not self.label.endswith("+truth"):
            object.__setattr__(self, "label", f"{self.label}+truth")

    @property
    def uses_truth(self) -> bool:
        """True if the block sets `uses_truth` to receive the true motion."""
        return bool(getattr(self.origin, "uses_truth", False))

    @property
    def key(self) -> str:
        """Name of the class or function, used in the keys of its parameters."""
        about = getattr(self.origin, "func", self.origin)
        return getattr(about, "__name__", type(about).__name__)

    @functools.cached_property
    def declared(self) -> dict[str, Declared]:
        """Declared parameters of a user's block by name.

        An object has none, because it exists already.

        Raises:
            ActiveSteerError: of the kind's type: the declaration is wrong.
        """
        if self.is_builtin or is_instance(self.origin):
            return {}
        try:
            return declared_by(self.origin)
        except (TypeError, ValueError) as reason:
            raise self.kind.fail(self.name, str(reason)) from reason

    def own_parameter(self, path: Sequence[str]) -> str:
        """Return the parameter that a key names, empty if the block has none."""
        return "" if self.is_builtin or path[0] != self.key else ".".join(path[1:])

    def own_values(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Check overrides of the parameters and return them by argument name.

        Args:
            values: Name -> value.

        Raises:
            ParameterError: a parameter does not exist, is also given after the `?`, or a value is wrong.
        """
        path = (self.kind.table, self.key)
        source = Source("", overridden=frozenset({".".join(path)}))
        if is_instance(self.origin):
            raise source.fail(path, "is an object that already exists; give its class, or set the object's attribute")
        found = read_values(self.declared, values, source, path)
        for name in found:
            if name in self.parameters:
                raise source.fail((*path, name), f"is given in {self.name} too; leave one out", found[name])
        return found

    def value_of(self, parameter: str, own: Mapping[str, Mapping[str, Any]]) -> Any:
        """Return the value of a declared parameter in the unit of its name (see `parameters_with`).

        Raises:
            ParameterError: there is no such parameter.
        """
        name, factor = field_in_unit(parameter, self.declared)
        if name is None:
            problem = f"there is no such parameter; {nearest_names(parameter, self.declared)}"
            raise ParameterError(problem, key=f"{self.kind.table}.{self.key}.{parameter}")
        value = own.get(self.key, {}).get(name, self.parameters.get(name, self.declared[name].default))
        return value / factor if factor != 1.0 else value

    def parameters_with(self, own: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
        """Return the values of all parameters that a recording can store, including defaults.

        Args:
            own: Overrides: class -> name -> value.
        """
        if self.is_builtin:
            return dict(self.parameters)
        defaults = {name: each.default for name, each in self.declared.items()}
        return _plain({**defaults, **self.parameters, **own.get(self.key, {})})

    def make(self, setup: Any) -> Any:
        """Create the block without memory of earlier runs.

        Args:
            setup: Properties of the car that the block may know.

        Returns:
            The block; a user's block is inside a `Watched`.

        Raises:
            ActiveSteerError: of the kind's type: the block cannot be created.
        """
        kind, origin = self.kind, self.origin
        if self.is_builtin:
            return getattr(origin, "from_vehicle", origin)(setup)
        if getattr(origin, "checks_itself", False):
            return self._created(setup)
        try:
            block = self._created(setup)
            has_step = callable(getattr(block, "step", None))
        except KeyboardInterrupt:
            raise
        except BaseException as reason:
            what = getattr(origin, "__name__", type(origin).__name__)
            raise kind.fail(self.name, f"{what} cannot be created: {in_one_line(reason, self.files)}") from reason
        if not has_step:
            raise kind.fail(self.name, f"{type(block).__name__} has no method step({kind.inputs})", block)
        return Watched(block, kind, self.name, setup, tuple(self.files))

    def __reduce_ex__(self, protocol: Any) -> Any:
        """Pickle a block of a user's file as its specification, so that unpickling loads the file."""
        if is_user_module(getattr(self.origin, "__module__", "")):
            return find, (self.name, self.kind)
        return super().__reduce_ex__(protocol)

    def _created(self, setup: Any) -> Any:
        if is_instance(self.origin):
            return copy.deepcopy(self.origin)
        parameters = {**self.parameters, **getattr(setup, "user_parameters", {}).get(self.key, {})}
        if hasattr(self.origin, "from_vehicle"):
            return self.origin.from_vehicle(setup, **parameters)
        given = {SETUP: setup} if SETUP in _arguments(self.origin) else {}
        return self.origin(**parameters, **given)


class Watched:
    """Wrapper of a user's block that reports errors and wrong commands with file, class and line."""

    def __init__(self, inner: Any, kind: Kind, name: str, setup: Any, files: tuple[str, ...] = ()) -> None:
        self.inner = inner
        self._about = kind, name, setup, files

    def step(self, *inputs: Any) -> Any:
        """Return the checked command of the user's step."""
        kind, name, setup, files = self._about
        try:
            command = self.inner.step(*inputs)
        except KeyboardInterrupt:
            raise
        except BaseException as reason:
            what = f"{type(self.inner).__name__}.step raised {in_one_line(reason, files)}"
            if isinstance(reason, TypeError) and reason.__traceback__ and reason.__traceback__.tb_next is None:
                what = f"{reason}; it is called as step({kind.inputs})"
            raise kind.fail(name, what) from reason
        return kind.checked(command, name, setup)

    def __deepcopy__(self, memo: dict[int, Any]) -> Watched:
        kind, name, _, files = self._about
        try:
            return Watched(copy.deepcopy(self.inner, memo), *self._about)
        except KeyboardInterrupt:
            raise
        except BaseException as reason:
            raise kind.fail(name, f"its state cannot be copied: {in_one_line(reason, files)}") from reason


def find(given: Any, kind: Kind) -> Plugin:
    """Find a controller or driver, and check it as far as possible before its creation.

    Args:
        given: A built-in name; `my_file.py:MyController`, with `?gain=2&limit_rad=0.05` for parameters; a class; an
            object with a method `step`; or a function that returns such an object. If a class has a classmethod
            `from_vehicle`, it creates the object. An argument named `setup` gets the properties of the car
            (`ControllerSetup`, `DriverSetup`).
        kind: Controllers or drivers.

    Raises:
        ActiveSteerError: of the kind's type: there is no such block, or it has no such parameter.
    """
    if isinstance(given, Plugin):
        return given
    if isinstance(given, os.PathLike):
        given = os.fspath(given)
    if isinstance(given, str) and given in kind.built_in:
        return Plugin(kind, given, given, kind.built_in[given], {}, {}, is_builtin=True)
    if (found_format := format_of(given)) is not None:
        return found_format.load()(given, kind)
    if isinstance(given, str):
        origin, written, files = from_file(given, kind)
        label = "-".join([given.partition("?")[0].rpartition(":")[2], *(f"{k}={v}" for k, v in written.items())])
        found = Plugin(kind, given, re.sub(r"[^\w=.+-]+", "_", label), origin, {}, files)
        if not takes_any(origin):
            written = read_values(found.declared, written, Source("", error=kind.error), (kind.table, found.key))
        return allowed(replace(found, parameters=written))
    if not is_instance(given) and not callable(given):
        names = ", ".join(kind.names())
        needed = f"a name ({names}), a file ({kind.example}), a class, an object with the method step({kind.inputs})"
        problem = f"is {shown(given)}; {needed}, or a function that returns one is needed"
        raise kind.fail("", problem, given, tuple(kind.names()))
    return _from_object(given, kind)


def allowed(plugin: Plugin) -> Plugin:
    """Return a plug-in, or reject it if its class has the name of a built-in block or of a table of keys."""
    if plugin.key in (reserved := (*plugin.kind.names(), *plugin.kind.reserved)):
        problem = f"a {plugin.kind.word} of your own cannot have the name {plugin.key!r}; rename it"
        raise plugin.kind.fail(plugin.name, problem, plugin.key, reserved)
    return plugin


def is_instance(given: Any) -> bool:
    """Return whether an object is a block itself, not a class or factory."""
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
    return allowed(Plugin(kind, name, label, origin, parameters, files))


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Select the values that a recording can store."""
    return {key: value for key, value in values.items() if isinstance(value, _PLAIN) and not key.startswith("_")}

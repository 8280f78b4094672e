"""Parameters that a user's controller or driver declares: name, default, unit and range."""

from __future__ import annotations

import dataclasses
import inspect
import types
import typing
from collections.abc import Collection, Mapping
from typing import Any, Final, NamedTuple

from activesteer.config import Range, Source, convert, field_in_unit, spellings
from activesteer.errors import nearest_names, shown
from activesteer.units import unit_of

SETUP: Final = "setup"
"""Name of the argument that gets the properties of the car."""
_NOTES: Final = ("default", "range", "unit")
"""Keys of an entry of `PARAMETERS`."""
_SIMPLE: Final = (float, int, bool, str, type(None))
_EMPTY: Final = inspect.Parameter.empty


class Declared(NamedTuple):
    """A declared parameter.

    Attributes:
        default: Default value; None if there is none.
        unit: Unit of the value; empty for a pure number.
        limits: Range of a number.
        hint: Type, as for a field of `activesteer.config`; `Any` if the declaration does not tell it.
    """

    default: Any = None
    unit: str = ""
    limits: Range = Range()
    hint: Any = Any


def declared_by(origin: Any) -> dict[str, Declared]:
    """Return the parameters of a class or function: name -> declaration.

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
            raise ValueError(f"PARAMETERS names {name!r}, which is no argument; {nearest_names(str(name), names)}")
        if wrong := [key for key in note if key not in _NOTES]:
            raise ValueError(f"PARAMETERS[{name!r}]: {wrong[0]!r} is none of {', '.join(_NOTES)}")
    return {name: _declared(name, named.get(name), notes.get(name, {})) for name in dict.fromkeys(names)}


def declared_in(table: Any, keys: Collection[str], prefix: str) -> dict[str, Declared]:
    """Return the values of a dataclass and of its tables as declared parameters: dotted key -> declaration."""
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
    """Return whether a class or function takes any keywords and declares none of them."""
    arguments = _arguments(getattr(origin, "from_vehicle", origin)).values()
    return any(argument.kind is argument.VAR_KEYWORD for argument in arguments) and not hasattr(origin, "PARAMETERS")


def read_values(
    declared: Mapping[str, Declared], values: Mapping[str, Any], source: Source, path: tuple[str, ...]
) -> dict[str, Any]:
    """Check values of declared parameters, in any of their units, and return them by the names of the arguments."""
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


def has_argument(maker: Any, name: str) -> bool:
    """Return whether a class or function has an argument."""
    return name in _arguments(maker)


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
    """Return the type of an annotation that can be checked, else that of the default, else `Any`."""
    if hint is _EMPTY:
        kind = type(default)
        return float | int if kind in (float, int) else kind if kind in (bool, str) else Any
    options = typing.get_args(hint) if typing.get_origin(hint) in (typing.Union, types.UnionType) else (hint,)
    return hint if all(each in _SIMPLE or typing.get_origin(each) is typing.Literal for each in options) else Any

"""Matching of an FMU's variables with the signals of drivers and controllers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Final, NamedTuple, get_args, get_origin, get_type_hints

from activesteer.config import Source
from activesteer.conventions import CORNERS
from activesteer.coupling.fmu.description import Variable
from activesteer.errors import nearest_names, shown
from activesteer.signals import PerWheel
from activesteer.units import UNIT_NAMES, find_unit, split_ending

_NO_SIGNAL: Final = "none"
"""Signal of a map for a variable that is left alone."""
_KEYS: Final = ("signal", "unit")


class Place(NamedTuple):
    """A number within the messages of a block.

    Attributes:
        message: Place of the message among them.
        field: Place of its field.
        wheel: Place in a field of the four wheels; None for a single number.
    """

    message: int
    field: int
    wheel: int | None


class Link(NamedTuple):
    """A variable of an FMU and its signal: signal = factor times element + offset.

    Attributes:
        variable: The variable.
        signal: Name of the signal.
        places: Number of each element.
        factor: Factor from the FMU's unit to ours.
        offset: Offset, in our unit.
    """

    variable: Variable
    signal: str
    places: tuple[Place, ...]
    factor: float
    offset: float


class Signals(NamedTuple):
    """Signals of some messages.

    Attributes:
        places: Name -> its numbers.
        others: Names of fields that are no numbers.
        words: The messages, in words.
    """

    places: Mapping[str, tuple[Place, ...]]
    others: frozenset[str]
    words: str

    def full(self, name: str) -> str | None:
        """Return the name of a signal that is given with or without its unit; None if there is none."""
        known = (other for other in self.places if other == name or split_ending(other)[0] == name)
        return next(known, None)


def signals_of(messages: Sequence[type[Any]]) -> Signals:
    """Return the signals of messages.

    A field of the four wheels is one signal of four numbers, and four signals of one number. If several messages have
    a field, its name means the first of them; `message.field` means any of them.

    Args:
        messages: Message classes, in the order of a block's arguments.
    """
    places: dict[str, tuple[Place, ...]] = {}
    others = set()
    for index, message in enumerate(messages):
        hints = get_type_hints(message, localns={"Path": object}, include_extras=True)
        for field, (name, hint) in enumerate(hints.items()):
            kind = get_args(hint)[0] if get_origin(hint) is Annotated else hint
            own: dict[str, tuple[Place, ...]] = {}
            if kind == PerWheel:
                own[name] = tuple(Place(index, field, wheel) for wheel in range(len(CORNERS)))
                own |= {f"{corner}_{name}": (place,) for corner, place in zip(CORNERS, own[name], strict=True)}
                own |= {f"{name}[{wheel + 1}]": (place,) for wheel, place in enumerate(own[name])}
            elif {kind, *get_args(kind)} & {float, int, bool} and get_origin(kind) is not tuple:
                own[name] = (Place(index, field, None),)
            else:
                others.add(name)
            for key, value in own.items():
                places.setdefault(key, value)
                places[f"{message.__name__.lower()}.{key}"] = value
    return Signals(places, frozenset(others), ", ".join(message.__name__ for message in messages))


def linked(
    variables: Mapping[str, Variable], signals: Signals, given: Mapping[str, Any], source: Source
) -> tuple[list[Link], list[str]]:
    """Match variables with signals.

    Args:
        variables: Inputs or outputs of the FMU.
        signals: The signals.
        given: The map: name of a variable -> table of signal and unit.
        source: The map's file.

    Returns:
        The links, and the names of the variables without a signal.

    Raises:
        ActiveSteerError: of the type of the source: an entry of the map is wrong, a unit does not fit or is unknown, or
            a signal is no number.
    """
    links, left = [], []
    for name, variable in variables.items():
        entry = given.get(name)
        wanted = name if entry is None else _entry(name, entry, signals, source)
        if wanted == _NO_SIGNAL:
            continue
        if wanted in signals.others:
            message = f'{wanted} is no number and cannot be a signal of an FMU; signal = "none" leaves {name} alone'
            raise source.fail((name,), message, wanted)
        if (signal := signals.full(wanted)) is None:
            left.append(name)
            continue
        unit_name = (entry or {}).get("unit", variable.unit_name)
        links.append(_link(name, variable, signal, signals.places[signal], unit_name, entry, source.fail))
    return links, left


def _entry(name: str, entry: Any, signals: Signals, source: Source) -> str:
    """Return the signal of an entry of the map."""
    if not isinstance(entry, Mapping) or not entry or not all(isinstance(value, str) for value in entry.values()):
        problem = f'is {shown(entry)}; write {name} = {{ signal = "yaw_rate_radps", unit = "deg/s" }}'
        raise source.fail((name,), problem, entry)
    for key in entry:
        if key not in _KEYS:
            raise source.fail((name, key), f"there is no such key; {nearest_names(key, _KEYS)}", key, _KEYS)
    wanted = entry.get("signal", name)
    if wanted not in (_NO_SIGNAL, *signals.others) and signals.full(wanted) is None:
        near = nearest_names(wanted, signals.places)
        problem = f"{signals.words} has no signal {shown(wanted)}; {near}"
        raise source.fail((name, "signal"), problem, wanted, list(signals.places))
    if (unit := entry.get("unit")) is not None and find_unit(unit) is None:
        problem = f"{shown(unit)} is no known unit; {nearest_names(unit, UNIT_NAMES)}"
        raise source.fail((name, "unit"), problem, unit, UNIT_NAMES)
    return wanted


def _link(
    name: str, variable: Variable, signal: str, places: tuple[Place, ...], unit_name: str | None, entry: Any,
    fail: Callable[..., Exception],
) -> Link:  # fmt: skip
    bare = signal.partition("[")[0]
    ours = split_ending(bare)[1]
    unit = find_unit(unit_name) if entry and "unit" in entry and unit_name else variable.unit
    if unit is None:
        if unit_name is not None:
            problem = f"{name} has the unit {shown(unit_name)}, which its description does not define"
            raise fail((name,), f'{problem}; give it in a map: {name} = {{ unit = "deg/s" }}', unit_name)
        unit = ours
    if unit.dimension[:3] != ours.dimension[:3]:  # angles count as numbers
        problem = f"{name} is in {unit_name}, but {signal} is in {ours.name or '1'}; these cannot be converted"
        raise fail((name,), problem, unit_name, ours.name)
    if len(places) != variable.size:
        problem = f"{name} has {variable.size} elements, but {signal} has {len(places)}"
        raise fail((name,), problem, variable.size, len(places))
    return Link(variable, signal, places, unit.factor / ours.factor, unit.offset)

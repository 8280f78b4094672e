"""An FMU given as a controller or driver, its signals, and the block that the loop calls."""

from __future__ import annotations

import functools
import itertools
import math
import os
import re
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple, get_args, get_origin, get_type_hints

from activesteer.config import Source, read_toml
from activesteer.core.conventions import CORNERS
from activesteer.core.files import is_file, shown_path, user_path, why_no_file
from activesteer.core.signals import DriverCommand, Measurement, Motion, PerWheel, Setpoint, new_message
from activesteer.core.units import UNIT_NAMES, find_unit, split_ending
from activesteer.coupling.fmu.description import Archive, Variable, describe_fmu
from activesteer.coupling.fmu.instance import FmuFault, Group, IsolatedInstance, LocalInstance, Spec
from activesteer.errors import nearest_names, shown
from activesteer.plugins import Kind, Plugin
from activesteer.plugins.file import parse_parameters
from activesteer.plugins.plugin import allowed, read_values

_NO_SIGNAL: Final = "none"
"""Signal of a map for a variable that is not used."""
_KEYS: Final = ("signal", "unit")


class Place(NamedTuple):
    """Position of a number within the messages of a block."""

    message: int  # place of the message among them
    field: int  # place of its field
    wheel: int | None  # place in a field of the four wheels; None for a single number


class Link(NamedTuple):
    """A variable of an FMU and its signal: signal = factor times element + offset."""

    variable: Variable
    signal: str  # name of the signal
    places: tuple[Place, ...]  # number of each element
    factor: float  # factor from the FMU's unit to ours
    offset: float  # offset, in our unit


class Signals(NamedTuple):
    """Signals that a set of messages contains, by name."""

    places: Mapping[str, tuple[Place, ...]]  # name -> its numbers
    others: frozenset[str]  # names of fields that are not numbers
    words: str  # the messages, in words

    def full(self, name: str) -> str | None:
        """Return the full name of a signal given with or without its unit, or None for an unknown name."""
        known = (other for other in self.places if other == name or split_ending(other)[0] == name)
        return next(known, None)


def signals_of(messages: Sequence[type[Any]]) -> Signals:
    """Return the signals of messages. A field of the wheels gives one signal of four numbers and one for each wheel."""
    # If several messages have a field, its name means the first of them; `message.field` means any of them.
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
    """Link variables with signals, and return the links and the unmatched variables."""
    links, left = [], []
    for name, variable in variables.items():
        entry = given.get(name)
        wanted = name if entry is None else _entry(name, entry, signals, source)
        if wanted == _NO_SIGNAL:
            continue
        if wanted in signals.others:
            message = f'{wanted} is not a number and cannot be a signal of an FMU; signal = "none" ignores {name}'
            raise source.fail((name,), message, wanted)
        if (signal := signals.full(wanted)) is None:
            left.append(name)
            continue
        unit_name = (entry or {}).get("unit", variable.unit_name)
        links.append(_link(name, variable, signal, signals.places[signal], unit_name, entry, source.fail))
    return links, left


def _entry(name: str, entry: Any, signals: Signals, source: Source) -> str:
    """Return the signal of a map entry."""
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
        problem = f"{shown(unit)} is not a known unit; {nearest_names(unit, UNIT_NAMES)}"
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


_LARGEST: Final = sys.float_info.max
_ANY: Final = (-_LARGEST, _LARGEST)
"""Range of a number that only has to be finite."""


class FmuBlock:
    """A driver or controller that an FMU computes; its copies share one instance and take turns with it."""

    # FMI restores a state only in the instance that saved it.

    def __init__(self, fmu: Fmu, setup: Any, parameters: Mapping[str, Any]) -> None:
        """Instantiate and initialise the FMU."""
        spec, every = fmu.spec_for(setup, parameters)
        self._fmu, self._setup, self._parameters, self._every, self._step_s = fmu, setup, parameters, every, spec.step_s
        limit_s = parameters.get(ISOLATE)
        try:
            shared = _Shared(LocalInstance(spec) if limit_s is None else IsolatedInstance(spec, limit_s))
        except FmuFault as fault:
            raise fmu.fail(str(fault)) from fault
        self._bind(shared, None, 0)

    def _bind(self, shared: _Shared, held: Any, steps: int) -> None:
        """Register with the blocks that share an instance."""
        fmu, kind = self._fmu, self._fmu.kind
        self._shared, self._block = shared, shared.new_block()
        self._held, self._steps = held, steps
        self._reads: list[Any] = [
            (*place, 1.0 / link.factor, link.offset) for link in fmu.inputs for place in link.places
        ]
        self._default: tuple[Any, ...] = tuple(kind.result())
        names = kind.result._fields
        self._writes = [
            (place.field, place.wheel, link.factor, link.offset, *kind.ranges.get(names[place.field], _ANY))
            for link in fmu.outputs
            for place in link.places
        ]
        fields = {field for field, *_ in self._writes}
        whole = (field for field in sorted(fields) if isinstance(self._default[field], int))
        self._whole = [(field, type(self._default[field])) for field in whole]
        self._unchecked = bool(kind.filled) or any(names[field] in kind.unchecked for field in fields)

    def step(self, *messages: Any) -> Any:
        """Return the command that the FMU computes (see `Controller.step` and `Driver.step`)."""
        self._steps += 1
        if self._every > 1 and (self._steps - 1) % self._every:
            return self._held
        shared = self._shared
        command: list[Any] = [*self._default]
        fmu, kind = self._fmu, self._fmu.kind
        try:
            values = []
            for message, field, wheel, factor, offset in self._reads:
                value = messages[message][field]
                values.append(((value if wheel is None else value[wheel]) - offset) * factor)
            with shared.lock:
                if shared.user != self._block:
                    shared.turn_to(self._block)
                results = shared.instance.step(values)
        except FmuFault as fault:
            raise fmu.fail(f"{fault}{self._when()}") from fault
        except TypeError as reason:
            raise self._unread(messages) from reason
        for (field, wheel, factor, offset, low, high), result in zip(self._writes, results, strict=True):
            value = result * factor + offset
            if not low <= value <= high:
                raise self._refused(results, field, value)
            if wheel is None:
                command[field] = value
            else:
                before: list[Any] = [*command[field]]
                before[wheel] = value
                command[field] = tuple(before)
        for field, whole in self._whole:
            command[field] = whole(round(command[field]))
        self._held = new_message(kind.result, command)
        if self._unchecked:
            self._held = kind.checked(self._held, fmu.path.name, self._setup)
        return self._held

    def _when(self) -> str:
        """Describe the time of the current step."""
        return f", {(self._steps - 1) // self._every * self._step_s:g} s after its initialisation"

    def _unread(self, messages: Sequence[Any]) -> Exception:
        """Return the error for an input without a value, such as the curvature of a manoeuvre that has none."""
        empty = [
            link.signal for link in self._fmu.inputs for place in link.places
            if messages[place.message][place.field] is None
        ]  # fmt: skip
        return self._fmu.fail(f"this manoeuvre gives no {' or '.join(dict.fromkeys(empty))}, which the FMU needs")

    def _refused(self, results: Sequence[float], field: int, value: float) -> Exception:
        """Return the error for an output that is not finite or is outside its range."""
        fmu, kind = self._fmu, self._fmu.kind
        if math.isfinite(value):
            try:
                command = kind.result()._replace(**{kind.result._fields[field]: value})
                kind.checked(command, fmu.path.name, self._setup)
            except kind.error as reason:
                return reason
        names = [link.variable.name for link in fmu.outputs for _ in link.places]
        bad = [f"{out} = {value!r}" for out, value in zip(names, results, strict=True) if not math.isfinite(value)]
        return fmu.fail(f"returned {', '.join(bad)}{self._when()}; finite numbers are needed", results)

    def __deepcopy__(self, _memo: dict[int, Any]) -> FmuBlock:
        other = FmuBlock.__new__(FmuBlock)
        other._fmu, other._setup, other._parameters = self._fmu, self._setup, self._parameters
        other._every, other._step_s = self._every, self._step_s
        self._call(lambda shared: other._bind(shared, self._held, self._steps))
        self._call(lambda shared: shared.states.__setitem__(other._block, shared.instance.save()))
        return other

    def __reduce__(self) -> Any:
        if not self._fmu.description.serialises_state:
            raise self._stateless("turn its state into bytes (canSerializeFMUstate), as another process needs it")

        def serialised(shared: _Shared) -> bytes:
            state = shared.instance.save()
            try:
                return shared.instance.serialise(state)
            finally:
                shared.instance.forget(state)

        content = self._call(serialised)
        return _revived, (self._fmu, self._setup, self._parameters, content, self._held, self._steps)

    def _call(self, use: Callable[[_Shared], Any]) -> Any:
        """Call a function with the shared instance, set to the state of this block."""
        if not self._fmu.description.saves_state:
            raise self._stateless("save its state (canGetAndSetFMUstate)")
        try:
            with self._shared.lock:
                self._shared.turn_to(self._block)
                return use(self._shared)
        except FmuFault as fault:
            raise self._fmu.fail(f"its state cannot be copied: {fault}") from fault

    def _stateless(self, able: str) -> Exception:
        name = shown(self._fmu.path.name)
        return self._fmu.fail(f"this FMU cannot {able}; a run with it can be neither saved nor copied: {name}")

    def __del__(self) -> None:
        if (shared := getattr(self, "_shared", None)) is not None:
            shared.gone.append(self._block)


class _Shared:
    """An instance that several blocks share, with the state of each."""

    def __init__(self, instance: LocalInstance | IsolatedInstance) -> None:
        self.instance, self.lock = instance, threading.Lock()
        self.user: int | None = None
        self.states: dict[int, int] = {}
        self.gone: list[int] = []
        self.new_block = itertools.count(1).__next__

    def turn_to(self, block: int) -> None:
        """Give the instance the state of a block."""
        while self.gone:
            last = self.gone.pop()
            if (state := self.states.pop(last, None)) is not None:
                self.instance.forget(state)
            self.user = None if self.user == last else self.user
        if self.user != block:
            if self.user is not None:
                self.states[self.user] = self.instance.save()
            if (state := self.states.pop(block, None)) is not None:
                self.instance.restore(state)
                self.instance.forget(state)
            self.user = block


def _revived(fmu: Fmu, setup: Any, parameters: Mapping[str, Any], content: bytes, held: Any, steps: int) -> FmuBlock:
    """Return a block with a state that another process has saved."""
    block = FmuBlock(fmu, setup, parameters)

    def restore(shared: _Shared) -> None:
        state = shared.instance.deserialise(content)
        shared.instance.restore(state)
        shared.instance.forget(state)

    block._call(restore)
    block._held, block._steps = held, steps
    return block


ISOLATE: Final = "isolate"
_ISOLATE_RANGE: Final = (0.001, 3600.0)
_MESSAGES: Final = {"controller": (DriverCommand, Measurement), "driver": (Setpoint, Measurement, Motion)}
"""Messages that each kind of block receives."""
_MAX_KEPT_BYTES: Final = 4_000_000
"""Largest FMU that a recording keeps. For a larger FMU, it keeps the description and the digest."""


class Fmu:
    """An FMU that can become a driver or controller of any car; `PARAMETERS` is as in `activesteer.plugins`."""

    checks_itself = True
    reads = ()

    def __init__(self, path: Path, kind: Kind) -> None:
        """Read the FMU and its map, and match its variables with our signals."""
        self.path, self.kind, self.__name__ = path, kind, path.stem
        self._archive = Archive(path, kind)
        about = self.description = describe_fmu(self._archive, kind)
        # Time between two steps of the FMU; None for every step of the simulation.
        self.interval_s = about.fixed_step_s or about.usual_step_s
        map_path = path.with_suffix(".toml")
        self.files = self._archive.kept(_MAX_KEPT_BYTES)  # kept with a recording
        given: Mapping[str, Any] = {}
        source = Source(path.name, error=kind.error)
        if is_file(map_path):
            given, source = read_toml(map_path, kind.error)
            self.files[map_path.name] = source.text.encode()
        self.inputs, self.outputs = self._matched(given, source)
        if ISOLATE in about.parameters:
            raise self.fail(f"has a parameter {ISOLATE}, a name that every FMU has already")
        single = (variable for variable in about.parameters.values() if variable.size == 1)
        self.PARAMETERS = {variable.name: _declared(variable) for variable in single}
        self.PARAMETERS[ISOLATE] = {"unit": "s", "range": _ISOLATE_RANGE}

    def _matched(self, given: Mapping[str, Any], source: Source) -> tuple[list[Link], list[Link]]:
        """Return the links of inputs and outputs, grouped by type."""
        about = self.description
        names = [*about.inputs, *about.outputs]
        for name in given:
            if name not in names:
                problem = f"{self.path.name} has no input or output {shown(name)}; {nearest_names(name, names)}"
                raise source.fail((name,), problem, name, names)
        inputs, no_input = linked(about.inputs, signals_of(_MESSAGES[self.kind.word]), given, source)
        outputs, no_output = linked(about.outputs, signals_of((self.kind.result,)), given, source)
        if no_input or no_output:
            left = {"inputs": no_input, "outputs": no_output}
            words = [f"{word} {', '.join(names)}" for word, names in left.items() if names]
            example = (*no_input, *no_output)[0]
            raise self.fail(
                f"no signals match the names of its {' and '.join(words)}; rename them, or write "
                f"{self.path.stem}.toml next to it: {example} = {{ signal = \"yaw_rate_radps\", unit = \"deg/s\" }}, "
                f"or {{ signal = \"none\" }} to ignore one",
                (*no_input, *no_output),
            )  # fmt: skip
        if not outputs:
            raise self.fail(f"has no output for an activesteer.{self.kind.result.__name__}")
        return sorted(inputs, key=_type_of), sorted(outputs, key=_type_of)

    def fail(self, problem: str, *about: Any) -> Exception:
        """Return an error about the FMU."""
        return self.kind.fail(self.path.name, problem, *about)

    def from_vehicle(self, setup: Any, **parameters: Any) -> FmuBlock:
        """Create the block of one run."""
        return FmuBlock(self, setup, parameters)

    def spec_for(self, setup: Any, parameters: Mapping[str, Any]) -> tuple[Spec, int]:
        """Return the instance for a run, and the number of steps for which its outputs are held."""
        about, every, step_s = self.description, 1, setup.timestep_s
        if self.kind.word == "driver" and self.interval_s is not None:
            every = max(1, round(self.interval_s / step_s))
            step_s *= every
        fixed_s = about.fixed_step_s
        if fixed_s is not None and (step_s < 0.999 * fixed_s or abs(step_s / fixed_s - round(step_s / fixed_s)) > 1e-6):
            problem = f"makes steps of {fixed_s:g} s; it cannot be called every {step_s:g} s"
            raise self.fail(problem, step_s, fixed_s)
        changed = [self._changed(name, value) for name, value in parameters.items() if name != ISOLATE]
        folder = self._archive.unpacked()
        resources = folder / "resources"
        resources.mkdir(exist_ok=True)
        return Spec(
            str(folder / about.library), about.version, about.token, str(resources), step_s, _grouped(self.inputs),
            _grouped(self.outputs), changed, self.path.stem,
        ), every  # fmt: skip

    def _changed(self, name: str, value: Any) -> tuple[Group, list[float]]:
        variable = self.description.parameters[name]
        return Group(variable.kind, variable.form, [variable.reference], 1), [float(value)]

    def __reduce__(self) -> Any:
        return Fmu, (self.path, self.kind)


def _declared(variable: Variable) -> dict[str, Any]:
    """Return the declaration of a parameter, with the FMU's start value and unit."""
    is_flag = variable.kind == "Boolean" and variable.start is not None
    default = bool(variable.start) if is_flag else variable.start
    return {"default": default, "range": (variable.low, variable.high), "unit": variable.unit_name or ""}


def _type_of(link: Link) -> tuple[str, str]:
    return link.variable.kind, link.variable.form


def _grouped(links: Sequence[Link]) -> list[Group]:
    """Split links, ordered by type, into groups."""
    groups = [(key, [link.variable for link in part]) for key, part in itertools.groupby(links, _type_of)]
    return [Group(*key, [v.reference for v in part], sum(v.size for v in part)) for key, part in groups]


def find_fmu(given: str | os.PathLike[str], kind: Kind) -> Plugin:
    """Read an FMU as a controller or driver.

    A file with the same name and the ending `.toml` next to it is its map: a table for each variable whose name or unit
    differs from ours, such as `r = { signal = "yaw_rate_radps", unit = "deg/s" }`.
    """
    text, _, rest = os.fspath(given).partition("?")
    path = user_path(text, kind.error)
    if not is_file(path):
        raise kind.fail(text, f"{shown_path(path)} {why_no_file(path)}")
    fmu = Fmu(path, kind)
    written = parse_parameters(rest, functools.partial(kind.fail, path.name))
    label = "-".join([path.stem, *(f"{key}={value}" for key, value in written.items() if key != ISOLATE)])
    found = Plugin(kind, os.fspath(given), re.sub(r"[^\w=.+-]+", "_", label), fmu, {}, fmu.files)
    source = Source(path.name, error=kind.error)
    return allowed(replace(found, parameters=read_values(found.declared, written, source, (kind.table, found.key))))


def isolated(given: Any, limit_s: float) -> Any:
    """Return an FMU that runs in a separate process, or any other block unchanged."""
    text = os.fspath(given) if isinstance(given, (str, os.PathLike)) else ""
    if not text.partition("?")[0].lower().endswith(".fmu"):
        return given
    return f"{text}{'&' if '?' in text else '?'}{ISOLATE}={limit_s:g}"

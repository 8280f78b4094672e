"""An FMU as a controller or driver of the loop."""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from activesteer.coupling.fmu.instance import FmuFault, Instance, Spec, make_instance
from activesteer.coupling.fmu.signals import Link
from activesteer.errors import shown
from activesteer.plugins import Kind
from activesteer.signals import new_message

_LARGEST: Final = sys.float_info.max
_ANY: Final = (-_LARGEST, _LARGEST)
"""Range of a number that only has to be finite."""


class Wiring(NamedTuple):
    """An FMU and its connection with the messages of a block.

    Attributes:
        spec: The instance.
        inputs: Links of the inputs, by type.
        outputs: Links of the outputs, by type.
        every: Steps of the block's caller between two steps of the FMU, whose outputs are held between.
        isolate_s: Time limit of a call, in a process of its own [s]; None for an instance in this process.
        keeps: Flag of an FMU that can save its state; `serialises` also turns it into bytes.
        serialises: See `keeps`.
    """

    spec: Spec
    inputs: list[Link]
    outputs: list[Link]
    every: int
    isolate_s: float | None
    keeps: bool
    serialises: bool


class FmuBlock:
    """A driver or controller that an FMU computes.

    FMI restores a state only in the instance that saved it. Copies of a block therefore share one instance and take
    turns with it.
    """

    def __init__(self, wiring: Wiring, kind: Kind, name: str, setup: Any, revive: Callable[[Any], FmuBlock]) -> None:
        """Instantiate and initialise the FMU.

        Args:
            wiring: The FMU and its connection.
            kind: Controllers or drivers.
            name: Name in messages.
            setup: Argument from which the block is made.
            revive: Function that makes such a block from `setup`, also in another process.

        Raises:
            ActiveSteerError: of the kind's type: the FMU fails.
        """
        self._about = wiring, kind, name, setup, revive
        try:
            shared = _Shared(make_instance(wiring.spec, wiring.isolate_s))
        except FmuFault as fault:
            raise kind.fail(name, str(fault)) from fault
        self._bind(shared, None, 0)

    def _bind(self, shared: _Shared, held: Any, steps: int) -> None:
        """Join the users of an instance."""
        wiring, kind, *_ = self._about
        self._shared, self._block = shared, shared.add()
        self._held, self._steps, self._every = held, steps, wiring.every
        self._reads: list[Any] = [
            (*place, 1.0 / link.factor, link.offset) for link in wiring.inputs for place in link.places
        ]
        self._default: tuple[Any, ...] = tuple(kind.result())
        names = kind.result._fields
        self._writes = [
            (place.field, place.wheel, link.factor, link.offset, *kind.ranges.get(names[place.field], _ANY))
            for link in wiring.outputs
            for place in link.places
        ]
        fields = {field for field, *_ in self._writes}
        whole = (field for field in sorted(fields) if isinstance(self._default[field], int))
        self._whole = [(field, type(self._default[field])) for field in whole]
        self._unchecked = kind.completes or any(names[field] in kind.unchecked for field in fields)

    def step(self, *messages: Any) -> Any:
        """Return the command of the FMU; see `Controller.step` and `Driver.step`.

        Raises:
            ActiveSteerError: of the kind's type: the FMU fails, or its outputs are no command.
        """
        self._steps += 1
        if self._every > 1 and (self._steps - 1) % self._every:
            return self._held
        shared = self._shared
        command: list[Any] = [*self._default]
        _, kind, name, setup, _ = self._about
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
            raise kind.fail(name, f"{fault}{self._when()}") from fault
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
            self._held = kind.checked(self._held, name, setup)
        return self._held

    def _when(self) -> str:
        """The time of the present step, in words."""
        return f", {(self._steps - 1) // self._every * self._about[0].spec.step_s:g} s after its initialisation"

    def _unread(self, messages: Sequence[Any]) -> Exception:
        """Return the error for an input without a value, such as the curvature of a manoeuvre that has none."""
        wiring, kind, name, *_ = self._about
        empty = [
            link.signal for link in wiring.inputs for place in link.places
            if messages[place.message][place.field] is None
        ]  # fmt: skip
        return kind.fail(name, f"this manoeuvre gives no {' or '.join(dict.fromkeys(empty))}, which the FMU needs")

    def _refused(self, results: Sequence[float], field: int, value: float) -> Exception:
        """Return the error for an output that is not finite or out of its range."""
        wiring, kind, name, setup, _ = self._about
        if math.isfinite(value):
            try:
                kind.checked(kind.result()._replace(**{kind.result._fields[field]: value}), name, setup)
            except kind.error as reason:
                return reason
        names = [link.variable.name for link in wiring.outputs for _ in link.places]
        bad = [f"{out} = {value!r}" for out, value in zip(names, results, strict=True) if not math.isfinite(value)]
        return kind.fail(name, f"returned {', '.join(bad)}{self._when()}; finite numbers are needed", results)

    def __deepcopy__(self, _memo: dict[int, Any]) -> FmuBlock:
        other = FmuBlock.__new__(FmuBlock)
        other._about = self._about
        self._call(lambda shared: other._bind(shared, self._held, self._steps))
        self._call(lambda shared: shared.states.__setitem__(other._block, shared.instance.save()))
        return other

    def __reduce__(self) -> Any:
        *_, revive = self._about
        if not self._about[0].serialises:
            raise self._stateless("turn its state into bytes (canSerializeFMUstate), as another process needs it")
        content = self._call(lambda shared: _serialised(shared.instance))
        return _revived, (revive, self._about[3], content, self._held, self._steps)

    def _call(self, use: Callable[[_Shared], Any]) -> Any:
        """Use the instance in the state of this block."""
        wiring, kind, name, *_ = self._about
        if not wiring.keeps:
            raise self._stateless("save its state (canGetAndSetFMUstate)")
        try:
            with self._shared.lock:
                self._shared.turn_to(self._block)
                return use(self._shared)
        except FmuFault as fault:
            raise kind.fail(name, f"its state cannot be copied: {fault}") from fault

    def _stateless(self, able: str) -> Exception:
        _, kind, name, *_ = self._about
        return kind.fail(name, f"this FMU cannot {able}; a run with it can be neither saved nor copied: {shown(name)}")

    def __del__(self) -> None:
        if (shared := getattr(self, "_shared", None)) is not None:
            shared.gone.append(self._block)


class _Shared:
    """An instance, and the states of the blocks that take turns with it."""

    def __init__(self, instance: Instance) -> None:
        self.instance, self.lock = instance, threading.Lock()
        self.user: int | None = None
        self.states: dict[int, int] = {}
        self.gone: list[int] = []
        self._blocks = 0

    def add(self) -> int:
        self._blocks += 1
        return self._blocks

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


def _serialised(instance: Instance) -> bytes:
    state = instance.save()
    try:
        return instance.serialise(state)
    finally:
        instance.forget(state)


def _revived(revive: Callable[[Any], FmuBlock], setup: Any, content: bytes, held: Any, steps: int) -> FmuBlock:
    """Return a block in a state that another process has saved."""
    block = revive(setup)

    def restore(shared: _Shared) -> None:
        state = shared.instance.deserialise(content)
        shared.instance.restore(state)
        shared.instance.forget(state)

    block._call(restore)
    block._held, block._steps = held, steps
    return block

"""An instance of an FMU, called through function pointers, in this process or in a separate one.

This file imports no library, because every isolated instance waits for the start of its process.
"""

from __future__ import annotations

import ctypes
import functools
import json
import os
import struct
import weakref
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from activesteer.core.child_process import Child, ChildFault

_WARNING: Final = 1
_FATAL: Final = 4
_STATUS: Final = {2: "discard", 3: "error", 4: "fatal", 5: "pending"}
_P, _I, _D, _N, _B, _S = (
    ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_size_t, ctypes.c_bool, ctypes.c_char_p,
)  # fmt: skip
_MAX_STATE_BYTES: Final = 1 << 30
_MAX_LOG: Final = 300
_MAX_TEXT_BYTES: Final = 2**16
"""Longest error text of an isolated FMU [bytes]."""
_MAX_DIGITS: Final = 20
START_LIMIT_S: Final = 30.0
"""Shortest time limit for an isolated FMU to load and initialise [s]."""


class FmuFault(Exception):  # noqa: N818 - a fault of the FMU
    """Failure of an FMU, described in the message."""


class Group(NamedTuple):
    """Variables of one type, which one call sets or gets."""

    kind: str  # type in the names of FMI's functions
    form: str  # format of `struct` of an element
    references: list[int]  # value references
    size: int  # number of elements of all variables together


class Spec(NamedTuple):
    """Inputs for the creation of an instance."""

    library: str  # path of the shared library
    version: int  # 2 or 3
    token: str  # GUID or instantiation token
    resources: str  # path of the resources
    step_s: float  # time between two steps [s]
    inputs: list[Group]  # inputs, group by group
    outputs: list[Group]  # outputs, group by group
    # Parameters that differ from their start values, group by group, with their values
    parameters: list[tuple[Group, list[float]]]
    name: str  # name of the instance


class _Buffer:
    """Memory of a group: references and elements at fixed addresses."""

    def __init__(self, group: Group) -> None:
        self._references = (ctypes.c_uint32 * len(group.references))(*group.references)
        form = struct.Struct(f"={group.size}{group.form}")
        self._pack, self.unpack = form.pack_into, form.unpack_from
        self.memory, self.size = ctypes.create_string_buffer(max(1, form.size)), group.size
        self._is_whole = group.form not in "df"
        self.arguments = (ctypes.addressof(self._references), len(group.references), ctypes.addressof(self.memory))

    def put(self, values: Sequence[float]) -> None:
        self._pack(self.memory, 0, *(map(round, values) if self._is_whole else values))


class LocalInstance:
    """An instance in this process."""

    def __init__(self, spec: Spec) -> None:
        """Load the library, instantiate and initialise."""
        self._spec, self._steps, self._step_s, self._log = spec, 0, spec.step_s, ""
        self._flags: Any = None
        self._prefix = f"fmi{spec.version}"
        try:
            self._library = ctypes.CDLL(spec.library)
        except OSError as reason:
            raise FmuFault(f"its library cannot be loaded: {reason}") from reason
        self._states: dict[int, Any] = {}
        self._component = self._instantiated()
        self._finalizer = weakref.finalize(
            self, _free, self._function("Terminate", _P), self._function("FreeInstance", _P, result=None),
            self._component,
        )  # fmt: skip
        self._initialise()
        self._sets = [self._access("Set", group) for group in spec.inputs]
        self._gets = [self._access("Get", group) for group in spec.outputs]
        if spec.version == 2:
            self._do_step = self._function("DoStep", _P, _D, _D, _I)
            self._last: tuple[Any, ...] = (1,)
        else:
            self._do_step = self._function("DoStep", _P, _D, _D, _B, _P, _P, _P, _P)
            self._flags, self._time = (ctypes.c_bool * 3)(), ctypes.c_double()  # event, end, early return
            at = ctypes.addressof(self._flags)
            self._last = (False, at, at + 1, at + 2, ctypes.addressof(self._time))

    def step(self, values: Sequence[float]) -> tuple[float, ...]:
        """Set the inputs, advance by one step, and return the outputs."""
        first = 0
        for call, buffer in self._sets:
            size = buffer.size
            buffer.put(values if size == len(values) else values[first : first + size])
            first += size
            if (status := call()) > _WARNING:
                raise self._failed("Set", status)
        status = self._do_step(self._component, self._steps * self._step_s, self._step_s, *self._last)
        if status > _WARNING:
            raise self._failed("DoStep", status)
        if self._flags is not None and any(self._flags[1:]):
            what = "asks to end the simulation" if self._flags[1] else "returned early from its step"
            raise FmuFault(f"{what}{self._words()}")
        self._steps += 1
        result: tuple[float, ...] = ()
        for call, buffer in self._gets:
            if (status := call()) > _WARNING:
                raise self._failed("Get", status)
            result += buffer.unpack(buffer.memory)
        return result

    def save(self) -> int:
        """Save the state, and return its number."""
        state = ctypes.c_void_p()
        self._must(f"Get{self._state}", (_P,), ctypes.byref(state))
        return self._kept(state, self._steps)

    def restore(self, state: int) -> None:
        """Return to a saved state."""
        pointer, self._steps = self._states[state]
        self._must(f"Set{self._state}", (_P,), pointer)

    def forget(self, state: int) -> None:
        """Free a saved state."""
        pointer, _ = self._states.pop(state)
        if self._finalizer.alive:
            self._function(f"Free{self._state}", _P, _P)(self._component, ctypes.byref(pointer))

    def serialise(self, state: int) -> bytes:
        """Return a saved state as bytes."""
        (pointer, steps), size = self._states[state], ctypes.c_size_t()
        name = "SerializedFMUstateSize" if self._spec.version == 2 else "SerializedFMUStateSize"
        self._must(name, (_P, _P), pointer, ctypes.byref(size))
        if size.value > _MAX_STATE_BYTES:
            raise FmuFault(f"reports a state of {size.value} bytes")
        content = ctypes.create_string_buffer(max(1, size.value))
        self._must(f"Serialize{self._state}", (_P, _P, _N), pointer, content, size)
        return struct.pack("=q", steps) + content.raw[: size.value]

    def deserialise(self, content: bytes) -> int:
        """Restore a saved state from bytes, and return its number."""
        (steps,), state = struct.unpack_from("=q", content), ctypes.c_void_p()
        name = "DeSerializeFMUstate" if self._spec.version == 2 else "DeserializeFMUState"
        self._must(name, (_S, _N, _P), content[8:], len(content) - 8, ctypes.byref(state))
        return self._kept(state, steps)

    @property
    def _state(self) -> str:
        """Return the name of a state in the FMI functions."""
        return "FMUstate" if self._spec.version == 2 else "FMUState"

    def _kept(self, state: Any, steps: int) -> int:
        number = max(self._states, default=0) + 1
        self._states[number] = state, steps
        return number

    def _function(self, name: str, *arguments: Any, result: Any = _I) -> Any:
        try:
            return ctypes.CFUNCTYPE(result, *arguments)((f"{self._prefix}{name}", self._library))
        except AttributeError:
            raise FmuFault(f"its library has no function {self._prefix}{name}") from None

    def _access(self, word: str, group: Group) -> tuple[Any, _Buffer]:
        """Return the function and the memory that set or get a group."""
        buffer = _Buffer(group)
        sizes = () if self._spec.version == 2 else (group.size,)
        call = self._function(f"{word}{group.kind}", _P, _P, _N, _P, *(_N for _ in sizes))
        return functools.partial(call, self._component, *buffer.arguments, *sizes), buffer

    def _instantiated(self) -> int:
        """Return the address of a new instance."""
        spec, name, token = self._spec, self._spec.name.encode(), self._spec.token.encode()
        if spec.version == 2:
            self._logger: Any = ctypes.CFUNCTYPE(None, _P, _S, _I, _S, _S)(self._said)
            libc = ctypes.CDLL(None)
            addresses = [ctypes.cast(part, _P).value for part in (self._logger, libc.calloc, libc.free)]
            self._callbacks = (_P * 5)(*addresses, None, None)  # two more: asynchronous steps, environment
            make = self._function("Instantiate", _S, _I, _S, _S, _P, _I, _I, result=_P)
            resources = f"file://{spec.resources}".encode()
            component = make(name, 1, token, resources, ctypes.byref(self._callbacks), 0, 0)
        else:
            self._logger = ctypes.CFUNCTYPE(None, _P, _I, _S, _S)(self._said)
            make = self._function("InstantiateCoSimulation", _S, _S, _S, _B, _B, _B, _B, _P, _N, _P, _P, _P, result=_P)
            logger = ctypes.cast(self._logger, _P)
            resources = os.path.join(spec.resources, "").encode()
            component = make(name, token, resources, False, False, False, False, None, 0, None, logger, None)
        if not component:
            hint = f" (its description has the token {spec.token}, which the library may not know)"
            raise FmuFault(f"cannot be instantiated{self._words() or hint}")
        return component

    def _initialise(self) -> None:
        """Set the parameters and initialise."""
        spec = self._spec
        if spec.version == 2:
            self._must("SetupExperiment", (_I, _D, _D, _I, _D), 0, 0.0, 0.0, 0, 0.0)
        for group, values in spec.parameters:
            call, buffer = self._access("Set", group)
            buffer.put(values)
            if (status := call()) > _WARNING:
                raise self._failed("Set (of its parameters)", status)
        if spec.version == 2:
            self._must("EnterInitializationMode", ())
        else:
            self._must("EnterInitializationMode", (_B, _D, _D, _B, _D), False, 0.0, 0.0, False, 0.0)
        self._must("ExitInitializationMode", ())

    def _must(self, name: str, types: Sequence[Any], *arguments: Any) -> None:
        """Call a function, and raise an error if it fails."""
        status = self._function(name, _P, *types)(self._component, *arguments)
        if status > _WARNING:
            raise self._failed(name, status)

    def _failed(self, call: str, status: int) -> FmuFault:
        if status == _FATAL:
            self._finalizer.detach()  # not even the memory of the instance may be touched
        word = _STATUS.get(status, f"status {status}")
        return FmuFault(f"{self._prefix}{call} returned {word}{self._words()}")

    def _words(self) -> str:
        return f": {self._log[:_MAX_LOG]}" if self._log else ""

    def _said(self, *message: Any) -> None:
        """Store a log message, which is the last argument in both versions."""
        self._log = (message[-1] or b"").decode(errors="replace")


def _free(terminate: Any, free: Any, component: int) -> None:
    terminate(component)
    free(component)


_STEP, _SAVE, _RESTORE, _FORGET, _SERIALISE, _DESERIALISE = b"S", b"G", b"R", b"F", b"Z", b"D"
_GOOD, _BAD = b"0", b"E"


class IsolatedInstance:
    """An instance in a separate process, which may crash or hang without harm to this one."""

    def __init__(self, spec: Spec, limit_s: float) -> None:
        """Start the process, and initialise the FMU in it."""
        self._limit_s, self._step_s, self._steps = limit_s, spec.step_s, 0
        self._child = Child(__file__)
        self._step_bytes = 8 * sum(group.size for group in spec.outputs)
        self._unpack = struct.Struct(f"={self._step_bytes // 8}d").unpack
        self._ask(json.dumps(spec).encode(), "its initialisation", limit_s=max(limit_s, START_LIMIT_S))

    def step(self, values: Sequence[float]) -> tuple[float, ...]:
        """Advance the FMU in its process (see `LocalInstance.step`)."""
        doing = f"the step at {self._steps * self._step_s:g} s"
        answer = self._ask(_STEP + struct.pack(f"={len(values)}d", *values), doing, self._step_bytes)
        if len(answer) != self._step_bytes:
            raise self._nonsense(doing, answer)
        self._steps += 1
        return self._unpack(answer)

    def save(self) -> int:
        """Save the state in the process, and return its number."""
        return self._number(_SAVE)

    def restore(self, state: int) -> None:
        """Return to a state that the process has saved."""
        self._ask(_RESTORE + str(state).encode())

    def forget(self, state: int) -> None:
        """Free a state that the process has saved, if the process is alive."""
        if self._child.alive:
            self._ask(_FORGET + str(state).encode())

    def serialise(self, state: int) -> bytes:
        """Return the bytes of a state that the process has saved."""
        return self._ask(_SERIALISE + str(state).encode(), most_bytes=_MAX_STATE_BYTES)

    def deserialise(self, content: bytes) -> int:
        """Give the process a state as bytes, and return its number there."""
        return self._number(_DESERIALISE + content)

    def _number(self, request: bytes) -> int:
        answer = self._ask(request)
        if not (answer.isdigit() and len(answer) < _MAX_DIGITS):
            raise self._nonsense("a call", answer)
        return int(answer)

    def _nonsense(self, doing: str, answer: bytes) -> FmuFault:
        self._child.close()
        return FmuFault(f"returns invalid data during {doing}: {answer[:_MAX_DIGITS]!r}")

    def _ask(self, request: bytes, doing: str = "a call", most_bytes: int = 0, limit_s: float | None = None) -> bytes:
        try:
            answer = self._child.ask(request, doing, limit_s or self._limit_s, most_bytes + _MAX_TEXT_BYTES)
        except ChildFault as fault:
            raise FmuFault(f"{fault} (isolate)") from fault
        if answer[:1] == _BAD:
            raise FmuFault(answer[1:].decode(errors="replace"))
        if answer[:1] != _GOOD:
            raise self._nonsense(doing, answer)
        return answer[1:]


def _spec(text: bytes) -> Spec:
    spec = Spec(*json.loads(text))
    inputs, outputs = ([Group(*group) for group in groups] for groups in (spec.inputs, spec.outputs))
    parameters = [(Group(*group), values) for group, values in spec.parameters]
    return spec._replace(inputs=inputs, outputs=outputs, parameters=parameters)


def make_answerer() -> Callable[[bytes], bytes]:
    """Return a function that answers the requests of an `IsolatedInstance`, in the process of `Child`."""
    instances: list[LocalInstance] = []

    def done(request: bytes) -> bytes:
        if not instances:
            instances.append(LocalInstance(_spec(request)))
            return b""
        (instance,), word, rest = instances, request[:1], request[1:]
        if word == _STEP:
            result = instance.step(struct.unpack(f"={len(rest) // 8}d", rest))
            return struct.pack(f"={len(result)}d", *result)
        if word == _SAVE:
            return str(instance.save()).encode()
        if word == _SERIALISE:
            return instance.serialise(int(rest))
        if word == _DESERIALISE:
            return str(instance.deserialise(rest)).encode()
        {_RESTORE: instance.restore, _FORGET: instance.forget}[word](int(rest))
        return b""

    def answer(request: bytes) -> bytes:
        try:
            return _GOOD + done(request)
        except FmuFault as fault:
            return _BAD + str(fault).encode()

    return answer

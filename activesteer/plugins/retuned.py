"""Change of parameters of a block that keeps its memory.

A block is compared with one that was just made with the old parameters. A value that is still the same follows from the
parameters, and the value of a block made with the new ones replaces it. A value that has changed since is memory
(filters, integrators, counters), and is kept. A class names values that it computes from parameters on the way, such as
a schedule of gains, in its attribute `derived`; they are dropped.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any, Final

import numpy as np

_WHOLE: Final = (type, ModuleType, FunctionType, BuiltinFunctionType, MethodType)
"""Kinds of objects without a separate memory."""


def retuned(running: Any, before: Any, after: Any) -> Any:
    """Return a block with new parameters and the memory of a running block."""
    return _kept(running, before, after, set())


def _kept(running: Any, before: Any, after: Any, seen: set[int]) -> Any:
    if id(after) in seen or same(running, before):
        return after
    if not type(running) is type(after) is type(before):
        return running if same(before, after) else after
    if isinstance(running, np.ndarray):
        if running.shape == after.shape and running.dtype == after.dtype:
            after[...] = running  # in place, since other parts may hold views
        return after
    found = running
    if isinstance(running, deque):
        found = deque(running, maxlen=after.maxlen)
    elif isinstance(running, dict):
        found = _kept_parts(running, before, after, seen)
    elif not isinstance(running, _WHOLE) and _attributes(running):
        seen.add(id(after))
        _fill(running, before, after, seen)
        found = after
    return found


def _fill(running: Any, before: Any, after: Any, seen: set[int]) -> None:
    """Copy the internal state of a running block to the block with new parameters."""
    old, made, new_state = (_state(block) for block in (running, before, after))
    derived = getattr(type(running), "derived", ())
    new = {name: value for name, value in _kept_parts(old, made, new_state, seen).items() if name not in derived}
    if hasattr(after, "__setstate__"):
        after.__setstate__({**new_state, **new})
        return
    for name, value in new.items():
        object.__setattr__(after, name, value)


def _kept_parts(
    running: Mapping[Any, Any], before: Mapping[Any, Any], after: Mapping[Any, Any], seen: set[int]
) -> dict[Any, Any]:
    return {
        key: _kept(value, before[key], after[key], seen) if key in before and key in after else value
        for key, value in running.items()
    }


def _state(block: Any) -> dict[str, Any]:
    """Return the attributes of a block, or its state if it has `__setstate__`."""
    if hasattr(block, "__setstate__"):
        return block.__getstate__()
    return {name: getattr(block, name) for name in _attributes(block)}


def same(one: Any, other: Any, seen: frozenset[tuple[int, int]] = frozenset()) -> bool:
    """Return whether two values are equal, compared recursively."""
    pair = id(one), id(other)
    if one is other or pair in seen:
        return True
    if type(one) is not type(other):
        return False
    parts = [_parts(value) for value in (one, other)]
    if parts[0] is not None and parts[1] is not None:
        inner = seen | {pair}
        return parts[0].keys() == parts[1].keys() and all(same(parts[0][n], parts[1][n], inner) for n in parts[0])
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    try:
        return bool(one == other) or (one != one and other != other)  # noqa: PLR0124 - not a number
    except Exception:
        return False


def _parts(value: Any) -> Mapping[Any, Any] | None:
    """Return the members of a container or an object, or None for a simple value."""
    if isinstance(value, dict):
        return value
    if isinstance(value, list | tuple | deque):
        return dict(enumerate(value))
    return None if isinstance(value, (*_WHOLE, np.ndarray)) or not _attributes(value) else _state(value)


def _attributes(thing: Any) -> list[str]:
    """Return the names of the attributes stored in an object itself."""
    slots = [name for kind in type(thing).__mro__ for name in getattr(kind, "__slots__", ()) if name != "__dict__"]
    found = [*getattr(thing, "__dict__", ()), *(slots if not isinstance(thing, tuple) else ())]
    return [name for name in found if not name.startswith("__") and hasattr(thing, name)]

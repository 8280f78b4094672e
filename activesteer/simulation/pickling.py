"""Pickling of simulations: classes of a user's file are found by name, and every failure is a typed error."""

from __future__ import annotations

import io
import operator
import pickle
import sys
from typing import Any

from activesteer.errors import ActiveSteerError, ParameterError
from activesteer.plugins import in_one_line, is_user_module


class _Pickler(pickle.Pickler):
    def reducer_override(self, obj: Any) -> Any:
        # Loading a file again creates new classes under the same names, which pickle would refuse.
        if isinstance(obj, type) and is_user_module(obj.__module__):
            return _class, (obj.__module__, obj.__qualname__)
        return NotImplemented


def _class(module: str, name: str) -> Any:
    return operator.attrgetter(name)(sys.modules[module])


def pickled(portable: Any) -> bytes:
    """Pickle the inputs and the state of a simulation."""
    buffer = io.BytesIO()
    try:
        _Pickler(buffer, pickle.HIGHEST_PROTOCOL).dump(portable)
    except Exception as reason:
        raise ParameterError(f"this simulation cannot be pickled: {in_one_line(reason)}") from reason
    return buffer.getvalue()


def unpickled(kind: Any, content: bytes) -> Any:
    """Create a simulation from its pickled inputs and state.

    Args:
        kind: Class of the simulation.
        content: Return value of `pickled`.
    """
    try:
        portable = pickle.loads(content)
    except ActiveSteerError:
        raise
    except Exception as reason:
        raise ParameterError(f"this simulation cannot be unpickled: {in_one_line(reason)}") from reason
    return kind._rebuilt(portable)

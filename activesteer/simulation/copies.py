"""Base of running objects that can be copied and pickled by their inputs and state."""

from __future__ import annotations

import io
import operator
import pickle
import sys
from typing import Any, Self

from activesteer.errors import ActiveSteerError, ParameterError
from activesteer.plugins import in_one_line, is_user_module


class Copyable:
    """Base of objects that are copied as inputs and state, and rebuilt from them."""

    def _portable(self) -> Any:
        """Return inputs and state, without native memory."""
        raise NotImplementedError

    def _rebuild(self, portable: Any) -> None:
        """Restore the object that `_portable` describes."""
        raise NotImplementedError

    @classmethod
    def _rebuilt(cls, portable: Any) -> Self:
        other = cls.__new__(cls)
        other._rebuild(portable)
        return other

    def copy(self) -> Self:
        """Return an independent copy that continues bit-identically.

        The copy builds its cars and lets them settle again, which takes as long as creating them.

        Raises:
            ManeuverError: the run failed, or is being driven.
            RecordingError: the run is being written to a file.
            ActiveSteerError: your own driver or controller cannot be copied.
        """
        return self._rebuilt(self._portable())

    def __copy__(self) -> Self:
        return self.copy()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self.copy()

    def __reduce_ex__(self, _protocol: Any) -> tuple[Any, ...]:
        buffer, portable = io.BytesIO(), self._portable()
        try:
            _Pickler(buffer, pickle.HIGHEST_PROTOCOL).dump(portable)
        except Exception as reason:
            raise ParameterError(f"this simulation cannot be pickled: {in_one_line(reason)}") from reason
        return _unpickled, (type(self), buffer.getvalue())


def _unpickled(kind: Any, content: bytes) -> Any:
    try:
        return kind._rebuilt(pickle.loads(content))
    except ActiveSteerError:
        raise
    except Exception as reason:
        raise ParameterError(f"this simulation cannot be unpickled: {in_one_line(reason)}") from reason


class _Pickler(pickle.Pickler):
    def reducer_override(self, obj: Any) -> Any:
        # Loading a file again creates new classes under the same names, which pickle would refuse.
        if isinstance(obj, type) and is_user_module(obj.__module__):
            return _class, (obj.__module__, obj.__qualname__)
        return NotImplemented


def _class(module: str, name: str) -> Any:
    return operator.attrgetter(name)(sys.modules[module])

"""Mark of the functions that Python and compiled code share.

`compilation` registers them for compiled code.

The mark needs no compiler, so that lists of controllers and the help do without one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar

_Function = TypeVar("_Function", bound=Callable[..., Any])

MARKED: Final[list[Callable[..., Any]]] = []
"""Functions that compiled code does not know yet."""


def shared(function: _Function) -> _Function:
    """Decorate a Python function that compiled code may call.

    Python still calls it as is.

    The function is the law of a block. Its first argument is the block itself in Python, and a record of the block's
    attributes in compiled code; see `native.records`.
    """
    MARKED.append(function)
    return function


def law_of(kind: type[Any]) -> Callable[[_Function], _Function]:
    """Decorate a function of block, command and measurement as the law of a kind of controller.

    It returns the first fields of an `ActuatorCommand`, and compiled code then carries the controller out.
    """

    def decorate(function: _Function) -> _Function:
        kind.law = staticmethod(function)
        return shared(function)

    return decorate

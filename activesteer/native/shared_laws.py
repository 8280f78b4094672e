"""Mark of the functions that Python and compiled code share, without the compiler that registers them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar

_Function = TypeVar("_Function", bound=Callable[..., Any])

MARKED: Final[list[Callable[..., Any]]] = []
"""Functions that compiled code does not know yet."""


def shared(function: _Function) -> _Function:
    """Decorate a Python function, the law of a block, that compiled code may call with a record of the block."""
    MARKED.append(function)
    return function


def law_of(kind: type[Any]) -> Callable[[_Function], _Function]:
    """Decorate a law: it maps block, command and measurement to the first fields of `ActuatorCommand`."""

    def decorate(function: _Function) -> _Function:
        kind.law = staticmethod(function)
        return shared(function)

    return decorate

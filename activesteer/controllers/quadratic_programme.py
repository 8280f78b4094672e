"""The solver of small quadratic programmes, which is an extra of the package."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ControllerError, not_installed

Solve = Callable[[Array, Array, Array, Array, Array], Array]
"""x that makes x' H x / 2 + f' x least; H, f, A, lower, upper: the first bounds are those of x, the rest those of A
x."""


def solver() -> Solve:
    """DAQP's dual active-set method, cold in every call, so that a controller has no state in it.

    Raises:
        ControllerError: it is not installed.
    """
    try:
        import daqp  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise not_installed(ControllerError, "this controller", "daqp", "control") from error
    solve_once: Any = daqp.solve

    def solve(h: Array, f: Array, a: Array, lower: Array, upper: Array) -> Array:
        x, _, flag, _ = solve_once(h, f, a, upper, lower, np.zeros(len(upper), dtype=np.int32))
        if flag <= 0:
            raise ControllerError(f"DAQP finds no solution (exit flag {flag})")
        return x

    return solve

"""The solver of small quadratic programmes, an extra of the package."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ControllerError, not_installed

Solve = Callable[[Array, Array, Array, Array, Array], Array]
"""Function from H, f, A, lower and upper to the x that minimises x' H x / 2 + f' x; first the bounds of x,
then the bounds of A x."""


def solver() -> Solve:
    """Return the dual active-set method of DAQP, with a cold start in every call so that it has no state.

    Raises:
        ControllerError: DAQP is not installed.
    """
    try:
        import daqp  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise not_installed(ControllerError, "this controller", "daqp", "control") from error
    return functools.partial(_solve, daqp.solve)


def _solve(solve_once: Any, h: Array, f: Array, a: Array, lower: Array, upper: Array) -> Array:
    x, _, flag, _ = solve_once(h, f, a, upper, lower, np.zeros(len(upper), dtype=np.int32))
    if flag <= 0:
        raise ControllerError(f"DAQP finds no solution (exit flag {flag})")
    return x

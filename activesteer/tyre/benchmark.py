"""Time of one evaluation of a tyre: a compiled scalar call, and a row of the vectorised call."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

import numpy as np

from activesteer.compilation import compiled
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.kernels.magic_formula import magic_formula
from activesteer.tyre.tyre_parameters import TyreParameters

_CALLS: Final = 100_000
_ROUNDS: Final = 5
"""Each figure is the best of this many rounds, since disturbances only slow a machine down."""


@compiled
def _scalar_calls(tyre, count, pressure_Pa):
    """Return the sum of all five outputs of `count` scalar calls with different inputs."""
    p, total = tyre[0], 0.0
    for index in range(count):
        # Small changes, so that the compiler cannot omit a call or move it out of the loop.
        fraction = (index % 1000) * 0.001
        fx, fy, mx, my, mz = magic_formula(
            p, 3000.0 + 2000.0 * fraction, 0.1 * fraction - 0.05, 0.08 - 0.16 * fraction, 0.02, pressure_Pa, 20.0, 0.9
        )
        total += fx + fy + mx + my + mz
    return total


def bench(params: TyreParameters, rounds: int = _ROUNDS) -> dict[str, float]:
    """Measure the full evaluation (combined slip with camber, all five outputs) on one core."""
    record, pressure = np.atleast_1d(params.record), params["INFLPRES"]
    rng = np.random.default_rng(0)
    rows = [rng.uniform(low, high, _CALLS) for low, high in ((500, 8000), (-0.2, 0.2), (-0.2, 0.2), (-0.05, 0.05))]
    formula = MagicFormula(params)
    single_calls = _CALLS // 100

    def single() -> None:
        for _ in range(single_calls):
            formula.evaluate(4000.0, 0.05, 0.04, 0.02)

    return {
        "scalar_us": _best_us(lambda: _scalar_calls(record, _CALLS, pressure), _CALLS, rounds),
        "vectorised_us_per_row": _best_us(lambda: formula.evaluate(*rows), _CALLS, rounds),
        "python_call_us": _best_us(single, single_calls, rounds),
    }


def _best_us(function: Callable[[], object], count: int, rounds: int) -> float:
    function()
    best = float("inf")
    for _ in range(rounds):
        start = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - start)
    return best / count * 1e6

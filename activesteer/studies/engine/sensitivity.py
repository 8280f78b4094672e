"""Sensitivity of a metric to the factors: Sobol' and Morris indices by SALib, with confidence intervals.

A Saltelli design gives first-order and total indices (Saltelli et al. 2010), a Morris design mean and spread of
elementary effects (Campolongo et al. 2007), and any other sample the first-order indices by RBD-FAST (Tarantola et al.
2006), which needs no design of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import StudyError, not_installed
from activesteer.studies.engine.design import FOR_INDICES, MORRIS_LEVELS
from activesteer.studies.engine.factors import Factor

MAX_SAMPLES: Final = 16384
"""Largest number of rows used: more rows change the indices by less than their confidence intervals."""
_MAX_RBD_SAMPLES: Final = 4096
_RBD_RESAMPLES: Final = 30
_MIN_SAMPLES: Final = 42
"""Smallest number of rows for RBD-FAST: it compares 2 * 10 harmonics, also in each half of the samples that its
confidence interval draws, so a half needs more than 20."""


class Index(NamedTuple):
    """An index of one factor.

    Attributes:
        factor: Its key.
        name: `S1`, `ST`, or `mu*`.
        value: The index; `mu*` is in the unit of the metric.
        confidence: Half width of its 95 % confidence interval.
        spread: Standard deviation of the elementary effects (Morris); nan for others.
    """

    factor: str
    name: str
    value: float
    confidence: float
    spread: float = np.nan


def indices(
    kind: str, factors: Sequence[Factor], columns: Mapping[str, Sequence[object]], values: NDArray[np.float64]
) -> list[Index]:
    """Return the indices of one metric of one controller in one manoeuvre with one vehicle.

    Columns and values are in the order of the design. There are no indices for a grid or a list, for failed runs in a
    design that needs all of them, or for a metric that does not vary.
    """
    finite = np.isfinite(values)
    discrete = kind in ("grid", "list") or any(factor.kind in ("grid", "choice") for factor in factors)
    if discrete or not finite.any() or np.ptp(values[finite]) == 0.0:
        return []
    if kind in FOR_INDICES and not finite.all():
        return []
    keys = [factor.key for factor in factors]
    points = np.column_stack([np.asarray(columns[key], dtype=np.float64) for key in keys])
    # Scale to the whole range of each factor, so that factors of different units can be compared.
    unit = (points - [factor.low for factor in factors]) / [factor.high - factor.low for factor in factors]
    problem = {"num_vars": len(keys), "names": keys, "bounds": [[0.0, 1.0]] * len(keys)}
    try:
        return _computed(kind, problem, unit, values)
    except ImportError as reason:
        raise not_installed(StudyError, "a sensitivity index", "SALib", "study") from reason


def _computed(
    kind: str, problem: dict[str, Any], unit: NDArray[np.float64], values: NDArray[np.float64]
) -> list[Index]:
    from SALib.analyze import morris, rbd_fast, sobol  # noqa: PLC0415 - an extra

    keys = problem["names"]
    if kind == "saltelli":
        block = len(keys) + 2
        used = values[: block * (1 << ((len(values) // block).bit_length() - 1))]
        # The estimators assume a metric around zero.
        found = sobol.analyze(problem, (used - used.mean()) / used.std(), calc_second_order=False, seed=0)
        return [
            Index(key, name, float(found[name][place]), float(found[f"{name}_conf"][place]))
            for name in ("S1", "ST")
            for place, key in enumerate(keys)
        ]
    if kind == "morris":
        whole = len(values) // (len(keys) + 1) * (len(keys) + 1)
        unit, values = unit[:whole], values[:whole]
        found = morris.analyze(problem, unit, values, num_levels=MORRIS_LEVELS, seed=0)
        return [
            Index(key, "mu*", *(float(found[name][place]) for name in ("mu_star", "mu_star_conf", "sigma")))
            for place, key in enumerate(keys)
        ]
    finite = np.isfinite(values)
    rows = np.flatnonzero(finite)[:_MAX_RBD_SAMPLES]
    if len(rows) < _MIN_SAMPLES:
        return []
    found = rbd_fast.analyze(problem, unit[rows], values[rows], num_resamples=_RBD_RESAMPLES, seed=0)
    return [
        Index(key, "S1", float(found["S1"][place]), float(found["S1_conf"][place])) for place, key in enumerate(keys)
    ]

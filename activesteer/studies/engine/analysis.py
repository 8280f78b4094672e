"""Analysis of a study's rows: sensitivities, and factors without an effect.

A Saltelli design gives first-order and total indices (Saltelli et al. 2010), a Morris design mean and spread of
elementary effects (Campolongo et al. 2007), and any other sample the first-order indices by RBD-FAST (Tarantola et al.
2006), which needs no special design.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import StudyError, not_installed
from activesteer.studies.engine.design import FOR_INDICES, MORRIS_LEVELS
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.runs import Row, Status, drive
from activesteer.studies.engine.store import IDENTITY, OUTCOME
from activesteer.studies.engine.study_file import Place

MAX_SAMPLES: Final = 16384
"""Largest number of rows used: more rows change the indices by less than their confidence intervals."""
_MAX_RBD_SAMPLES: Final = 4096
_RBD_RESAMPLES: Final = 30
_MIN_SAMPLES: Final = 42
"""Smallest number of rows for RBD-FAST: 2 * 10 harmonics need more than 20, also in each half of the samples."""


class Index(NamedTuple):
    """Sensitivity index of one factor."""

    factor: str
    name: str  # `S1`, `ST`, or `mu*`
    value: float  # the index; `mu*` is in the unit of the metric
    confidence: float  # half width of its 95 % confidence interval
    spread: float = np.nan  # standard deviation of the elementary effects (Morris); nan for others


def indices(
    kind: str, factors: Sequence[Factor], columns: Mapping[str, Sequence[object]], values: NDArray[np.float64]
) -> list[Index]:
    """Return the sensitivity indices of one metric in one manoeuvre with one vehicle and controller."""
    # There are none for a grid or a list, failed runs in a design that needs all, or a metric that does not vary.
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
        from SALib.analyze import morris, rbd_fast, sobol  # noqa: PLC0415 - an extra
    except ImportError as reason:
        raise not_installed(StudyError, "a sensitivity index", "SALib", "study") from reason
    names: dict[str, tuple[str, ...]] = {"S1": ("S1", "S1_conf")}
    if kind == "saltelli":
        block = len(keys) + 2
        used = values[: block * (1 << ((len(values) // block).bit_length() - 1))]
        # The estimators assume a metric around zero.
        found = sobol.analyze(problem, (used - used.mean()) / used.std(), calc_second_order=False, seed=0)
        names["ST"] = ("ST", "ST_conf")
    elif kind == "morris":
        whole = len(values) // (len(keys) + 1) * (len(keys) + 1)
        found = morris.analyze(problem, unit[:whole], values[:whole], num_levels=MORRIS_LEVELS, seed=0)
        names = {"mu*": ("mu_star", "mu_star_conf", "sigma")}
    else:
        rows = np.flatnonzero(finite)[:_MAX_RBD_SAMPLES]
        if len(rows) < _MIN_SAMPLES:
            return []
        found = rbd_fast.analyze(problem, unit[rows], values[rows], num_resamples=_RBD_RESAMPLES, seed=0)
    return [
        Index(key, name, *(float(found[column][place]) for column in columns))
        for name, columns in names.items()
        for place, key in enumerate(keys)
    ]


MAX_ROWS: Final = 20_000
"""Largest number of rows to compare."""

Point = tuple[Any, ...]
"""Values of all factors."""


def without_effect(plan: Plan, rows: Iterable[Row]) -> list[str]:
    """Return the factors whose change leaves every metric of every run bit-identical."""
    # Rows that differ in one factor only are compared. If there are none, as in a random sample, the first sample is
    # driven again with the ends of the factor's range.
    keys = plan.study.keys
    known: dict[Place, dict[Point, str]] = {}
    for row in rows:
        if row["status"] == Status.OK:
            known.setdefault(plan.study.place_of(row), {})[tuple(row[key] for key in keys)] = _metrics(row, keys)
    return [
        factor.key
        for number, factor in enumerate(plan.study.factors)
        if known
        and not any(isinstance(value, (list, dict)) for value in factor.values)
        and not _has_effect(plan, number, known)
    ]


def _has_effect(plan: Plan, number: int, known: Mapping[Place, Mapping[Point, str]]) -> bool:
    factor, compared = plan.study.factors[number], False
    for found in known.values():
        for point in found if factor.values else ():
            pairs = [found[other] for other in _others(factor, number, point) if other in found]
            compared = compared or bool(pairs)
            if any(other != found[point] for other in pairs):
                return True
    if compared:
        return False
    for place, found in known.items():
        point, metrics = next(iter(found.items()))
        driven = {_driven(plan, place, other) for other in _others(factor, number, point)} - {None}
        compared = compared or bool(driven)
        if driven - {metrics}:
            return True
    return not compared  # if every run failed, nothing is known


def _others(factor: Factor, number: int, point: Point) -> Iterator[Point]:
    """Yield the other values of a factor at a point."""
    for value in factor.extremes:
        if value != point[number]:
            yield (*point[:number], value, *point[number + 1 :])


def _driven(plan: Plan, place: Place, point: Point) -> str | None:
    """Return the metrics of a run with these values, or None if it is incomplete."""
    study = replace(plan.settings.study, recordings="none", curves=(), claims=False)
    settings = replace(plan.settings, study=study, folder=None)
    # A table may hold a whole number of the study as a float.
    values = {
        factor.key: next((known for known in factor.values if known == value), value)
        for factor, value in zip(plan.study.factors, point, strict=True)
    }
    (row,) = drive(settings, [plan.request_with(0, 0, place, values)])
    return _metrics(row, plan.study.keys) if row["status"] == Status.OK else None


def _metrics(row: Row, keys: Sequence[str]) -> str:
    """Return all metrics of a row as a key, equal only for identical runs."""
    others = {*IDENTITY, *OUTCOME, *keys}
    found = sorted((name, value) for name, value in row.items() if name not in others and isinstance(value, float))
    return repr([(name, value) for name, value in found if not name.startswith("claim")])

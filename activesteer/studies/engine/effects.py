"""Factors that change nothing: no metric of any run depends on them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.row_table import IDENTITY, OUTCOME
from activesteer.studies.engine.run_task import Row, Status, drive

MAX_ROWS: Final = 20_000
"""Most rows to compare."""

Place = tuple[int, int, int]
"""Numbers of manoeuvre, vehicle and controller."""
Point = tuple[Any, ...]
"""Values of all factors."""


def without_effect(plan: Plan, rows: Iterable[Row]) -> list[str]:
    """Return the factors without effect: changing one of them alone leaves every metric the same to the last bit.

    Rows that differ in one factor only are compared. If there are none for a factor, as in a random sample, the first
    sample is driven again with the ends of the factor's range.
    """
    keys = plan.study.keys
    known: dict[Place, dict[Point, str]] = {}
    for row in rows:
        if row["status"] == Status.OK:
            known.setdefault(_place(plan, row), {})[tuple(row[key] for key in keys)] = _metrics(row, keys)
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
    """Yield the point with the other values of a factor."""
    for value in factor.extremes:
        if value != point[number]:
            yield (*point[:number], value, *point[number + 1 :])


def _driven(plan: Plan, place: Place, point: Point) -> str | None:
    """Return the metrics of a run with these values; None if it is incomplete."""
    study = replace(plan.settings.study, recordings="none", curves=(), claims=False)
    settings = replace(plan.settings, study=study, folder=None)
    # A table may hold a whole number of the study as a float.
    values = {
        factor.key: next((known for known in factor.values if known == value), value)
        for factor, value in zip(plan.study.factors, point, strict=True)
    }
    (row,) = drive(settings, [plan.request_with(0, 0, place, values)])
    return _metrics(row, plan.study.keys) if row["status"] == Status.OK else None


def _place(plan: Plan, row: Row) -> Place:
    shared = plan.settings
    maneuver, vehicle, controller = (
        [label for label, _ in items].index(row[part])
        for part, items in (
            ("maneuver", shared.maneuvers), ("vehicle", shared.vehicles), ("controller", shared.controllers),
        )
    )  # fmt: skip
    return maneuver, vehicle, controller


def _metrics(row: Row, keys: Sequence[str]) -> str:
    """Return all metrics of a row in a form that is equal for identical runs only."""
    others = {*IDENTITY, *OUTCOME, *keys}
    found = sorted((name, value) for name, value in row.items() if name not in others and isinstance(value, float))
    return repr([(name, value) for name, value in found if not name.startswith("claim")])

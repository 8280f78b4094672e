"""Smallest margins of a controller over many cars, none of which is the car that it knows.

A study varies the plant. Controllers keep the car of the files, except for keys under `controllers` or `single_track`
that the study varies.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from activesteer.scenario import FileOrTable, check_gains
from activesteer.studies.engine.plan import Plan, task_size
from activesteer.studies.engine.study import StudyProgress
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.workers import in_parallel, workers_for
from activesteer.studies.linear.margins import SPEEDS_KMH, LoopMargins, margins_of_cars, straight_on, weakest


def worst_margins(
    study_file: FileOrTable | StudyFile,
    controllers: Sequence[Any] = ("lqr",),
    vehicle: FileOrTable = "compact",
    speeds_kmh: Sequence[float] = SPEEDS_KMH,
    overrides: Mapping[str, Any] | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
) -> list[LoopMargins]:
    """Return the smallest margins of every loop at every speed over the samples of a study.

    Factors for single manoeuvres are left out; manoeuvres, cars and controllers of the study have no effect. Overrides
    may not set a key that the study varies. With more than one process, controllers must be picklable. `factors` are
    those of the smallest disk margin; each margin is the smallest over all samples.
    """
    given, changed = read_study(study_file), dict(overrides or {})
    for key in changed:
        if key in given.keys:
            raise given.source.fail(("factors", key), "is varied by the study; it cannot be given beside it")
    names = tuple(name for name in controllers if isinstance(name, str))
    study = replace(
        given, maneuvers=(straight_on(speeds_kmh[0] / 3.6),), vehicles=(vehicle,), controllers=names or ("none",),
        overrides=given.overrides | changed, factors=tuple(each for each in given.factors if not each.maneuvers),
        claims=False, curves=(),
    )  # fmt: skip
    check_gains(changed, controllers)
    plan = Plan(study)
    requests = plan.requests(range(0, len(plan), len(study.controllers)))
    with workers_for(jobs, scheduler=scheduler) as workers:
        # Cars that are evaluated together share the controller's response.
        cars, size = [request.overrides for request in requests], task_size(len(requests), 1, workers.in_flight)
        parts = [cars[start : start + size] for start in range(0, len(cars), size)]
        looked_at = 0

        def report(place: int, _: int) -> None:
            nonlocal looked_at
            looked_at += len(parts[place])
            if progress is not None:
                progress(StudyProgress(looked_at, len(requests), 0, looked_at))

        look = functools.partial(_margins, controllers, vehicle, speeds_kmh)
        found = in_parallel(look, [(part,) for part in parts], report=report, workers=workers)
    every = list(itertools.chain.from_iterable(found))
    worst = []
    for row in zip(*every, strict=True):
        least = min(range(len(row)), key=lambda number: row[number].margins.disk)
        worst.append(
            replace(row[least], margins=weakest([each.margins for each in row]), factors=requests[least].factors)
        )
    return worst


def _margins(
    controllers: Sequence[Any],
    vehicle: FileOrTable,
    speeds_kmh: Sequence[float],
    cars: Sequence[Mapping[str, Any]],
) -> list[list[LoopMargins]]:
    return list(margins_of_cars(controllers, vehicle, speeds_kmh, cars))

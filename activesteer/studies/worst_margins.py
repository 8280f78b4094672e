"""The smallest margins of a controller over many cars, none of which is the one that it knows.

What a study varies of the car is varied in the plant; controllers go on knowing the car as its files say, but for what
the study changes under `controllers` or `single_track`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from activesteer.scenario import FileOrTable, check_gains
from activesteer.studies.margins import SPEEDS_KMH, LoopMargins, margins_of_cars, straight_on, weakest
from activesteer.studies.plan import Plan
from activesteer.studies.study import StudyProgress
from activesteer.studies.study_file import StudyFile, read_study


def worst_margins(
    study_file: FileOrTable | StudyFile,
    controllers: Sequence[Any] = ("lqr",),
    vehicle: FileOrTable = "compact",
    speeds_kmh: Sequence[float] = SPEEDS_KMH,
    overrides: Mapping[str, Any] | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> list[LoopMargins]:
    """The smallest margins of every loop at every speed over the samples of a study.

    Args:
        study_file: Its factors, without those that are for some of its manoeuvres only, its design and its overrides;
            what it drives with which cars and controllers has no part in it.
        controllers: As for `simulate`.
        vehicle: Name, path, or table of a vehicle.
        speeds_kmh: Speeds [km/h].
        overrides: Dotted key -> value, of none that the study varies.
        progress: Called after every sample.

    Returns:
        Each margin the smallest of all samples; `factors` are those of the smallest disk margin.

    Raises:
        ControllerError: a controller has no linear form.
        ActiveSteerError: an input is wrong.
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
    every: list[list[LoopMargins]] = []
    for found in margins_of_cars(controllers, vehicle, speeds_kmh, (request.overrides for request in requests)):
        every.append(found)
        if progress is not None:
            progress(StudyProgress(len(every), len(requests), 0, len(every)))
    worst = []
    for row in zip(*every, strict=True):
        least = min(range(len(row)), key=lambda number: row[number].margins.disk)
        worst.append(
            replace(row[least], margins=weakest([each.margins for each in row]), factors=requests[least].factors)
        )
    return worst

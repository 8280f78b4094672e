"""Studies of a population of cars, roads and drivers: for the paper's claims, and for a comparison of controllers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from activesteer.errors import ParameterError
from activesteer.scenario import FileOrTable
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.paper.comparison_targets import NONE

STUDY: Final = "population"
"""Name of the study file."""
COMPARISON: Final = "comparison"
"""Name of the study file of a comparison."""


def population_study(
    samples: int | None = None, seed: int | None = None, vehicle: FileOrTable | None = None
) -> StudyFile:
    """Return the study of the paper's claims.

    Args:
        samples: Number of samples; default: that of the file.
        seed: Seed of the sample; default: that of the file.
        vehicle: Name, path or table of a vehicle; default: that of the file.
    """
    return _changed(STUDY, samples, seed, vehicle)


def comparison_study(
    controllers: Sequence[str],
    samples: int | None = None,
    seed: int | None = None,
    vehicle: FileOrTable | None = None,
) -> StudyFile:
    """Return the study of a comparison, with the same cars, roads, drivers and sensors for all controllers.

    Every sample drives one manoeuvre. The study file has the ranges of car, driver, friction and speed; the sensors are
    those of production cars.

    Args:
        controllers: As for `simulate`; they must include `none`, with which the others are compared.
        samples: Number of samples; default: that of the study file.
        seed: Seed of the sample; same default.
        vehicle: Name, path or table of a vehicle; same default.
    """
    if NONE not in controllers:
        raise ParameterError(
            f"{NONE} is missing: the others are compared with it",
            key="--controllers",
            value=tuple(controllers),
            allowed=[NONE],
        )
    return _changed(COMPARISON, samples, seed, vehicle, controllers=list(controllers))


def _changed(
    name: str, samples: int | None, seed: int | None, vehicle: FileOrTable | None, **changes: object
) -> StudyFile:
    table: dict[str, Any] = read_study(name).to_table() | changes
    if samples is not None:
        table["design"]["samples"] = samples
    if seed is not None:
        table["seed"] = seed
    if vehicle is not None:
        table["vehicles"] = [vehicle]
    return read_study(table)

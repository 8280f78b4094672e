"""Studies of a population of cars, roads and drivers: for the paper's claims, and for a comparison of controllers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from activesteer.config import read_toml
from activesteer.errors import ManeuverError, ParameterError
from activesteer.resources import find_maneuver
from activesteer.scenario import FileOrTable
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.paper.comparison import CASES, SHOWN
from activesteer.studies.paper.comparison_targets import NONE, REFERENCES

STUDY: Final = "population"
"""Name of the study file."""
SCENARIOS: Final = tuple(name for name in CASES if name not in ("severe_lane_change", "split_mu_braking"))
"""Scenarios of the comparison except two: one is compared by entry speed, in the other sideslip is not decisive."""
_PRESET: Final = "sensors.preset"
_SEED: Final = "sensors.seed"


def population_study(
    samples: int | None = None, seed: int | None = None, vehicle: FileOrTable | None = None
) -> StudyFile:
    """Return the study of the paper's claims.

    Args:
        samples: Number of samples; default: that of the file.
        seed: Seed of the sample; default: that of the file.
        vehicle: Name, path or table of a vehicle; default: that of the file.

    Raises:
        ActiveSteerError: an input is wrong.
    """
    table = read_study(STUDY).to_table()
    if samples is not None:
        table["design"]["samples"] = samples
    if seed is not None:
        table["seed"] = seed
    if vehicle is not None:
        table["vehicles"] = [vehicle]
    return read_study(table)


def comparison_study(
    controllers: Sequence[str],
    samples: int | None = None,
    seed: int | None = None,
    vehicle: FileOrTable | None = None,
) -> StudyFile:
    """Return the study of a comparison, with the same cars, roads, drivers and sensors for all controllers.

    It is `population` without the gains, which only the paper's systems have, and with the sensors of production cars,
    a different one for every sample.

    Args:
        controllers: As for `simulate`; they must include `none` and `REFERENCES`, with which the others are compared.
        samples: Number of samples; default: that of the study `population`.
        seed: Seed of the sample; same default.
        vehicle: Name, path or table of a vehicle; same default.

    Raises:
        ActiveSteerError: an input is wrong.
    """
    missing = [name for name in (NONE, *REFERENCES) if name not in controllers]
    if missing:
        raise ParameterError(
            f"{', '.join(missing)} is missing: the others are compared with {', '.join((NONE, *REFERENCES))}",
            key="--controllers",
            value=tuple(controllers),
            allowed=missing,
        )
    table = population_study(samples, seed, vehicle).to_table()
    factors = {key: dict(value) for key, value in table["factors"].items() if not key.startswith("controllers.")}
    del factors[_PRESET], factors[_SEED]["when"], table["curves"]
    shown = (metric for scenario in SCENARIOS for metric in SHOWN[scenario])
    return read_study(
        table
        | {
            "title": "Controllers side by side over a population",
            "maneuvers": [_maneuver(name) for name in SCENARIOS],
            "controllers": list(controllers),
            "claims": False,
            "overrides": {_PRESET: "production"},
            "factors": factors,
            "metrics": list(dict.fromkeys([*table["metrics"], *shown])),
        }
    )


def _maneuver(scenario: str) -> FileOrTable:
    maneuver, changes = CASES[scenario]
    if not changes:
        return maneuver
    table, _ = read_toml(find_maneuver(maneuver), ManeuverError)
    return {**table, **changes, "name": scenario}

"""Comparison of controllers over a population with the same cars, roads, drivers and sensors for all.

The study is `population` without the gains, which only the paper's systems have, and with the sensors of production
cars, a different one for every sample.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa

from activesteer.analysis.claims.population import SystemEffect
from activesteer.config import read_toml
from activesteer.errors import ManeuverError, ParameterError, StudyError
from activesteer.files import make_folder, reading, write_text
from activesteer.metric_table import SIDESLIP_PEAKS
from activesteer.resources import find_maneuver, studies_dir
from activesteer.scenario import FileOrTable
from activesteer.studies.engine.factor_values import label_of
from activesteer.studies.engine.row_table import IDENTITY, OUTCOME
from activesteer.studies.engine.run_identity import versions
from activesteer.studies.engine.study import StudyProgress, study
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.paper.comparison import CASES, SHOWN, Row
from activesteer.studies.paper.comparison_shares import ComparisonPopulation, Effect, Share
from activesteer.studies.paper.comparison_targets import NONE, REFERENCES, asked
from activesteer.studies.paper.population import STEERING_EFFORT, effects, population_study

SCENARIOS: Final = tuple(name for name in CASES if name not in ("severe_lane_change", "split_mu_braking"))
"""Scenarios of the comparison except two: one is compared by entry speed, in the other sideslip is not decisive."""
STORED: Final = "comparison/summary.json"
"""File of the comparison that the package stores, below the folder of the study files."""
_PRESET: Final = "sensors.preset"
_SEED: Final = "sensors.seed"


def comparison_study(
    controllers: Sequence[str],
    samples: int | None = None,
    seed: int | None = None,
    vehicle: FileOrTable | None = None,
) -> StudyFile:
    """Return the study to drive.

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


def compare_population(
    controllers: Sequence[str],
    samples: int | None = None,
    *,
    seed: int | None = None,
    vehicle: FileOrTable | None = None,
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> ComparisonPopulation:
    """Drive the controllers over a population; see `comparison_study` and `study` for the arguments.

    Raises:
        ActiveSteerError: an input is wrong, or the folder holds another study.
    """
    planned = comparison_study(controllers, samples, seed, vehicle)
    table = study(planned, output=output, jobs=jobs, scheduler=scheduler, progress=progress)
    return summarise(table, planned)


def summarise(table: pa.Table, planned: StudyFile) -> ComparisonPopulation:
    """Count the results of the runs.

    Args:
        table: The study's table, or as much of it as there is.
        planned: The study.
    """
    rows = table.to_pylist()
    names = [label_of(controller) for controller in planned.controllers]
    lower = _lower(rows, asked(names))
    found = effects(rows, NONE, *(name for name in names if name != NONE))
    return ComparisonPopulation(
        samples=len({row["sample"] for row in rows}),
        seed=planned.seed,
        vehicle=label_of(planned.vehicles[0]),
        versions=versions(),
        controllers=tuple(names),
        failed=sum(row["status"] != "ok" for row in rows),
        effects=tuple(_effect(one, lower) for one in found),
        table=tuple(_medians(rows, planned)),
    )


def store_comparison(found: ComparisonPopulation) -> Path:
    """Store the results of a comparison with the package, without the medians of all metrics.

    Returns:
        The file.

    Raises:
        StudyError: the file cannot be written.
    """
    path = studies_dir() / STORED
    make_folder(path.parent, StudyError)
    return write_text(path, json.dumps(replace(found, table=()).to_json(), indent=1) + "\n", StudyError)


def stored_comparison() -> ComparisonPopulation | None:
    """Return the comparison that the package stores; None if there is none.

    Raises:
        StudyError: it cannot be read.
    """
    path = studies_dir() / STORED
    if not path.is_file():
        return None
    with reading(path, StudyError):
        return ComparisonPopulation.from_json(json.loads(path.read_text(encoding="utf-8")))


def _effect(found: SystemEffect, lower: Mapping[tuple[str, str], Share]) -> Effect:
    changes = {change.metric: change.median for change in found.changes}
    return Effect(
        found.scenario,
        found.controller,
        lower.get((found.scenario, found.controller), Share(0, 0)),
        Share(found.saved, found.lost_without),
        Share(found.spoiled, found.fine_without),
        next((changes[name] for name in SIDESLIP_PEAKS if name in changes), math.nan),
        changes.get(STEERING_EFFORT, math.nan),
    )


def _lower(rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> dict[tuple[str, str], Share]:
    """Return scenario and controller -> samples in which its peak sideslip angle is the lowest.

    An incomplete run has no peak: it is never the lowest, and every other run counts as lower.
    """
    peaks: dict[tuple[str, int], dict[str, float]] = {}
    for row in rows:
        found = next((abs(row[name]) for name in SIDESLIP_PEAKS if row.get(name) is not None), math.inf)
        peaks.setdefault((row["maneuver"], row["sample"]), {})[row["controller"]] = found
    shares: dict[tuple[str, str], Share] = {}
    for (scenario, _), by_controller in peaks.items():
        best = min(by_controller.get(name, math.inf) for name in REFERENCES)
        for name in names:
            if name in by_controller:
                before = shares.get((scenario, name), Share(0, 0))
                shares[scenario, name] = before + Share(int(by_controller[name] < best), 1)
    return shares


def _medians(rows: Sequence[Mapping[str, Any]], planned: StudyFile) -> list[Row]:
    about = {*IDENTITY, *OUTCOME, *planned.keys}
    metrics = [name for name in (rows[0] if rows else ()) if name not in about]
    found = []
    for scenario in dict.fromkeys(row["maneuver"] for row in rows):
        for controller in dict.fromkeys(row["controller"] for row in rows):
            own = [row for row in rows if row["maneuver"] == scenario and row["controller"] == controller]
            for metric in metrics:
                values = [row[metric] for row in own if row[metric] is not None and math.isfinite(row[metric])]
                if values:
                    found.append(Row(scenario, controller, metric, float(np.median(values))))
    return found

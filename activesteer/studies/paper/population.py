"""The paper's claims over a population of cars, roads and drivers: proportions, and effects of the systems.

The study `population` is paired: the three systems meet the same samples. `population` drives the runs, `summarise`
counts their results.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
import pyarrow as pa

from activesteer.analysis.claims import SYSTEMS, Claim
from activesteer.analysis.claims.population import NONE, Change, ClaimShare, Population, SystemEffect
from activesteer.analysis.loss_of_control import has_spun, is_lost
from activesteer.metric_table import SIDESLIP_PEAKS
from activesteer.scenario import FileOrTable
from activesteer.studies.engine.dependence import strongest
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.run_identity import versions
from activesteer.studies.engine.run_task import CLAIM, CURVE
from activesteer.studies.engine.study import StudyProgress, study
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.paper.reproduction import nominal_claims
from activesteer.theory.shares import wilson_interval

STUDY: Final = "population"
"""Name of the study file."""
STEERING_EFFORT: Final = "steering_wheel_rms_rad"
CHANGES: Final = (
    *SIDESLIP_PEAKS,
    "yaw_rate_after_gates_rms_radps",
    "yaw_rate_after_1750ms_share",
    STEERING_EFFORT,
)
"""Metrics whose change by a system is reported: peak sideslip angle, remaining oscillation, steering effort."""
_RANGE: Final = (0.05, 0.5, 0.95)


def population_study(
    samples: int | None = None, seed: int | None = None, vehicle: FileOrTable | None = None
) -> StudyFile:
    """Return the study to drive.

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


def population(
    samples: int | None = None,
    *,
    seed: int | None = None,
    vehicle: FileOrTable | None = None,
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Population:
    """Check the paper's claims over a population; see `study` for the arguments that are not listed.

    Args:
        samples: Number of samples; 15 runs each.
        seed: Seed of the sample.
        vehicle: The car of which the samples are variations.
        output: Folder of the study; a study found there is resumed. Without a folder, nothing is stored.
        jobs: Number of processes.
        scheduler: Address of a Dask scheduler, or its scheduler file, instead.
        progress: Called after every task.

    Returns:
        Proportions and effects.

    Raises:
        ActiveSteerError: an input is wrong, or the folder holds another study.
    """
    planned = population_study(samples, seed, vehicle)
    table = study(planned, output=output, jobs=jobs, scheduler=scheduler, progress=progress)
    return summarise(table, planned, nominal_claims(planned.vehicles[0], jobs=jobs))


def summarise(table: pa.Table, planned: StudyFile, nominal: Sequence[Claim]) -> Population:
    """Count the results of a population's runs.

    Args:
        table: The study's table, or as much of it as there is.
        planned: The study.
        nominal: The claims of the nominal runs.

    Returns:
        Proportions, in the order of the nominal claims, and effects.
    """
    rows = table.select([name for name in table.column_names if not name.startswith(CURVE)]).to_pylist()
    first = [row for row in rows if row["controller"] == planned.controllers[0]]
    return Population(
        samples=len({row["sample"] for row in rows}),
        seed=planned.seed,
        vehicle=rows[0]["vehicle"] if rows else "",
        versions=versions(),
        claims=tuple(_share(claim.id, claim.passed, first, planned.factors) for claim in nominal),
        systems=tuple(effects(rows, *SYSTEMS)),
    )


def _share(name: str, passed: bool, rows: Sequence[Mapping[str, Any]], factors: Sequence[Factor]) -> ClaimShare:
    column = f"{CLAIM}{name}"
    judged = [row for row in rows if row.get(column) is not None]
    held = [row[column] == 1.0 for row in judged]
    low, high = wilson_interval(sum(held), len(held))
    varied = [
        factor
        for factor in factors
        if judged and not factor.when and (not factor.maneuvers or judged[0]["maneuver"] in factor.maneuvers)
    ]
    at = {
        f"{factor.key} = {value}": _fraction(
            [one for row, one in zip(judged, held, strict=True) if row[factor.key] == value]
        )
        for factor in varied
        for value in factor.values
    }
    # A choice of two counts as 0 and 1.
    found = strongest({factor.key: _numbers(factor, judged) for factor in varied}, held)
    depends = (NONE, 0.0, 0) if found is None else found
    return ClaimShare(name, passed, len(held), _fraction(held), low, high, *depends, at)


def _numbers(factor: Factor, rows: Sequence[Mapping[str, Any]]) -> list[float]:
    values = [row[factor.key] for row in rows]
    return [factor.values.index(value) for value in values] if factor.values else values


def _fraction(held: Sequence[bool]) -> float:
    return sum(held) / len(held) if held else float("nan")


def effects(rows: Sequence[Mapping[str, Any]], without: str, *systems: str) -> list[SystemEffect]:
    """Return the effect of each system in each scenario, relative to the same samples without it.

    Args:
        rows: Rows of a paired study's table.
        without: Controller with which the others are compared.
        systems: The others.
    """
    found = []
    for scenario in dict.fromkeys(row["maneuver"] for row in rows):
        driven = [row for row in rows if row["maneuver"] == scenario]
        by_system = {
            system: {row["sample"]: row for row in driven if row["controller"] == system}
            for system in (without, *systems)
        }
        has = [name for name in driven[0] if any(row[name] is not None for row in driven)]
        metrics = [name for name in CHANGES if name in has]
        for system in systems:
            both = [
                (row, by_system[system][sample])
                for sample, row in by_system[without].items()
                if sample in by_system[system]
            ]
            lost = [tuple(is_lost({name: row[name] for name in has}) for row in pair) for pair in both]
            found.append(
                SystemEffect(
                    controller=system,
                    scenario=scenario,
                    lost_without=sum(a for a, _ in lost),
                    saved=sum(a and not b for a, b in lost),
                    fine_without=sum(not a for a, _ in lost),
                    spoiled=sum(b and not a for a, b in lost),
                    spun_without=sum(has_spun(row) for row, _ in both),
                    spun=sum(has_spun(row) for _, row in both),
                    changes=tuple(_change(name, both) for name in metrics),
                )
            )
    return found


def _change(metric: str, both: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> Change:
    pairs = np.array([[row[metric] for row in pair] for pair in both], dtype=np.float64)
    change = np.diff(np.abs(pairs), axis=1)[:, 0]
    change = change[np.isfinite(change)]
    low, median, high = np.quantile(change, _RANGE).tolist() if len(change) else [float("nan")] * 3
    return Change(metric, len(change), low, median, high)

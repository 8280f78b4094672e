"""Tuning: values of a study's factors that minimise objectives, by Optuna; resumable, with several workers."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final

from activesteer.config import Range, build
from activesteer.errors import StudyError
from activesteer.files import make_folder, write_text
from activesteer.scenario import FileOrTable
from activesteer.studies.engine.effects import without_effect
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.run_task import Row, Status
from activesteer.studies.engine.search import Judgement, claim_folder, import_optuna, search
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.workers import workers_for

_VIOLATION: Final = "violation"


@dataclass(frozen=True)
class Term:
    """A metric of one run, in an objective or a constraint."""

    metric: str
    """Name of the metric; `claims_failed` is the number of the paper's claims that fail, if the study checks them."""
    controller: str
    """Controller of the run."""
    maneuver: str = ""
    """Manoeuvre of the run; may be left out if there is only one."""
    relative_to: str = ""
    """Another controller; the magnitude is divided by that of its run."""
    weight: float = 1.0
    """Weight; negative if a larger value is better."""
    limit: Annotated[float, Range(0.0)] = 1e12
    """Upper bound of the magnitude."""


@dataclass(frozen=True)
class Objective:
    """A sum to be minimised."""

    name: str
    """Name of the objective."""
    terms: tuple[Term, ...]
    """Terms of the sum: magnitudes times their weights."""


@dataclass(frozen=True)
class Constraint:
    """A bound that must not be exceeded."""

    metric: str
    """See `Term`."""
    controller: str
    """See `Term`."""
    maneuver: str = ""
    """See `Term`."""
    low: float = -1e12
    """The metric is at least this."""
    high: float = 1e12
    """The metric is at most this."""


@dataclass(frozen=True)
class TuneTable:
    """The table [tune] of a study file."""

    objectives: tuple[Objective, ...]
    """One objective, or several, for which the Pareto front is found."""
    constraints: tuple[Constraint, ...] = ()
    """Constraints."""
    trials: Annotated[int, Range(1, 1_000_000)] = 100
    """Number of sets to try."""


@dataclass(frozen=True)
class Trial:
    """A set of values that was tried; the size of the violation of its constraints is 0 if there is none."""

    number: int
    values: dict[str, Any]
    objectives: dict[str, float]
    violation: float


@dataclass(frozen=True)
class Tuning:
    """Result of a tuning.

    Attributes:
        done: Number of all sets that were tried.
        failed: Number of sets with a failed run.
        front: Sets that no other set beats in every objective; with one objective, the best set.
        trials: All sets that could be judged.
        without_effect: Factors that change no metric of any run, if sets were tried now.
    """

    done: int
    failed: int
    front: list[Trial]
    trials: list[Trial]
    without_effect: list[str]


def tune(
    study_file: FileOrTable,
    output: str | os.PathLike[str],
    *,
    trials: int | None = None,
    jobs: int | None = None,
    client: Any = None,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Tuning:
    """Search for the best set of a study's factors, driving each set in all manoeuvres with all controllers.

    A search found in the folder is resumed, up to `trials` sets in total, by default the number of the file. `progress`
    is called after every set with the finished sets and the total. See `study` for the other arguments.
    """
    study = read_study(study_file, "tune")
    table = _table(study)
    optuna = import_optuna("tune")
    plan = Plan(study)
    folder = make_folder(output, StudyError)
    claim_folder(folder, "tune", plan)
    seen: list[Sequence[Row]] = []

    def judge(rows: Sequence[Row]) -> Judgement:
        if any(row["status"] != Status.OK for row in rows):
            return Judgement(None)
        if not seen:
            _check_metrics(study, table, rows)
        seen[:] = [rows]
        values, violation = _judged(table, rows)
        return Judgement(values, {_VIOLATION: violation}, violation if table.constraints else None)

    def sampler(seed: int) -> Any:
        return optuna.samplers.TPESampler(seed=seed, constant_liar=True)

    wanted = table.trials if trials is None else trials
    with workers_for(jobs, client=client, scheduler=scheduler) as workers:
        made = search(plan, folder, "tune", sampler, len(table.objectives), wanted, judge, workers, progress)
    result = _result(optuna, made, table, without_effect(plan, seen[-1] if seen else ()))
    write_text(folder / "front.json", json.dumps([vars(trial) for trial in result.front], indent=2) + "\n", StudyError)
    return result


def _table(study: StudyFile) -> TuneTable:
    if study.case_list is not None or not study.factors:
        raise study.source.fail(("factors",), "a search needs factors")
    table = build(TuneTable, study.tune or {}, study.source, ("tune",))
    if not table.objectives:
        raise study.source.fail(("tune", "objectives"), "at least one is needed")
    for place, part in _parts(table):
        study.check_runs(place, part.maneuver, {key: getattr(part, key, "") for key in ("controller", "relative_to")})
    return table


def _parts(table: TuneTable) -> Iterator[tuple[tuple[str, ...], Term | Constraint]]:
    """Return all terms and constraints, with the keys that lead to them."""
    for number, objective in enumerate(table.objectives):
        for place, term in enumerate(objective.terms):
            yield ("tune", "objectives", str(number), "terms", str(place)), term
    for number, constraint in enumerate(table.constraints):
        yield ("tune", "constraints", str(number)), constraint


def _check_metrics(study: StudyFile, table: TuneTable, rows: Sequence[Row]) -> None:
    """Check that the runs have every metric; the first set without a failure shows their names."""
    for place, part in _parts(table):
        for row in _rows_of(part.controller, part.maneuver, rows):
            study.check_metric((*place, "metric"), part.metric, row)


def _judged(table: TuneTable, rows: Sequence[Row]) -> tuple[list[float] | None, float]:
    """Return the objectives and the violation of the constraints; no objectives if a run lacks a metric."""
    values = [sum(_value(term, rows) for term in objective.terms) for objective in table.objectives]
    broken = 0.0
    for constraint in table.constraints:
        for found in _found(constraint.metric, constraint.controller, constraint.maneuver, rows):
            broken += max(0.0, constraint.low - found, found - constraint.high)
    finite = all(map(math.isfinite, values)) and math.isfinite(broken)
    return (values if finite else None), broken


def _value(term: Term, rows: Sequence[Row]) -> float:
    total = 0.0
    found = _found(term.metric, term.controller, term.maneuver, rows)
    others = _found(term.metric, term.relative_to, term.maneuver, rows) if term.relative_to else [1.0] * len(found)
    for value, other in zip(found, others, strict=True):
        total += min(abs(value) / max(abs(other), 1e-9), term.limit)
    return term.weight * total


def _found(metric: str, controller: str, maneuver: str, rows: Sequence[Row]) -> list[float]:
    """Return a metric for every vehicle."""
    return [float(row.get(metric, math.nan)) for row in _rows_of(controller, maneuver, rows)]


def _rows_of(controller: str, maneuver: str, rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["controller"] == controller and maneuver in ("", row["maneuver"])]


def _result(optuna: Any, made: Any, table: TuneTable, idle: list[str]) -> Tuning:
    complete = made.get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,))
    names = [objective.name for objective in table.objectives]
    judged = [
        Trial(trial.number, dict(trial.params), dict(zip(names, trial.values, strict=True)),
              float(trial.user_attrs.get(_VIOLATION, 0.0)))
        for trial in complete
    ]  # fmt: skip
    kept = [trial for trial in judged if trial.violation == 0.0]
    front = [trial for trial in kept if not any(_dominates(other, trial) for other in kept)]
    return Tuning(len(made.trials), len(made.trials) - len(judged), front, judged, idle)


def _dominates(a: Trial, b: Trial) -> bool:
    pairs = list(zip(a.objectives.values(), b.objectives.values(), strict=True))
    return all(x <= y for x, y in pairs) and (any(x < y for x, y in pairs))

"""The table [tune] of a study file, and the judgement of sets of values.

The table has one goal: `minimise` objectives, `satisfy` as many statements as possible, or `violate` a requirement.
They are expressions over the metrics of the runs of a set, see `analysis.requirement`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Any, Final, Literal, NamedTuple

from activesteer.analysis.claims.judge import SCENARIO_OF
from activesteer.analysis.requirement import ANY, EvaluatedRun, Expression, Names, Requirement, Runs, distance
from activesteer.config import Range, build
from activesteer.core.metric_table import METRICS
from activesteer.errors import nearest_names, shown
from activesteer.studies.engine.factor_values import Prior
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.runs import DISTANCE, Row, Status
from activesteer.studies.engine.store import IDENTITY, OUTCOME
from activesteer.studies.engine.study_file import StudyFile, label_of

TABLE: Final = "tune"
_MOST: Final = 1e6
"""Bound of a margin in a search, for runs that define no metric."""
_ROOM: Final = 0.1
"""Margin above which a statement that holds has no cost."""
_IMPLAUSIBLE: Final = 0.3
"""Cost of a setting at the ends of its ranges. A statement that fails costs 1 to 2."""


class Goal(StrEnum):
    """Goals that a search can have."""

    MINIMISE = "minimise"
    SATISFY = "satisfy"
    VIOLATE = "violate"


@dataclass(frozen=True)
class TuneTable:
    """The table [tune] of a study file."""

    minimise: dict[str, str] = field(default_factory=dict)
    """Expressions to minimise, by name. For several, the Pareto front is found."""
    satisfy: dict[str, str] = field(default_factory=dict)
    """Requirements by name. The search satisfies as many as possible."""
    violate: str = ""
    """Requirement whose worst case is searched. `controller` stands for the examined controller."""
    constraints: dict[str, str] = field(default_factory=dict)
    """Requirements that the best set must meet, by name."""
    seeds: tuple[dict[str, Any], ...] = ()
    """Sets to try first."""
    trials: Annotated[int, Range(1, 10_000_000)] = 100
    """Number of sets of each search."""
    sampler: Literal["auto", "tpe", "cma_es", "nsga2", "random", "qmc", "grid"] = "auto"
    """Sampler of Optuna; `auto`: `cma_es` to satisfy statements without constraints, else `tpe`."""

    @property
    def goal(self) -> Goal:
        """Goal of the search."""
        return next(goal for goal in Goal if getattr(self, goal))


def read_table(study: StudyFile) -> TuneTable:
    """Return the checked table [tune] of a study."""
    source, given = study.source, {key: _in_one_line(value) for key, value in (study.tune or {}).items()}
    if "objectives" in given or not isinstance(given.get("constraints", {}), Mapping):
        raise source.fail(
            (TABLE, "objectives" if "objectives" in given else "constraints"),
            "lists of tables are no longer supported; write a line for each expression: [tune.minimise] with lines "
            'such as response = "min(abs(yaw_rate_overshoot(ars, step_steer) / yaw_rate_overshoot(none, step_steer)), '
            '2)", and [tune.constraints] with lines such as '
            'turns = "lateral_displacement_m(ars, sine_with_dwell) >= 1.83"',
        )
    table = build(TuneTable, given, source, (TABLE,))
    goals = [goal for goal in Goal if getattr(table, goal)]
    if len(goals) != 1:
        raise source.fail(
            (TABLE,), f"has the goals {', '.join(goals) or 'none'}; exactly one of {', '.join(Goal)} is needed"
        )
    if table.sampler == "cma_es" and (table.constraints or len(table.minimise) > 1):
        raise source.fail((TABLE, "sampler"), "cma_es allows one objective and no constraint; use tpe or nsga2")
    if study.case_list is not None or not study.factors:
        raise source.fail(("factors",), "a search needs factors")
    ranged = [factor.key for factor in study.factors if not factor.values]
    if table.sampler == "grid" and (ranged or table.seeds):
        problem = f"{ranged[0]} has a range" if ranged else "leave the seeds out"
        raise source.fail((TABLE, "sampler"), f"grid tries each combination of grids and choices; {problem}")
    factors = {factor.key: factor for factor in study.factors}
    for number, seed in enumerate(table.seeds):
        for key, value in seed.items():
            place = (TABLE, "seeds", str(number), key)
            if key not in factors:
                raise source.fail(place, f"is not a factor of the study; {nearest_names(key, factors)}", key)
            if not _is_in(factors[key], value):
                problem = f"{shown(value)} is outside the range of the factor; allowed: {shown(factors[key].extremes)}"
                raise source.fail(place, problem, value)
    return table


def _in_one_line(value: Any) -> Any:
    """Replace line breaks by blanks in a string, or in a table of strings."""
    if isinstance(value, Mapping):
        return {key: _in_one_line(item) for key, item in value.items()}
    return " ".join(value.split()) if isinstance(value, str) else value


def _is_in(factor: Factor, value: Any) -> bool:
    if factor.values:
        return value in factor.values
    return isinstance(value, (int, float)) and factor.low <= value <= factor.high


class Judgement(NamedTuple):
    """Judgement of a set: its objectives, and the margins of statements and constraints by name."""

    objectives: list[float]
    margins: dict[str, float]
    constraints: dict[str, float]


class Judge:
    """Judge of the sets of a search, with objectives, statements and constraints by name."""

    def __init__(self, plan: Plan, table: TuneTable, examined: str = "") -> None:
        """Parse the expressions of a table, with `controller` as the examined controller."""
        study, self._examined = plan.study, examined
        controllers, maneuvers = ([*map(label_of, items)] for items in (study.controllers, study.maneuvers))
        claims = {claim: (f"{DISTANCE}{claim}", name) for claim, name in SCENARIO_OF.items() if name in maneuvers}
        names = Names(controllers, maneuvers, examined, claims if study.claims else {})
        self._source, self._about = study.source, {*IDENTITY, *OUTCOME, *study.keys}
        self._lines: list[tuple[tuple[str, ...], Expression]] = []

        def read(kind: type[Expression], lines: Mapping[str, str], *where: str) -> dict[str, Any]:
            found = {name: kind(text, names, study.source, (TABLE, *where, name)) for name, text in lines.items()}
            self._lines += [((TABLE, *where, name), one) for name, one in found.items()]
            return found

        self.objectives: dict[str, Expression] = read(Expression, table.minimise, Goal.MINIMISE)
        self.statements: dict[str, Requirement] = read(Requirement, table.satisfy, Goal.SATISFY)
        if table.violate:
            self.statements[ANY] = read(Requirement, {Goal.VIOLATE: table.violate})[Goal.VIOLATE]
        self.constraints: dict[str, Requirement] = read(Requirement, table.constraints, "constraints")
        self.prior = Prior(study) if table.satisfy else None

    def judged(self, rows: Sequence[Row], values: Mapping[str, Any]) -> Judgement | None:
        """Judge a set from the rows of its runs, or return None if that is impossible."""
        whole = [row["status"] == Status.OK for row in rows]
        if not any(whole) or (self.objectives and not all(whole)):
            return None
        vehicles = self._runs(rows)
        margins, constraints = (
            {name: min(_bounded(one(runs)) for runs in vehicles) for name, one in requirements.items()}
            for requirements in (self.statements, self.constraints)
        )
        if self._examined and math.isnan(self.statements[ANY](vehicles[0])):
            lacking = self.statements[ANY].undefined(vehicles[0])
            if not lacking or (
                self._examined in lacking and len(lacking) > 1
            ):  # as a car that is lost with every controller
                return None
            margins[ANY] = -_MOST if self._examined in lacking else _MOST
        objectives = [sum(map(one, vehicles)) for one in self.objectives.values()] or [margins.get(ANY, 0.0)]
        if self.prior is not None:
            objectives = [sum(map(_cost, margins.values())) + _IMPLAUSIBLE * self.prior.implausibility(values)]
        return Judgement(objectives, margins, constraints) if all(map(math.isfinite, objectives)) else None

    def _runs(self, rows: Sequence[Row]) -> list[Runs]:
        """Return the metrics of the runs for each vehicle, undefined for a failed run."""
        names: dict[str, dict[str, None]] = {}
        for row in rows:
            own = names.setdefault(row["maneuver"], {})
            if row["status"] == Status.OK:
                own.update(dict.fromkeys(name for name in row if name not in self._about))
        for where, one in self._lines:
            for name, run in one.metrics:
                if name in METRICS and (known := names[run.maneuver]) and name not in known:
                    problem = f"the runs of {run.maneuver} have no such metric; {nearest_names(name, known)}"
                    raise self._source.fail(where, problem, name)
        found: dict[str, dict[EvaluatedRun, dict[str, float | None]]] = {}
        for row in rows:
            metrics = {name: row.get(name) for name in names[row["maneuver"]]}
            found.setdefault(row["vehicle"], {})[EvaluatedRun(row["controller"], row["maneuver"])] = metrics
        return list(found.values())


def _bounded(margin: float) -> float:
    return -_MOST if math.isnan(margin) else min(max(margin, -_MOST), _MOST)


def _cost(margin: float) -> float:
    """Return the cost of a statement: 1 to 2 if it fails, and a little for a thin margin."""
    if margin < 0.0:
        return 1.0 + distance(margin)
    return 0.3 * max(0.0, 1.0 - margin / _ROOM)

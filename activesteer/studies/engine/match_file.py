"""The table [match] of a study file: statements about the runs, and the search for settings in which they hold."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final

from activesteer.analysis.claims import SCENARIO_OF
from activesteer.analysis.claims.condition import Condition, at_least, at_most
from activesteer.config import Range, build
from activesteer.errors import nearest_names, shown
from activesteer.studies.engine.factor_values import label_of
from activesteer.studies.engine.run_task import DISTANCE, Row, Status
from activesteer.studies.engine.study_file import StudyFile

FAR: Final = 3.0
"""Distance of a statement whose runs failed."""
_OPEN: Final = 1e12


@dataclass(frozen=True)
class Criterion:
    """A bound on a metric of one run, or on its ratio to or difference from that of another run."""

    metric: str
    """Name of the metric."""
    controller: str
    """Controller of the run."""
    relative_to: str = ""
    """Another controller; the magnitude is divided by that of its run."""
    minus: str = ""
    """Another controller; the magnitude of its run is subtracted from the magnitude of this one."""
    low: float = -_OPEN
    """The value is at least this."""
    high: float = _OPEN
    """The value is at most this."""
    scale: Annotated[float, Range(0.0)] = 0.0
    """Difference that counts as one distance from the bound; default: the magnitude of the bound."""

    def conditions(self, rows: Mapping[str, Row]) -> Iterator[Condition]:
        """Return the conditions on the rows of a scenario, by controller."""
        value = float(rows[self.controller].get(self.metric, math.nan))
        if self.relative_to:
            value = abs(value) / max(abs(float(rows[self.relative_to].get(self.metric, math.nan))), 1e-12)
        if self.minus:
            value = abs(value) - abs(float(rows[self.minus].get(self.metric, math.nan)))
        scale = self.scale or None
        if self.low > -_OPEN:
            yield at_least(value, self.low, scale)
        if self.high < _OPEN:
            yield at_most(value, self.high, scale)


@dataclass(frozen=True)
class OwnStatement:
    """A statement of the user."""

    id: str
    """Short name of the statement."""
    criteria: tuple[Criterion, ...]
    """Bounds that must all be kept."""
    maneuver: str = ""
    """Manoeuvre of the runs; may be left out if there is only one."""
    text: str = ""
    """The statement in words."""


@dataclass(frozen=True)
class MatchTable:
    """The table [match] of a study file."""

    statements: tuple[OwnStatement, ...] = ()
    """Statements of the user, beside those of the paper if the study has `claims = true`."""
    evaluations: Annotated[int, Range(1, 10_000_000)] = 1000
    """Number of evaluations: one scenario with all controllers each."""
    slack: Annotated[float, Range(0.0)] = 2.5
    """A setting is given up when its failed statements cost this much more than those of the best setting."""
    population: Annotated[int, Range(4, 1000)] = 14
    """Largest number of settings of a generation of the evolution strategy."""
    generations: Annotated[int, Range(1, 10_000)] = 25
    """Generations of a round over all factors; a round over some of them has a quarter of them."""
    spread: Annotated[float, Range(1e-3, 0.5)] = 0.08
    """Standard deviation of the first generation, in units of the ranges."""
    explore_every: Annotated[int, Range(0, 1000)] = 0
    """Every so many rounds over all factors, one starts anywhere in the ranges; 0 for never."""
    implausibility_cost: Annotated[float, Range(0.0)] = 0.3
    """Cost of a setting at the ends of its ranges; a failed statement costs 1 to 2."""
    room: Annotated[float, Range(1e-6, 1.0)] = 0.1
    """Margin to its criterion above which a statement that holds costs nothing, as a fraction of the bound."""


class Statements:
    """The statements of a match, by manoeuvre.

    Attributes:
        table: The table [match].
        seeds: Settings to begin with: factor -> value.
        of: Manoeuvre -> numbers of its statements.
    """

    def __init__(self, study: StudyFile) -> None:
        """Check the table [match] of a study."""
        source, given = study.source, dict(study.match or {})
        if study.case_list is not None or not study.factors:
            raise source.fail(("factors",), "a search needs factors")
        if len(study.vehicles) > 1:
            raise source.fail(("vehicles",), "a match is about one car")
        seeds = given.pop("seeds", [])
        self.table = build(MatchTable, given, source, ("match",))
        self._names = [label_of(item) for item in study.maneuvers]
        self._own: dict[str, list[OwnStatement]] = {name: [] for name in self._names}
        self.of = {
            name: [claim for claim, scenario in SCENARIO_OF.items() if study.claims and scenario == name]
            for name in self._names
        }
        for number, statement in enumerate(self.table.statements):
            self._add(study, number, statement)
        if not any(self.of.values()):
            raise source.fail(("match", "statements"), "there is no statement; give some, or claims = true")
        self.seeds = [_seed(study, number, seed) for number, seed in enumerate(_tables(study, seeds))]

    def _add(self, study: StudyFile, number: int, statement: OwnStatement) -> None:
        place = ("match", "statements", str(number))
        study.check_runs(place, statement.maneuver, {})
        maneuver = statement.maneuver or self._names[0]
        if any(statement.id in known for known in self.of.values()) or not statement.id:
            raise study.source.fail((*place, "id"), f"{shown(statement.id)} is used twice, or empty", statement.id)
        if not statement.criteria:
            raise study.source.fail((*place, "criteria"), "at least one is needed")
        for index, criterion in enumerate(statement.criteria):
            where = (*place, "criteria", str(index))
            keys = ("controller", "relative_to", "minus")
            study.check_runs(where, maneuver, {key: getattr(criterion, key) for key in keys})
            if criterion.low == -_OPEN and criterion.high == _OPEN:
                raise study.source.fail(where, "has no bound; low, high or both are needed")
        self._own[maneuver].append(statement)
        self.of[maneuver].append(statement.id)

    def check_metrics(self, study: StudyFile, maneuver: str, rows: Sequence[Row]) -> None:
        """Check that the runs have every metric of the user's statements."""
        for number, statement in enumerate(self.table.statements):
            for criterion in statement.criteria if statement in self._own[maneuver] else ():
                study.check_metric(("match", "statements", str(number), "criteria"), criterion.metric, rows[0])

    def distances(self, maneuver: str, rows: Sequence[Row]) -> dict[str, float]:
        """Return the distance of every statement from holding in the runs of a scenario; see `Claim.distance`."""
        if any(row["status"] != Status.OK for row in rows):
            return dict.fromkeys(self.of[maneuver], FAR)
        by_controller = {row["controller"]: row for row in rows}
        own = {statement.id: _distance(statement, by_controller) for statement in self._own[maneuver]}
        return {
            claim: own[claim] if claim in own else float(rows[0].get(f"{DISTANCE}{claim}", FAR))
            for claim in self.of[maneuver]
        }


def _distance(statement: OwnStatement, rows: Mapping[str, Row]) -> float:
    conditions = [part for criterion in statement.criteria for part in criterion.conditions(rows)]
    if all(condition.holds for condition in conditions):
        return -min(1.0, *(condition.margin for condition in conditions))
    return sum(condition.distance for condition in conditions)


def _tables(study: StudyFile, seeds: object) -> list[dict[str, Any]]:
    if not isinstance(seeds, Sequence) or not all(isinstance(seed, Mapping) for seed in seeds):
        raise study.source.fail(("match", "seeds"), "is no list of tables")
    return [dict(seed) for seed in seeds]


def _seed(study: StudyFile, number: int, seed: dict[str, Any]) -> dict[str, Any]:
    for key in seed:
        if key not in study.keys:
            raise study.source.fail(("match", "seeds", str(number), key), nearest_names(key, study.keys), key)
    return seed

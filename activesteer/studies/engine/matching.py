"""Match: settings of a study's factors in which as many statements as possible hold.

An evolution strategy (CMA-ES) searches the unit cube of the priors, in rounds: over the factors of one table and the
same manoeuvres, whose other scenarios need not be driven again, and over all. The cost of a setting is the sum over its
statements: 1 to 2 for one that fails, by its distance, and a little for one that holds by a thin margin; implausible
numbers cost a little too. Scenarios are driven one after the other, and a setting that cannot come near the best one of
its round is given up.

`sample` draws settings from the priors under the condition that at least a number of statements hold (Metropolis, with
proposals from the spread of the settings found; the uniform prior cancels, so that a setting is accepted if it holds).

Sources: N. Hansen, The CMA evolution strategy: a tutorial, arXiv 1604.00772; P. Marjoram et al., Markov chain Monte
Carlo without likelihoods, PNAS 100 (2003), 15324.
"""

from __future__ import annotations

import contextlib
import itertools
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import StudyError, not_installed
from activesteer.files import make_folder
from activesteer.scenario import FileOrTable
from activesteer.studies.engine.factor_values import label_of
from activesteer.studies.engine.match_file import Statements
from activesteer.studies.engine.match_store import Candidate, Evaluation, MatchStore
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.prior import Prior
from activesteer.studies.engine.run_identity import digest
from activesteer.studies.engine.run_settings import prepare
from activesteer.studies.engine.run_task import Row, drive
from activesteer.studies.engine.store import LOCK, locked
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.task_queue import TaskQueue
from activesteer.studies.engine.workers import workers_for

Point = NDArray[np.float64]
Progress = Callable[[int, int, int, int], None]
"""Called with the evaluations done, their total, and the best count of the number of statements."""
_GIVEN_UP: Final = 0.7
"""Cost of each statement of a scenario that was not driven."""
_SAMPLE: Final = "sample"
_NEIGHBOUR: Final = "neighbour of "
"""Origins of settings."""
_SCALE: Final = 0.35
"""Factor on the spread of the settings found, for a proposal of `sample`."""


@dataclass(frozen=True)
class Match:
    """Result of a match.

    Attributes:
        study: The study.
        prior: Ranges and nominal values.
        statements: Numbers of all statements.
        evaluations: Scenarios driven, with all controllers each.
        candidates: All settings that were tried.
        seeds: Settings that the study file gave.
    """

    study: StudyFile
    prior: Prior
    statements: tuple[str, ...]
    evaluations: int
    candidates: tuple[Candidate, ...]
    seeds: int

    @property
    def complete(self) -> list[Candidate]:
        """Settings whose statements were all judged."""
        return [one for one in self.candidates if len(one.distances) == len(self.statements)]

    @property
    def best(self) -> Candidate | None:
        """The most plausible of the settings in which the most statements hold."""
        return max(
            self.complete, key=lambda one: (len(one.holding), -self.prior.implausibility(one.values)), default=None
        )

    @property
    def front(self) -> list[Candidate]:
        """For each number of statements from the best down, the most plausible setting, if it is more plausible."""
        front: list[Candidate] = []
        ordered = sorted(self.complete, key=lambda one: (-len(one.holding), self.prior.implausibility(one.values)))
        for one in ordered:
            size = self.prior.implausibility(one.values)
            last = front[-1] if front else None
            if last is None or (len(one.holding) < len(last.holding) and size < self.prior.implausibility(last.values)):
                front.append(one)
        return front

    @property
    def never_together(self) -> list[tuple[str, str]]:
        """Pairs of statements that each hold in some setting, and in none of the settings together."""
        held = [set(one.holding) for one in self.complete]
        ever = [claim for claim in self.statements if any(claim in own for own in held)]
        return [
            (one, other)
            for one, other in itertools.combinations(ever, 2)
            if not any(one in own and other in own for own in held)
        ]

    def quantiles(self, least: int) -> dict[str, tuple[float, float, float]]:
        """Return the 5, 50 and 95 % quantiles of each number in the settings in which enough statements hold.

        Settings drawn by `sample` under this condition count alone, if there are any: they are a posterior. The others
        only show where the search has been.
        """
        kept = [one for one in self.complete if len(one.holding) >= least]
        drawn = [one for one in kept if one.origin == f"{_SAMPLE}{least}"] or kept
        found = {}
        for factor in self.prior.searched if drawn else ():
            if not factor.values:
                low, middle, high = np.quantile([one.values[factor.key] for one in drawn], (0.05, 0.5, 0.95)).tolist()
                found[factor.key] = low, middle, high
        return found

    @property
    def robustness(self) -> tuple[int, int]:
        """Number of neighbours in which at most one statement fewer holds than in their setting, and of neighbours."""
        near = [one for one in self.complete if one.origin.startswith(_NEIGHBOUR)]
        by_number = {one.number: one for one in self.candidates}
        origins = [by_number[int(one.origin.removeprefix(_NEIGHBOUR))] for one in near]
        kept = sum(len(one.holding) >= len(at.holding) - 1 for one, at in zip(near, origins, strict=True))
        return kept, len(near)

    def to_json(self) -> dict[str, Any]:
        """Return the result as JSON values."""
        kept, neighbours = self.robustness
        return {
            "never_together": [list(pair) for pair in self.never_together],
            "robustness": {"kept": kept, "neighbours": neighbours},
            "statements": list(self.statements),
            "evaluations": self.evaluations,
            "settings": len(self.candidates),
            "best": None if self.best is None else self.described(self.best),
            "front": [self.described(one) for one in self.front],
        }

    def described(self, one: Candidate) -> dict[str, Any]:
        """Return a setting as JSON values."""
        return {
            "number": one.number,
            "origin": one.origin,
            "holds": len(one.holding),
            "fails": [claim for claim in self.statements if claim not in one.holding],
            "implausibility": self.prior.implausibility(one.values),
            "plausibility": self.prior.plausibility(one.values).value,
            "values": one.values,
            "distances": one.distances,
        }


def match(
    study_file: FileOrTable,
    output: str | os.PathLike[str],
    *,
    evaluations: int | None = None,
    least: int | None = None,
    neighbours: float | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Match:
    """Search for settings in which as many statements as possible hold; a search found in the folder is resumed.

    In place of the search, `least` draws settings in which at least so many statements hold, and `neighbours` drives
    settings whose numbers differ from those of the best one by up to this fraction. `evaluations` is the total number,
    by default that of the file. See `study` for the other arguments.
    """
    study = read_study(study_file, "match")
    with contextlib.ExitStack() as stack:
        search = _Search(study, Path(output), progress, stack)
        workers = stack.enter_context(workers_for(jobs, scheduler=scheduler))
        total = search.statements.table.evaluations if evaluations is None else evaluations
        prepare(workers, search.plan.settings)
        search.queue = TaskQueue(workers)
        if neighbours is not None:
            search.neighbours(total, neighbours)
        elif least is not None:
            search.sample(total, least)
        else:
            search.run(total)
        return search.result


def read_match(study_file: FileOrTable, folder: str | os.PathLike[str]) -> Match:
    """Return the match in a folder as far as it is."""
    return _Search(read_study(study_file, "match"), Path(folder), None, None).result


class _Search:
    """A search, its store and its workers."""

    def __init__(
        self, study: StudyFile, folder: Path, progress: Progress | None, stack: contextlib.ExitStack | None
    ) -> None:
        """Check the study and open the folder, which is locked until the stack ends; without a stack, only read it."""
        self.study, self.progress = study, progress
        self.statements = Statements(study)
        self.plan, self.prior = Plan(study), Prior(study)
        if stack is not None:
            stack.enter_context(locked(make_folder(folder, StudyError) / LOCK))
        self.store = MatchStore(folder, f"# {self.plan.digest}\n{study.to_toml()}", reads=stack is None)
        self.names = [label_of(item) for item in study.maneuvers]
        self.all = [claim for name in self.names for claim in self.statements.of[name]]
        self.queue: Any = None
        self.total, self.best = 0, 0
        self._checked: set[str] = set()

    @property
    def result(self) -> Match:
        """The match so far."""
        return Match(
            self.study, self.prior, tuple(self.all), self.store.evaluations, tuple(self.store.candidates.values()),
            len(self.statements.seeds),
        )  # fmt: skip

    def run(self, total: int) -> None:
        """Search until so many evaluations are made."""
        self.total = total
        if not self.store.candidates and total:
            first = [self.prior.nominal, *({**self.prior.nominal, **seed} for seed in self.statements.seeds)]
            self.evaluate([self.prior.point(values) for values in first], ["nominal", *["seed"] * (len(first) - 1)])
        blocks, table = self._blocks(), self.statements.table
        rounds = sum(1 for _ in {one.origin for one in self.store.candidates.values() if one.origin.startswith("r")})
        for number in itertools.count(rounds):
            if self.store.evaluations >= total:
                return
            turn, place = divmod(number, len(blocks))
            anywhere = (
                place == len(blocks) - 1
                and table.explore_every
                and turn % table.explore_every == table.explore_every - 1
            )
            self._round(number, blocks[place], anywhere=bool(anywhere))

    def _blocks(self) -> list[list[int]]:
        """Return the coordinates of each kind of round: those of one table and the same manoeuvres, and all."""
        searched = self.prior.searched
        groups: dict[tuple[str, ...], list[int]] = {}
        for place, factor in enumerate(searched):
            groups.setdefault(factor.maneuvers or (*self.names, factor.key.partition(".")[0]), []).append(place)
        whole = list(range(len(searched)))
        cheapest_first = [groups[key] for key in sorted(groups, key=len)]
        return [whole] if len(groups) == 1 else [*cheapest_first, whole]

    def _round(self, number: int, block: list[int], *, anywhere: bool) -> None:
        """Make generations of the evolution strategy around the best setting, or anywhere."""
        try:
            import cma  # noqa: PLC0415 - an extra
        except ImportError as reason:
            raise not_installed(StudyError, "activesteer match", "cma", "study") from reason
        table, rng = self.statements.table, np.random.default_rng([self.study.seed, number])
        best = min(self.result.complete, key=self._cost, default=None)
        centre = rng.random(len(self.prior.searched)) if anywhere or best is None else self.prior.point(best.values)
        limit = np.inf if anywhere or best is None else self._cost(best)
        sigma = 0.3 if anywhere else table.spread * (1.0 if len(block) == len(centre) else 1.5)
        size = min(table.population, 4 + round(3.0 * np.log(len(block) + 1)))
        start = np.clip(centre[block], 1e-3, 1.0 - 1e-3)
        strategy = cma.CMAEvolutionStrategy(
            start if len(block) > 1 else np.append(start, 0.5),  # cma needs two; the second has no effect
            sigma,
            {"bounds": [0.0, 1.0], "popsize": size, "seed": number + 1 + 1000 * self.study.seed,
             "verbose": -9},
        )  # fmt: skip
        whole = len(block) == len(centre)
        for _ in range(table.generations if whole else max(1, table.generations // 4)):
            asked = strategy.ask()
            points = []
            for some in asked:
                point = centre.copy()
                point[block] = some[: len(block)]
                points.append(point)
            costs = self.evaluate(points, [f"r{number}"] * len(points), limit + table.slack)
            limit = min(limit, *costs)
            strategy.tell(asked, costs)
            if self.store.evaluations >= self.total or strategy.stop():
                return

    def sample(self, total: int, least: int) -> None:
        """Draw settings in which at least so many statements hold."""
        self.total = total
        good = [one for one in self.result.complete if len(one.holding) >= least]
        if len(good) < 2:
            raise StudyError(f"{len(good)} settings have {least} statements that hold; search further first")
        rng = np.random.default_rng([self.study.seed, len(self.store.candidates)])
        chosen = rng.choice(len(good), min(len(good), self.statements.table.population), replace=False)
        chains = [self.prior.point(good[place].values) for place in chosen]
        spread = np.std([self.prior.point(one.values) for one in good], axis=0) + 0.01
        origin = f"{_SAMPLE}{least}"
        while self.store.evaluations < total:
            moves = rng.normal(size=(len(chains), len(spread))) * spread * _SCALE
            moves *= rng.random(moves.shape) < max(0.3, 4.0 / len(spread))  # some numbers at a time
            proposed = [chain + move for chain, move in zip(chains, moves, strict=True)]
            inside = [bool(((point >= 0.0) & (point <= 1.0)).all()) for point in proposed]
            tried = [point for point, into in zip(proposed, inside, strict=True) if into]
            first = max(self.store.candidates) + 1
            self.evaluate(tried, [origin] * len(tried), most=len(self.all) - least)
            numbers = itertools.count(first)
            for place, into in enumerate(inside):
                if into:
                    one = self.store.candidates[next(numbers)]
                    if len(one.distances) == len(self.all) and len(one.holding) >= least:
                        chains[place] = proposed[place]

    def neighbours(self, total: int, fraction: float) -> None:
        """Drive settings around the best one, each number multiplied by up to 1 +- `fraction`."""
        self.total = total
        best = self.result.best
        if best is None:
            raise StudyError("no setting is complete; search first")
        rng = np.random.default_rng([self.study.seed, len(self.store.candidates)])
        while self.store.evaluations < total:
            points = []
            for _ in range(self.statements.table.population):
                moved = {
                    key: value * rng.uniform(1.0 - fraction, 1.0 + fraction) if isinstance(value, float) else value
                    for key, value in best.values.items()
                }
                points.append(self.prior.point(moved))
            self.evaluate(points, [f"{_NEIGHBOUR}{best.number}"] * len(points))

    def evaluate(
        self, points: Sequence[Point], origins: Sequence[str], limit: float = np.inf, most: int | None = None
    ) -> list[float]:
        """Return the costs of settings, which are driven until they exceed a cost, or more statements fail."""
        first = max(self.store.candidates, default=-1) + 1
        candidates = [
            Candidate(first + place, self.prior.values(point), origin)
            for place, (point, origin) in enumerate(zip(points, origins, strict=True))
        ]
        for one in candidates:
            self.store.begin(one)
        mine = [self.store.candidates[one.number] for one in candidates]
        tasks = (task for one in mine if (task := self._next(one, limit, most)) is not None)
        for (number, maneuver, key), rows, error in self.queue.outcomes(tasks):
            one = self.store.candidates[number]
            if error is not None:
                raise error
            self._check(maneuver, rows)
            self.store.add(one, maneuver, key, self._evaluation(maneuver, rows))
            self._tell(one)
            if (task := self._next(one, limit, most)) is not None:
                self.queue.add(*task)
        return [self._cost(one) for one in mine]

    def _next(self, one: Candidate, limit: float, most: int | None) -> tuple[Any, ...] | None:
        """Return the task of the next scenario of a setting; None if it is complete or given up."""
        for place, maneuver in enumerate(self.names):
            if maneuver in one.scenarios:
                continue
            failed = sum(distance > 0.0 for distance in one.distances.values())
            if self._driven_cost(one) > limit or (most is not None and failed > most):
                return None
            requests = [
                self.plan.request_with(controller, one.number, (place, 0, controller), one.values)
                for controller in range(len(self.plan.settings.controllers))
            ]
            key = digest({"overrides": requests[0].overrides})[:16]
            if (maneuver, key) in self.store.known:
                self.store.add(one, maneuver, key, self.store.known[maneuver, key])
                continue
            return (one.number, maneuver, key), drive, self.plan.settings, requests
        return None

    def _evaluation(self, maneuver: str, rows: list[Row]) -> Evaluation:
        about = {"run", "sample", *self.study.keys}
        metrics = {
            row["controller"]: {
                name: float(f"{value:.6g}")
                for name, value in row.items()
                if isinstance(value, float) and name not in about and not name.startswith(("claim", "distance_"))
            }
            for row in rows
        }
        distances = self.statements.distances(maneuver, rows)
        return Evaluation({claim: float(f"{value:.5g}") for claim, value in distances.items()}, metrics)

    def _check(self, maneuver: str, rows: list[Row]) -> None:
        if maneuver not in self._checked and all(row["status"] == "ok" for row in rows):
            self._checked.add(maneuver)
            self.statements.check_metrics(self.study, maneuver, rows)

    def _driven_cost(self, one: Candidate) -> float:
        table = self.statements.table
        return sum(
            1.0 + distance / (1.0 + distance) if distance > 0.0 else 0.3 * max(0.0, 1.0 + distance / table.room)
            for distance in one.distances.values()
        )

    def _cost(self, one: Candidate) -> float:
        missing = sum(len(self.statements.of[name]) for name in self.names if name not in one.scenarios)
        implausible = self.statements.table.implausibility_cost * self.prior.implausibility(one.values)
        return self._driven_cost(one) + _GIVEN_UP * missing + implausible

    def _tell(self, one: Candidate) -> None:
        if len(one.distances) == len(self.all):
            self.best = max(self.best, len(one.holding))
        if self.progress is not None:
            self.progress(self.store.evaluations, self.total, self.best, len(self.all))


def lines_of(found: Match, least: int | None = None) -> Iterator[str]:
    """Yield the result for a terminal; with `least`, the quantiles of the numbers too."""
    yield f"{found.evaluations} evaluations of {len(found.candidates)} settings"
    for one in found.front:
        about = found.described(one)
        fails = f"; fails: {' '.join(about['fails'])}" if about["fails"] else ""
        yield (
            f"{about['holds']:3} of {len(found.statements)} hold, implausibility {about['implausibility']:.2f} "
            f"({about['plausibility']}), setting {one.number}{fails}"
        )
    if found.best is not None:
        yield "values of the best:"
        distances = found.prior.distances(found.best.values)
        for key, value in found.best.values.items():
            shown = f"{value:.4g}" if isinstance(value, float) else str(value)
            yield f"  {key} = {shown}" + (f"  ({distances[key]:+.2f})" if key in distances else "")
    if pairs := found.never_together:
        yield f"hold alone and never together: {', '.join('+'.join(pair) for pair in pairs)}"
    kept, neighbours = found.robustness
    if neighbours:
        yield f"{kept} of {neighbours} neighbours keep all statements but one"
    if least is not None:
        yield f"5, 50 and 95 % of the settings in which at least {least} hold:"
        for key, quantiles in found.quantiles(least).items():
            yield f"  {key}: " + ", ".join(f"{value:.4g}" for value in quantiles)

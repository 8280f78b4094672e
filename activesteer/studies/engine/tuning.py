"""Searches over the factors of a study with Optuna, resumable and on several workers.

`tune_table` describes the goals. A requirement to violate is searched for each controller in each manoeuvre. A
violation disproves the requirement; a search without a violation proves nothing.
"""

from __future__ import annotations

import functools
import itertools
import json
import math
import os
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from activesteer.analysis.requirement import ANY, Names, Requirement
from activesteer.core.files import file_word, finite, make_folder, reading, write_text
from activesteer.errors import ParameterError, StudyError, nearest_names, not_installed, shown
from activesteer.scenario import FileOrTable
from activesteer.studies.engine.analysis import without_effect
from activesteer.studies.engine.factor_values import Plausibility
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.runs import Request, Row, Status, drive, prepare, run_command
from activesteer.studies.engine.store import LOCK, locked
from activesteer.studies.engine.study_file import StudyFile, label_of, read_study
from activesteer.studies.engine.tune_table import TABLE, Goal, Judge, TuneTable, read_table
from activesteer.studies.engine.workers import Progress, TaskQueue, Workers, workers_for

_STARTUP: Final = 0.2
"""Fraction of the sets that the sampler draws at random before it learns to violate a requirement."""
_WARM: Final = 10
"""Number of times that a warm start of CMA-ES counts its source: it learns from the best tenth of its sources."""


@dataclass(frozen=True)
class Trial:
    """A set of values, with its judgement."""

    number: int
    values: dict[str, Any]  # factor -> value
    objectives: dict[str, float]  # name of an objective -> its value
    # Name of a statement -> its margin, negative if it is violated; at most 1e6 in magnitude
    margins: dict[str, float] = field(default_factory=dict)
    constraints: dict[str, float] = field(default_factory=dict)  # name of a constraint -> its margin
    # Distance from the nominal values, see `factor_values`; nan if statements are not the goal
    implausibility: float = math.nan

    @property
    def holding(self) -> list[str]:
        """Names of the statements that hold."""
        return [name for name, margin in self.margins.items() if margin >= 0.0]

    @property
    def allowed(self) -> bool:
        """True if all constraints are satisfied."""
        return all(margin >= 0.0 for margin in self.constraints.values())


@dataclass(frozen=True)
class Tuning:
    """Result of a search: all sets, and the best sets."""

    goal: Goal
    done: int  # number of all sets that were tried
    runs: int  # number of their runs
    trials: list[Trial]  # all sets that could be judged
    # The best set. For several objectives, all sets that no other set beats. For statements, the most plausible set for
    # each number of them, from the most down. For a violation, the set with the least margin.
    front: list[Trial]
    # Factors that change no metric of any run, if objectives are the goal and sets were tried now
    without_effect: list[str] = field(default_factory=list)
    requirement: str = ""  # the requirement to violate
    controller: str = ""  # the examined controller of a violation
    maneuver: str = ""  # the manoeuvre of a violation
    # Controller -> command line that repeats its run of the worst set
    commands: dict[str, str] = field(default_factory=dict)
    plausibility: Plausibility | None = None  # plausibility of the best set, if statements are the goal

    @property
    def failed(self) -> int:
        """Number of sets that could not be judged."""
        return self.done - len(self.trials)

    @property
    def violations(self) -> int:
        """Number of sets that violate the requirement."""
        return sum(trial.margins[ANY] < 0.0 for trial in self.trials) if self.goal is Goal.VIOLATE else 0

    @property
    def fall(self) -> list[tuple[int, float]]:
        """Number of runs and least margin at every improvement of a search for a violation."""
        found: list[tuple[int, float]] = []
        for trial in self.trials if self.goal is Goal.VIOLATE else ():
            if not found or trial.margins[ANY] < found[-1][1]:
                found.append(((trial.number + 1) * self.runs // self.done, trial.margins[ANY]))
        return found

    @property
    def never_together(self) -> list[tuple[str, str]]:
        """Pairs of statements that hold separately, but never in the same set."""
        held = [set(trial.holding) for trial in self.trials] if self.goal is Goal.SATISFY else []
        ever = dict.fromkeys(
            name for trial in self.trials for name in trial.margins if any(name in own for own in held)
        )
        return [pair for pair in itertools.combinations(ever, 2) if not any(own.issuperset(pair) for own in held)]

    def to_json(self) -> dict[str, Any]:
        """Return the result as JSON values, without the list of all sets."""
        names = {
            Goal.MINIMISE: ("without_effect",),
            Goal.SATISFY: ("never_together", "plausibility"),
            Goal.VIOLATE: ("controller", "maneuver", "requirement", "violations", "fall", "commands"),
        }[self.goal]
        front = [vars(trial) for trial in self.front]
        about = {name: getattr(self, name) for name in ("goal", "done", "failed", "runs", *names)}
        return finite({**about, "front": front})


def tune(
    study_file: FileOrTable,
    output: str | os.PathLike[str],
    *,
    controllers: Sequence[str] | None = None,
    maneuvers: Sequence[str] | None = None,
    trials: int | None = None,
    runs: int | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Progress = lambda *_: None,
) -> list[Tuning]:
    """Search the ranges of a study's factors.

    Every set is driven in all manoeuvres with all controllers.

    There is one search, or one for each controller in each manoeuvre if the goal is to violate a requirement;
    `controllers` and `maneuvers` choose them, by default as in the file. Each then has a folder below the output. A
    search found in its folder is resumed, up to `trials` sets in total, or as many as `runs` allows; by default as in
    the file. See `study` for the other arguments.
    """
    folder = make_folder(output, StudyError)
    if (folder / "study.toml").exists():
        raise StudyError(f"{folder} holds a study; use a new folder for the search", value=folder)
    searches = _searches(read_study(study_file, TABLE), folder, controllers, maneuvers)
    _optuna()
    with workers_for(jobs, scheduler=scheduler) as workers:
        return [search.run(workers, trials, runs, progress) for search in searches]


def read_tuning(study_file: FileOrTable, folder: str | os.PathLike[str]) -> Tuning:
    """Return the progress of the search in a folder, even if another version of the package drove it."""
    (search,) = _searches(read_study(study_file, TABLE), Path(folder), None, None)
    return search.result(search.stored())


def _searches(
    study: StudyFile, folder: Path, controllers: Sequence[str] | None, maneuvers: Sequence[str] | None
) -> list[_Search]:
    table, labels = read_table(study), {label_of(item): item for item in study.maneuvers}
    if table.goal is not Goal.VIOLATE:
        for option, given in {"--controller": controllers, "--maneuver": maneuvers}.items():
            if given:
                raise ParameterError("has an effect only in a search with the goal violate", key=option, value=given)
        return [_Search(replace(study, metrics=()), table, folder)]
    if len(study.vehicles) > 1:
        raise study.source.fail(("vehicles",), "a search for a violation needs one vehicle")
    for name in maneuvers or ():
        if name not in labels:
            problem = f"the study has no manoeuvre {shown(name)}; {nearest_names(name, labels)}"
            raise ParameterError(problem, key="--maneuver", value=name, allowed=tuple(labels))
    found = []
    for name, maneuver in itertools.product(controllers or study.controllers, maneuvers or labels):
        own = label_of(name)
        names = Names(None, [maneuver], own)
        runs = [run for _, run in Requirement(table.violate, names, study.source, (TABLE, Goal.VIOLATE)).metrics]
        driven = (name, *dict.fromkeys(run.controller for run in runs if label_of(run.controller) != own))
        factors = [factor for factor in study.factors if not factor.maneuvers or maneuver in factor.maneuvers]
        if not factors:
            raise study.source.fail(("factors",), f"none of them varies in {maneuver}; a search needs factors")
        varied = tuple(replace(factor, maneuvers=()) for factor in factors)
        one = replace(study, metrics=(), controllers=driven, maneuvers=(labels[maneuver],), factors=varied)
        below = folder / f"{file_word(own)}-{file_word(maneuver)}"
        found.append(_Search(one, table, make_folder(below, StudyError), own, maneuver))
    return found


@functools.cache
def _optuna() -> Any:
    try:
        import cmaes  # noqa: F401, PLC0415 - of Optuna's CmaEsSampler
        import optuna  # noqa: PLC0415 - an extra
    except ImportError as reason:
        raise not_installed(StudyError, "activesteer tune", str(reason.name), "study") from reason
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna


class _Search:
    """One search: its runs, its expressions and its folder."""

    def __init__(
        self, study: StudyFile, table: TuneTable, folder: Path, examined: str = "", maneuver: str = ""
    ) -> None:
        """Check the study and prepare the search."""
        self.plan, self.table, self.folder, self.goal = Plan(study), table, folder, table.goal
        self.examined, self.maneuver = examined, maneuver
        self.judge = Judge(self.plan, table, examined)
        items = (study.maneuvers, study.vehicles, study.controllers)
        self._places: Any = list(itertools.product(*(range(len(item)) for item in items)))
        self._seen: Sequence[Row] = ()

    def run(self, workers: Workers, trials: int | None, runs: int | None, progress: Progress) -> Tuning:
        """Try the remaining sets, and store the result."""
        total = self.table.trials if trials is None else trials
        total = max(1, runs // len(self._places)) if runs is not None else total
        if self.table.sampler == "grid":
            total = min(total, math.prod(len(factor.values) for factor in self.plan.study.factors))
        with locked(self.folder / LOCK):
            self._claim_folder()
            made = self.stored()
            self._search(made, total, workers, progress)
        found = self.result(made)
        name = "worst" if self.goal is Goal.VIOLATE else "front"
        write_text(self.folder / f"{name}.json", json.dumps(found.to_json(), indent=2) + "\n", StudyError)
        return found

    def _claim_folder(self) -> None:
        """Write the study into the folder, or check that the folder holds the same search."""
        study = self.plan.study
        lines = {key: value for key, value in (study.tune or {}).items() if key != "trials"}
        text = f"# {self.plan.digest}\n{replace(study, tune=lines).to_toml()}"
        path = self.folder / f"{TABLE}.toml"
        held = path.read_text(encoding="utf-8", errors="replace") if path.exists() else text
        if held != text:
            same = held.partition("\n")[2] == text.partition("\n")[2]
            what = "this search with other versions of its files or of activesteer" if same else "another search"
            raise StudyError(f"{self.folder} holds {what}; use a new folder", value=self.folder)
        write_text(path, text, StudyError)

    def stored(self) -> Any:
        """Return the study of Optuna in the folder."""
        optuna = _optuna()
        from optuna.storages import JournalStorage, journal  # noqa: PLC0415 - an extra

        path = self.folder / f"{TABLE}.journal"
        if path.exists():
            with reading(path, StudyError):
                whole, _, rest = path.read_bytes().rpartition(b"\n")
            if rest:  # a process was killed while writing
                path.write_bytes(whole + b"\n" if whole else b"")
        lock = journal.JournalFileOpenLock(str(path))
        directions = ["minimize"] * max(1, len(self.judge.objectives))
        storage = JournalStorage(journal.JournalFileBackend(str(path), lock_obj=lock))
        return optuna.create_study(storage=storage, study_name=TABLE, load_if_exists=True, directions=directions)

    def _search(self, made: Any, total: int, workers: Workers, progress: Progress) -> None:
        states = _optuna().trial.TrialState
        for left in made.get_trials(deepcopy=False, states=(states.RUNNING,)):  # left by a killed process
            made.tell(left.number, state=states.FAIL)
        waiting = len(made.get_trials(deepcopy=False, states=(states.WAITING,)))
        done = len(made.trials) - waiting
        if done >= total:
            return
        if not made.trials:
            seeds = self._seeds()
            waiting = len(seeds)
            for seed in seeds:
                made.enqueue_trial(seed)
        prepare(workers, self.plan.settings)
        for end in dict.fromkeys((min(done + waiting, total), total)):
            made.sampler = self._sampler(made, total)
            for trial, rows, error in TaskQueue(workers).outcomes(self._tasks(made, end - done)):
                done += 1
                self._tell(made, trial, [] if error is not None else rows)
                progress(f"{self.examined} {self.maneuver}".strip(), done, total)

    def _tasks(self, made: Any, count: int) -> Iterator[tuple[Any, ...]]:
        for _ in range(count):
            trial = made.ask()
            values = {factor.key: _suggest(trial, factor) for factor in self.plan.study.factors}
            yield trial, drive, self.plan.settings, self._requests(trial.number, values)

    def _requests(self, number: int, values: dict[str, Any]) -> list[Request]:
        """Return the runs of a set, in all manoeuvres and vehicles with all controllers."""
        return [self.plan.request_with(run, number, place, values) for run, place in enumerate(self._places)]

    def _seeds(self) -> list[dict[str, Any]]:
        """Return the first sets to try: seeds, a whole grid, or the nominal values for statements."""
        factors, prior, seeds = self.plan.study.factors, self.judge.prior, self.table.seeds
        # Optuna's own samplers of grids end the search when they are through, which fails outside of its loop.
        if self.table.sampler == "grid":
            combinations = itertools.product(*(factor.values for factor in factors))
            return [dict(zip(self.plan.study.keys, values, strict=True)) for values in combinations]
        if prior is None:
            return list(seeds)
        nominal = dict(prior.nominal)
        for factor in factors:
            if not factor.values:
                nominal[factor.key] = min(max(nominal[factor.key], factor.low), factor.high)
        return [nominal, *({**nominal, **seed} for seed in seeds)]

    def _sampler(self, made: Any, total: int) -> Any:
        """Return the sampler of Optuna, with a new seed after a resumption."""
        optuna, seed = _optuna(), self.plan.study.seed + len(made.trials)
        best: list[Any] = []
        name = self.table.sampler
        if name == "auto":
            name = "cma_es" if self.goal is Goal.SATISFY and not self.judge.constraints else "tpe"
        if name == "cma_es":
            states = (optuna.trial.TrialState.COMPLETE,)
            best = sorted(made.get_trials(deepcopy=False, states=states), key=lambda trial: trial.value)[:1]
        startup = max(10, round(_STARTUP * total)) if self.goal is Goal.VIOLATE else 10
        samplers = optuna.samplers
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            return {
                "tpe": lambda: samplers.TPESampler(seed=seed, constant_liar=True, n_startup_trials=startup),
                "cma_es": lambda: samplers.CmaEsSampler(
                    seed=seed, warn_independent_sampling=False, source_trials=best * _WARM or None
                ),
                "nsga2": lambda: samplers.NSGAIISampler(seed=seed, population_size=min(50, max(4, total // 10))),
                "random": lambda: samplers.RandomSampler(seed=seed),
                "grid": lambda: samplers.RandomSampler(seed=seed),
                "qmc": lambda: samplers.QMCSampler(
                    seed=seed, warn_independent_sampling=False, warn_asynchronous_seeding=False
                ),
            }[name]()

    def _tell(self, made: Any, trial: Any, rows: Sequence[Row]) -> None:
        """Judge a set from the rows of its runs."""
        found = self.judge.judged(rows, trial.params)
        if found is None:
            made.tell(trial, state=_optuna().trial.TrialState.FAIL)
            return
        if all(row["status"] == Status.OK for row in rows):
            self._seen = rows
        trial.set_user_attr("margins", found.margins)
        trial.set_user_attr("constraints", found.constraints)
        for name, margin in found.constraints.items():
            trial.set_constraint(name, -margin)
        made.tell(trial, found.objectives)

    def result(self, made: Any) -> Tuning:
        """Return the result of all sets."""
        states = _optuna().trial.TrialState
        done = [trial for trial in made.get_trials(deepcopy=False) if trial.state.is_finished()]
        trials = [self._trial(trial) for trial in done if trial.state == states.COMPLETE]
        best, study = {trial.number for trial in made.best_trials}, self.plan.study
        front = _different([trial for trial in trials if trial.number in best])
        found = Tuning(self.goal, len(done), len(done) * len(self._places), trials, front)
        if self.goal is Goal.MINIMISE:
            return replace(found, without_effect=without_effect(self.plan, self._seen))
        if self.judge.prior is not None:
            front = _plausible([trial for trial in trials if trial.allowed])
            return replace(
                found, front=front, plausibility=self.judge.prior.plausibility(front[0].values) if front else None
            )
        commands = {
            label_of(name): run_command(study.maneuvers[0], name, study.vehicles[0], overrides, study.driver)
            for one in front[:1]
            for overrides in (self._requests(0, one.values)[0].overrides,)
            for name in study.controllers
        }
        text = self.judge.statements[ANY].text
        return replace(found, requirement=text, controller=self.examined, maneuver=self.maneuver, commands=commands)

    def _trial(self, trial: Any) -> Trial:
        return Trial(
            trial.number,
            dict(trial.params),
            dict(zip(self.judge.objectives, trial.values, strict=True)) if self.judge.objectives else {},
            trial.user_attrs["margins"],
            trial.user_attrs["constraints"],
            math.nan if self.judge.prior is None else self.judge.prior.implausibility(trial.params),
        )


def _different(trials: Sequence[Trial]) -> list[Trial]:
    """Return the first trial of every set of values, since a sampler may try the values of grids again."""
    first: list[Trial] = []
    for one in trials:
        if all(one.values != other.values for other in first):
            first.append(one)
    return first


def _plausible(trials: Sequence[Trial]) -> list[Trial]:
    """Return the most plausible set for each number of statements that hold, in descending order."""
    front: list[Trial] = []
    for one in sorted(trials, key=lambda trial: (-len(trial.holding), trial.implausibility)):
        last = front[-1] if front else None
        if last is None or (len(one.holding) < len(last.holding) and one.implausibility < last.implausibility):
            front.append(one)
    return front


def _suggest(trial: Any, factor: Factor) -> Any:
    if factor.values:
        return trial.suggest_categorical(factor.key, factor.values)
    return trial.suggest_float(factor.key, factor.low, factor.high, log=factor.kind == "log_uniform")

"""Falsification: the worst case of a requirement within ranges of factors, by a search with robustness as objective.

A requirement file is a study file with a table [falsify]. For every examined controller in every manoeuvre, a search
drives sets of values and moves towards the least robustness. A violation is a proof; the absence of one is none.

Source: G. Fainekos, G. Pappas, Robustness of temporal logic specifications for continuous-time signals, Theoretical
Computer Science 410 (2009); tools of the kind are S-TaLiRo and Breach.
"""

from __future__ import annotations

import functools
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Final

from activesteer.config import Range, build
from activesteer.controllers import find_controller
from activesteer.errors import ParameterError, StudyError, nearest_names
from activesteer.files import file_word, finite, make_folder, write_text
from activesteer.scenario import FileOrTable
from activesteer.studies.engine.factor_values import label_of
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.requirement import HARM, Requirement
from activesteer.studies.engine.row_table import IDENTITY, OUTCOME
from activesteer.studies.engine.run_command import run_command
from activesteer.studies.engine.run_task import Row, Status
from activesteer.studies.engine.search import Judgement, claim_folder, import_optuna, refuse_study, search
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.workers import Workers, workers_for

SAMPLERS: Final = ("tpe", "random", "qmc")
_MOST: Final = 1e6
"""Bound of the robustness in a search, for runs that define no metric."""
_STARTUP: Final = 0.2
"""Fraction of the sets that the sampler draws at random before it learns."""


@dataclass(frozen=True)
class FalsifyTable:
    """The table [falsify] of a requirement file."""

    requirement: str
    """What shall hold for every run; see `engine.requirement`."""
    runs: Annotated[int, Range(2, 1_000_000)] = 500
    """Budget of runs for each controller in each manoeuvre, with the runs of all controllers that the requirement
    names."""
    sampler: str = "tpe"
    """Sampler of Optuna: `tpe` learns; `random` and `qmc` cover the ranges."""


@dataclass(frozen=True)
class Falsified:
    """Result of the search for one controller in one manoeuvre.

    Attributes:
        controller: The controller.
        maneuver: The manoeuvre.
        requirement: The requirement.
        runs: Runs made.
        failed: Sets that could not be judged.
        violations: Sets that violate the requirement.
        robustness: Least robustness; below zero the requirement is violated. nan if no set could be judged.
        values: Factors of the worst case.
        commands: Controller -> command line that repeats its run of the worst case.
        fall: Number of runs and least robustness so far, at every improvement.
        sets: Factors and robustness of every judged set.
    """

    controller: str
    maneuver: str
    requirement: str
    runs: int
    failed: int
    violations: int
    robustness: float
    values: Mapping[str, Any]
    commands: Mapping[str, str]
    fall: Sequence[tuple[int, float]]
    sets: Sequence[tuple[Mapping[str, Any], float]]

    @property
    def violated(self) -> bool:
        """Return True if a set violates the requirement."""
        return self.violations > 0

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, without the sets."""
        table = {key: value for key, value in asdict(self).items() if key != "sets"}
        return finite({**table, "violated": self.violated})


def falsify(
    requirement_file: FileOrTable,
    output: str | os.PathLike[str],
    *,
    controllers: Sequence[str] | None = None,
    maneuvers: Sequence[str] | None = None,
    runs: int | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> list[Falsified]:
    """Search for the worst case of a requirement, for each controller in each manoeuvre, by default of the file.

    `runs` is the budget of each search. Searches found in the folder are resumed. `progress` is called after every set
    with the search, its finished sets and the total. See `study` for the other arguments.
    """
    study = read_study(requirement_file, "falsify")
    table = build(FalsifyTable, study.falsify or {}, study.source, ("falsify",))
    requirement = Requirement(table.requirement, study.source, ("falsify", "requirement"))
    if table.sampler not in SAMPLERS:
        raise study.source.fail(("falsify", "sampler"), nearest_names(table.sampler, SAMPLERS), table.sampler, SAMPLERS)
    if study.case_list is not None or not study.factors:
        raise study.source.fail(("factors",), "a search needs factors")
    if len(study.vehicles) > 1:
        raise study.source.fail(("vehicles",), "a search needs one vehicle")
    labels = {label_of(item): item for item in study.maneuvers}
    for name in maneuvers or ():
        if name not in labels:
            raise ParameterError(nearest_names(name, labels), key="--maneuver", value=name, allowed=tuple(labels))
    optuna = import_optuna("falsify")
    folder, found = make_folder(output, StudyError), []
    refuse_study(folder)
    planned = [
        (name, maneuver, Plan(_search_study(study, requirement, name, labels[maneuver])))
        for name in controllers or study.controllers
        for maneuver in maneuvers or labels
    ]
    with workers_for(jobs, scheduler=scheduler) as workers:
        for name, maneuver, plan in planned:
            tell = None if progress is None else functools.partial(progress, f"{label_of(name)} {maneuver}")
            below = make_folder(folder / f"{file_word(label_of(name))}-{file_word(maneuver)}", StudyError)
            one = _searched(
                optuna, plan, below, (name, maneuver), table, requirement, runs or table.runs, workers, tell
            )
            write_text(below / "worst.json", json.dumps(one.to_json(), indent=2) + "\n", StudyError)
            found.append(one)
    return found


def _search_study(study: StudyFile, requirement: Requirement, controller: str, maneuver: FileOrTable) -> StudyFile:
    """Return the study of one search: the examined controller first, and the factors that vary in the manoeuvre."""
    table, label = study.to_table(), label_of(maneuver)
    kept = {key: value for key, value in table["factors"].items() if label in value.get("maneuvers", [label])}
    for value in kept.values():
        value.pop("maneuvers", None)
    others = [name for name in requirement.controllers if label_of(name) != find_controller(controller).label]
    table.pop("metrics", None)
    changes = {"maneuvers": [maneuver], "controllers": [controller, *others], "factors": kept}
    return read_study(table | changes)


def _searched(
    optuna: Any, plan: Plan, folder: Path, place: tuple[str, str], table: FalsifyTable, requirement: Requirement,
    runs: int, workers: Workers, progress: Callable[[int, int], None] | None,
) -> Falsified:  # fmt: skip
    controller, maneuver = place
    study, own = plan.study, label_of(controller)
    each = len(study.controllers)
    trials = max(1, runs // each)

    def judge(rows: Sequence[Row]) -> Judgement:
        ok = [row for row in rows if row["status"] == Status.OK]
        if not ok:
            return Judgement(None)
        about = {*IDENTITY, *OUTCOME, *study.keys}
        names = dict.fromkeys(name for row in ok for name in row if name not in about)
        for name in requirement.metrics:
            if name != HARM and name not in names:
                problem = f"the runs of {maneuver} have no such metric; {nearest_names(name, list(names))}"
                raise study.source.fail(("falsify", "requirement"), problem, name)
        metrics = {row["controller"]: {name: row.get(name) for name in names} for row in rows}
        value = requirement.robustness(metrics, own)
        return Judgement(None if math.isnan(value) else [min(max(value, -_MOST), _MOST)])

    def sampler(seed: int) -> Any:
        if table.sampler == "tpe":
            return optuna.samplers.TPESampler(
                seed=seed, constant_liar=True, n_startup_trials=max(10, round(_STARTUP * trials))
            )
        if table.sampler == "random":
            return optuna.samplers.RandomSampler(seed=seed)
        return optuna.samplers.QMCSampler(seed=seed, warn_independent_sampling=False, warn_asynchronous_seeding=False)

    claim_folder(folder, "falsify", plan, f"# {requirement.text}\n")
    made = search(plan, folder, "falsify", sampler, 1, trials, judge, workers, progress)
    complete = made.get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,))
    sets = [(dict(trial.params), float(trial.value)) for trial in complete]
    fall: list[tuple[int, float]] = []
    for trial in complete:
        if not fall or trial.value < fall[-1][1]:
            fall.append(((trial.number + 1) * each, float(trial.value)))
    values, robustness = min(sets, key=lambda one: one[1], default=({}, math.nan))
    overrides = plan.request_with(0, 0, (0, 0, 0), values).overrides
    commands = {
        label_of(name): run_command(study.maneuvers[0], name, study.vehicles[0], overrides, study.driver)
        for name in study.controllers
        if sets
    }
    return Falsified(
        own, maneuver, requirement.text, len(made.trials) * each, len(made.trials) - len(sets),
        sum(value < 0.0 for _, value in sets), robustness, values, commands, fall, sets,
    )  # fmt: skip

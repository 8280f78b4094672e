"""Searches over the factors of a study by Optuna: with several workers, and resumable."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from activesteer.errors import StudyError, not_installed
from activesteer.files import write_text
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.run_settings import Request, prepare
from activesteer.studies.engine.run_task import Row, drive
from activesteer.studies.engine.task_queue import TaskQueue
from activesteer.studies.engine.workers import Workers


class Judgement(NamedTuple):
    """Judgement of a set of values: objectives that shall be small, and further results to keep with the set.

    The objectives are None for a set that cannot be judged, the violation is None without constraints.
    """

    objectives: list[float] | None
    attributes: dict[str, Any] = {}  # noqa: RUF012 - never changed
    violation: float | None = None


def import_optuna(command: str) -> Any:
    """Import Optuna and silence it."""
    try:
        import optuna  # noqa: PLC0415 - an extra
    except ImportError as reason:
        raise not_installed(StudyError, f"activesteer {command}", "optuna", "study") from reason
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna


def refuse_study(folder: Path) -> None:
    """Check that a folder holds no study, whose files a search would mix with its own.

    Raises:
        StudyError: it does.
    """
    if (folder / "study.toml").exists():
        raise StudyError(f"{folder} holds a study; use a new folder for the search", value=folder)


def claim_folder(folder: Path, name: str, plan: Plan, text: str = "") -> None:
    """Write the study into a folder, or check that the folder holds the same search."""
    refuse_study(folder)
    path = folder / f"{name}.toml"
    text = f"# {plan.digest}\n{text}{plan.study.to_toml()}"
    if path.exists() and path.read_text(encoding="utf-8", errors="replace") != text:
        raise StudyError(f"{folder} holds another search; use a new folder", value=folder)
    write_text(path, text, StudyError)


def search(
    plan: Plan,
    folder: Path,
    name: str,
    sampler: Callable[[int], Any],
    objectives: int,
    trials: int,
    judge: Callable[[Sequence[Row]], Judgement],
    workers: Workers,
    progress: Callable[[int, int], None] | None = None,
) -> Any:
    """Try sets of values until a number of sets is reached, and return the study of Optuna.

    Every set is driven in all manoeuvres with all controllers, and judged by the rows of its runs. `sampler` makes a
    sampler of Optuna from a seed. A search found in the folder is resumed.
    """
    optuna = import_optuna(name)
    from optuna.storages import JournalStorage, journal  # noqa: PLC0415 - an extra

    path = str(folder / f"{name}.journal")
    storage = JournalStorage(journal.JournalFileBackend(path, lock_obj=journal.JournalFileOpenLock(path)))
    directions: list[Any] = ["minimize"] * objectives
    made = optuna.create_study(storage=storage, study_name=name, load_if_exists=True, directions=directions)
    failed = optuna.trial.TrialState.FAIL
    for left in made.get_trials(deepcopy=False, states=(optuna.trial.TrialState.RUNNING,)):  # left by a killed process
        made.tell(left.number, state=failed)
    begun = len(made.trials)
    if begun >= trials:
        return made
    made.sampler = sampler(plan.study.seed + begun)
    prepare(workers, plan.settings)

    def tasks() -> Iterator[tuple[Any, ...]]:
        for _ in range(trials - begun):
            trial = made.ask()
            values = {factor.key: _suggest(trial, factor) for factor in plan.study.factors}
            yield trial, drive, plan.settings, requests_of(plan, trial.number, values)

    for place, (trial, rows, error) in enumerate(TaskQueue(workers).outcomes(tasks()), begun + 1):
        judged = Judgement(None) if error is not None else judge(rows)
        if judged.objectives is None:
            made.tell(trial, state=failed)
        else:
            for key, value in judged.attributes.items():
                trial.set_user_attr(key, value)
            if judged.violation is not None:
                trial.set_constraint("violation", judged.violation)
            made.tell(trial, judged.objectives)
        if progress is not None:
            progress(place, trials)
    return made


def _suggest(trial: Any, factor: Factor) -> Any:
    if factor.values:
        return trial.suggest_categorical(factor.key, factor.values)
    return trial.suggest_float(factor.key, factor.low, factor.high, log=factor.kind == "log_uniform")


def requests_of(plan: Plan, number: int, values: dict[str, Any]) -> list[Request]:
    """Return the runs of a set of values, in all manoeuvres and vehicles with all controllers."""
    settings = plan.settings
    places = [
        (maneuver, vehicle, controller)
        for maneuver in range(len(settings.maneuvers))
        for vehicle in range(len(settings.vehicles))
        for controller in range(len(settings.controllers))
    ]
    return [plan.request_with(run, number, place, values) for run, place in enumerate(places)]

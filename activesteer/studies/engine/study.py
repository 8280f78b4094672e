"""A study from its file to its results: many runs on several workers, which can be interrupted and resumed."""

from __future__ import annotations

import fnmatch
import logging
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from activesteer.scenario import FileOrTable
from activesteer.studies.engine.analysis import MAX_ROWS, without_effect
from activesteer.studies.engine.plan import Plan, task_size
from activesteer.studies.engine.runs import CURVE, Request, Status, drive, failed_row, prepare
from activesteer.studies.engine.store import IDENTITY, OUTCOME, Store
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.workers import TaskQueue, WorkerDied, Workers, workers_for

if TYPE_CHECKING:
    import pyarrow as pa

RECORDINGS: Final = "recordings"
_logger: Final = logging.getLogger(__name__)
_KEPT_EVERY_S: Final = 4.0
"""Time after which a task hands over its finished runs, so that a killed study loses few [s]."""


class StudyProgress(NamedTuple):
    """Progress of a study, for a callback."""

    done: int
    total: int
    failed: int
    here: int


def study(
    study_file: FileOrTable | StudyFile,
    *,
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    client: Any = None,
    scheduler: str | None = None,
    workers: Workers | None = None,
    limit: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> pa.Table:
    """Drive a study, or the missing runs of a study.

    With more than one job, the runs are made in newly started processes: a script that calls this function needs
    `if __name__ == "__main__":`.

    Args:
        study_file: Name or path of a study file, its table, or a study that was read before.
        output: Folder of the study; an existing study is resumed. Without a folder, nothing is stored.
        jobs: Number of processes; default: the number of processors. With 1, this process drives all runs.
        client: A `distributed.Client` whose cluster drives the runs.
        scheduler: Address of a Dask scheduler, or its scheduler file, instead.
        workers: Workers shared by several studies, instead.
        limit: Largest number of runs to make now.
        progress: Called after every task.

    Returns:
        One row per run, in the order of the study: identity, factors, `status`, `error`, metrics. The field of a column
        has its unit as metadata.

    Raises:
        ActiveSteerError: an input is wrong, the folder cannot be written or holds another study, or the workers cannot
            be reached. A failed run is a row and raises nothing.

    Examples:
        >>> from activesteer import study
        >>> table = study({
        ...     "maneuvers": ["step_steer"],
        ...     "controllers": ["none", "ars"],
        ...     "factors": {"road.mu": {"grid": [0.8, 1.0]}},
        ... }, jobs=1)
        >>> table.num_rows
        4
    """
    parsed = read_study(study_file)
    with ExitStack() as stack:
        if output is None:
            output = stack.enter_context(tempfile.TemporaryDirectory(prefix="activesteer-study-"))
        folder = Path(output).absolute()
        # Report wrong addresses first, and errors of the study before a process is started.
        plan = Plan(parsed, folder / RECORDINGS)
        store = stack.enter_context(Store(folder, parsed.keys).opened(parsed.to_toml(), plan.digest, len(plan)))
        missing = store.missing(len(plan))
        if missing:
            workers = workers or stack.enter_context(workers_for(jobs, client=client, scheduler=scheduler))
            # Find errors that would occur in every run before the first one.
            prepare(workers, plan.settings)
            _drive_all(plan, store, workers, missing, limit, progress)
        if complete := not store.missing(len(plan)):
            store.join()
        table = store.read()
        _warn_of_patterns(parsed, table)
        if missing and complete and parsed.case_list is None:
            curves = [name for name in table.column_names if name.startswith(CURVE)]
            rows = table.slice(0, MAX_ROWS).drop_columns(curves)
            store.note_without_effect(without_effect(plan, rows.to_pylist()))
        return table


def _warn_of_patterns(study_file: StudyFile, table: pa.Table) -> None:
    """Log each pattern of `metrics` that has matched no metric so far."""
    if not table.num_rows or Status.OK not in table.column("status").to_pylist():
        return
    metrics = set(table.column_names) - {*IDENTITY, *OUTCOME, *study_file.keys}
    for pattern in study_file.metrics:
        if not fnmatch.filter(metrics, pattern):
            _logger.warning("metrics: the pattern %r matches no metric of these runs", pattern)


def _drive_all(
    plan: Plan,
    store: Store,
    workers: Workers,
    missing: Iterable[range],
    limit: int | None,
    progress: Callable[[StudyProgress], None] | None,
) -> None:
    total = len(plan)
    left = sum(len(span) for span in missing)
    done, here, failed = total - left, 0, 0
    size = task_size(left, len(plan.study.controllers), workers.in_flight)
    tasks = (
        (requests, drive, plan.settings, requests, _KEPT_EVERY_S) for requests in _tasks(plan, missing, size, limit)
    )
    queue = TaskQueue(workers)
    for requests, made, error in queue.outcomes(tasks):
        rows = made
        if error is not None and len(requests) > 1:
            # Drive run by run, so that only the run that kills its worker is lost.
            for request in requests:
                queue.add_alone([request], drive, plan.settings, [request])
            continue
        if error is not None:
            status = Status.CRASHED if isinstance(error, WorkerDied) else Status.FAILED
            rows = [failed_row(plan.settings, requests[0], status, f"{type(error).__name__}: {error}")]
        store.write(rows)
        if left_over := requests[len(rows) :]:
            queue.add(left_over, drive, plan.settings, left_over, _KEPT_EVERY_S)
        here += len(rows)
        failed += sum(row["status"] in (Status.FAILED, Status.CRASHED) for row in rows)
        if progress is not None:
            progress(StudyProgress(done + here, total, failed, here))


def _tasks(plan: Plan, missing: Iterable[range], size: int, limit: int | None) -> Iterator[list[Request]]:
    """Yield groups of runs that contain whole samples."""
    left = len(plan) if limit is None else limit
    for span in missing:
        begin = span.start
        while begin < span.stop and left > 0:
            end = min((begin // size + 1) * size, span.stop, begin + left)
            yield plan.requests(range(begin, end))
            left -= end - begin
            begin = end

"""Tasks for workers, and what becomes of them.

`TaskQueue` hands tasks out and gives their results back as they come. A worker that dies takes only the tasks with it
that it had; they are done again, and a task that kills its worker every time is given up.
"""

from __future__ import annotations

import contextlib
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from typing import Any, Final, NamedTuple

from activesteer.errors import StudyError
from activesteer.studies.engine.workers import Workers, workers_for

_ATTEMPTS: Final = 3
"""How often a task is begun before it counts as the one that kills its worker; the last time it is alone."""
_engine: Final = threading.RLock()
"""The engine's callbacks belong to the process: of a worker's threads, one does a task at a time."""


class WorkerDied(StudyError):  # noqa: N818 - an event, named as one
    """A task's worker died every time that the task was tried."""


class Outcome(NamedTuple):
    """What became of a task.

    Attributes:
        key: What the task was called.
        value: What its function returned.
        error: What it raised instead.
    """

    key: Any
    value: Any
    error: BaseException | None

    def result(self) -> Any:
        """The value.

        Raises:
            BaseException: what the task raised.
        """
        if self.error is not None:
            raise self.error
        return self.value


class _Task(NamedTuple):
    key: Any
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    attempts: int = 0


class TaskQueue:
    """Tasks that wait, tasks that are being done, and the results of those that are finished."""

    def __init__(self, workers: Workers) -> None:
        """Begins empty.

        Args:
            workers: Who does them.
        """
        self._workers = workers
        self._waiting: deque[_Task] = deque()
        self._suspects: deque[_Task] = deque()
        self._running: dict[Future[Any], _Task] = {}

    def add(self, key: Any, function: Callable[..., Any], *arguments: Any) -> None:
        """Puts a task at the end.

        Args:
            key: What to call it in its outcome.
            function: A function of a module, so that it pickles.
            arguments: Its arguments.
        """
        self._waiting.append(_Task(key, function, arguments))

    def add_alone(self, key: Any, function: Callable[..., Any], *arguments: Any) -> None:
        """Puts a task among those that may kill their worker: it is tried once, with no other beside it."""
        self._suspects.append(_Task(key, function, arguments, _ATTEMPTS - 1))

    def outcomes(self, more: Iterator[tuple[Any, ...]] | None = None) -> Iterator[Outcome]:
        """Does the tasks and gives what became of each, in the order in which they end.

        Whoever iterates may add tasks meanwhile.

        Args:
            more: Further tasks, as arguments of `add`, taken only when there is room for them.

        Yields:
            An outcome for every task.

        Raises:
            StudyError: the workers are gone for good.
        """
        more = iter(()) if more is None else more
        while True:
            self._fill(more)
            if not self._running:
                return
            finished, _ = wait(self._running, return_when=FIRST_COMPLETED)
            died = False
            for future in finished:
                task = self._running.pop(future)
                error = CancelledError() if future.cancelled() else future.exception()
                if error is None or not self._workers.died(error):
                    yield Outcome(task.key, None if error else future.result(), error)
                    continue
                died = True
                if task.attempts + 1 < _ATTEMPTS:
                    self._suspects.append(task._replace(attempts=task.attempts + 1))
                else:
                    yield Outcome(task.key, None, WorkerDied("the process that did it died (killed, or out of memory)"))
            if died:
                self._workers.replace()

    def _fill(self, more: Iterator[tuple[Any, ...]]) -> None:
        while len(self._running) < self._workers.in_flight:
            # A task that may kill its worker is tried once more among others, and then alone, so that no other task is
            # taken for the guilty one.
            if self._suspects:
                alone = self._suspects[0].attempts + 1 == _ATTEMPTS
                if alone and self._running:
                    return
                self._submit(self._suspects.popleft())
                if alone:
                    return
                continue
            if not self._waiting:
                if (task := next(more, None)) is None:
                    return
                self.add(*task)
            self._submit(self._waiting.popleft())

    def _submit(self, task: _Task) -> None:
        self._running[self._workers.submit(_alone, task.function, *task.arguments)] = task


def _alone(function: Callable[..., Any], *arguments: Any) -> Any:
    with _engine:
        return function(*arguments)


def in_parallel(
    function: Callable[..., Any],
    arguments: Sequence[tuple[Any, ...]],
    jobs: int | None = None,
    report: Callable[[int, int], None] = lambda _place, _done: None,
    *,
    scheduler: str | None = None,
    workers: Workers | None = None,
) -> list[Any]:
    """Calls a function with each set of arguments, spread over processes.

    Args:
        function: A function of a module, so that it pickles.
        arguments: Its arguments, one tuple a call.
        jobs: Number of processes; that of the processors where not given. With 1 all is done in this process.
        report: Called after each call with the place of its arguments and how many calls are done.
        scheduler: Address of a Dask scheduler, or its scheduler file, that calls it instead.
        workers: Who calls it instead; they stay with whoever gave them.

    Returns:
        What it returned, in the order of the arguments.

    Raises:
        ParameterError: fewer than one job.
        StudyError: see `workers_for`.
        BaseException: what a call raised.
    """
    results: dict[int, Any] = {}
    with workers_for(jobs, scheduler=scheduler) if workers is None else contextlib.nullcontext(workers) as crew:
        tasks = ((place, function, *each) for place, each in enumerate(arguments))
        for outcome in TaskQueue(crew).outcomes(tasks):
            results[outcome.key] = outcome.result()
            report(outcome.key, len(results))
    return [results[place] for place in range(len(arguments))]

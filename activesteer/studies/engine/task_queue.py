"""Tasks for workers and their outcomes.

`TaskQueue` distributes tasks and returns their results as they arrive. If a worker dies, only its own tasks are lost
and repeated. A task that kills its worker every time is given up.
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
"""Number of attempts before a task counts as the one that kills its worker; the last attempt runs alone."""
_engine: Final = threading.RLock()
"""MuJoCo's callbacks belong to the process, so one thread of a worker does one task at a time."""


class WorkerDied(StudyError):  # noqa: N818 - an event, named as one
    """The worker of a task died at every attempt."""


class Outcome(NamedTuple):
    """Outcome of a task by its key: the result of its function, or the error that it raised instead."""

    key: Any
    value: Any
    error: BaseException | None

    def result(self) -> Any:
        """Return the result."""
        if self.error is not None:
            raise self.error
        return self.value


class _Task(NamedTuple):
    key: Any
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    attempts: int = 0


class TaskQueue:
    """Waiting tasks, running tasks, and the results of finished tasks."""

    def __init__(self, workers: Workers) -> None:
        self._workers = workers
        self._waiting: deque[_Task] = deque()
        self._suspects: deque[_Task] = deque()
        self._running: dict[Future[Any], _Task] = {}

    def add(self, key: Any, function: Callable[..., Any], *arguments: Any) -> None:
        """Append a task.

        Args:
            key: Key of the task in its outcome.
            function: Function of a module, so that it can be pickled.
            arguments: Its arguments.
        """
        self._waiting.append(_Task(key, function, arguments))

    def add_alone(self, key: Any, function: Callable[..., Any], *arguments: Any) -> None:
        """Append a task that may kill its worker: it is tried once, with no other task beside it."""
        self._suspects.append(_Task(key, function, arguments, _ATTEMPTS - 1))

    def outcomes(self, more: Iterator[tuple[Any, ...]] | None = None) -> Iterator[Outcome]:
        """Do the tasks and yield their outcomes, in the order in which they end.

        The caller may add tasks while iterating.

        Args:
            more: Further tasks, as arguments of `add`, taken only if there is room for them.
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
            # Try a task that may kill its worker once more among others, and then alone, so that no other is blamed.
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
    """Call a function of a module with each set of arguments, and return the results in the order of the arguments.

    `report` gets the index of the arguments and the number of finished calls. Given workers still belong to the caller;
    otherwise see `workers_for`.
    """
    results: dict[int, Any] = {}
    with workers_for(jobs, scheduler=scheduler) if workers is None else contextlib.nullcontext(workers) as crew:
        tasks = ((place, function, *each) for place, each in enumerate(arguments))
        for outcome in TaskQueue(crew).outcomes(tasks):
            results[outcome.key] = outcome.result()
            report(outcome.key, len(results))
    return [results[place] for place in range(len(arguments))]

"""Workers behind one interface: this process, or processes of this machine; and their tasks.

`TaskQueue` distributes tasks and returns their results as they arrive. If a worker dies, only its own tasks are lost
and repeated. A task that kills its worker every time is given up.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, ProcessPoolExecutor, wait
from multiprocessing import connection
from typing import Any, Final, NamedTuple, Protocol

from activesteer.config import Range
from activesteer.errors import ParameterError, StudyError
from activesteer.studies.engine import dask_cluster

_BLAS_THREADS: Final = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables from which the BLAS of numpy and scipy take their number of threads when loaded."""
_MOST_JOBS: Final = 16
"""Number of processes that is allowed on a machine with few processors; four times the processors on a larger one."""


class Workers(Protocol):
    """Workers that do tasks.

    Attributes:
        in_flight: Number of tasks to submit at a time, so that no worker waits.
    """

    in_flight: int

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task. The function and its arguments must be picklable."""
        ...

    def died(self, error: BaseException) -> bool:
        """Return True if an error means that a worker died, not that the task failed."""
        ...

    def replace(self) -> None:
        """Replace dead workers."""
        ...

    def everywhere(self, check: Callable[..., str], *arguments: Any) -> str:
        """Call a function once on every machine before its workers start. Return the first objection."""
        ...

    def close(self, *, abandon: bool) -> None:
        """End the workers; if abandoned, without waiting for their tasks."""
        ...


class ThisProcess:
    """This process, which does every task immediately."""

    in_flight = 1

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Do the task and return a finished future."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def died(self, error: BaseException) -> bool:
        """Return False: the worker is this process."""
        return False

    def replace(self) -> None:
        """Do nothing."""

    def everywhere(self, check: Callable[..., str], *arguments: Any) -> str:
        """See `Workers`."""
        return check(*arguments)

    def close(self, *, abandon: bool) -> None:
        """Do nothing."""


class LocalProcesses:
    """Newly started processes that share nothing with this one, because MuJoCo's callbacks belong to a process."""

    def __init__(self, count: int) -> None:
        """Prepare the pool, which starts processes as tasks arrive."""
        self._count = count
        self.in_flight = count + 1  # one task waits, so that no process does
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(self._count, multiprocessing.get_context("spawn"), initializer=_begin_worker)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """See `Workers`."""
        # The pool starts processes here when it needs them. They never receive Ctrl-C, not even while starting: signals
        # that are blocked here stay blocked there.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            with _one_thread_each():
                return self._pool.submit(function, *arguments)
        except BrokenExecutor as error:  # found before the broken futures were inspected
            future: Future[Any] = Future()
            future.set_exception(error)
            return future
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def died(self, error: BaseException) -> bool:
        """See `Workers`."""
        return isinstance(error, BrokenExecutor)

    def replace(self) -> None:
        """Replace the pool, which ends with the first of its processes that dies."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        self._pool = self._new_pool()

    def everywhere(self, check: Callable[..., str], *arguments: Any) -> str:
        """See `Workers`. The function is called here, on this machine."""
        return check(*arguments)

    def close(self, *, abandon: bool) -> None:
        """See `Workers`."""
        if abandon:
            for process in list((self._pool._processes or {}).values()):
                process.terminate()
        self._pool.shutdown(cancel_futures=True)


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """Let processes started inside solve linear equations in one thread, unless the environment sets the number.

    There is already a process for each processor, and the equations of a run are small: threads of BLAS would wait
    longer than they calculate, which makes a run a tenth slower.
    """
    missing = [name for name in _BLAS_THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(missing, "1"))
    try:
        yield
    finally:
        for name in missing:
            del os.environ[name]


def _begin_worker() -> None:
    """End this worker when the process that gives it work ends."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


@contextlib.contextmanager
def workers_for(jobs: int | None = None, *, client: Any = None, scheduler: str | None = None) -> Iterator[Workers]:
    """Yield this machine's processes, by default one per processor, or a Dask cluster. Abandon tasks if the body fails.

    With one job, this process does the work. The scheduler is given by its address or its file.
    """
    most = max(_MOST_JOBS, 4 * _processors())
    if jobs is not None and not 1 <= jobs <= most:
        raise ParameterError(f"must be 1 to {most}", key=f"--jobs {jobs}", value=jobs, allowed=Range(1, most))
    if jobs is not None and scheduler is not None:
        raise ParameterError(
            "has no effect with --scheduler, whose workers do all of it", key=f"--jobs {jobs}", value=jobs
        )
    with contextlib.ExitStack() as stack:
        if client is None and scheduler is not None:
            client = stack.enter_context(dask_cluster.connected(scheduler))
        if client is not None:
            workers: Workers = dask_cluster.DaskCluster(client)
        else:
            count = jobs or _processors()
            workers = LocalProcesses(count) if count > 1 else ThisProcess()
        early = True
        try:
            yield workers
            early = False
        finally:
            workers.close(abandon=early)


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


_ATTEMPTS: Final = 3
"""Number of attempts before a task counts as the one that kills its worker. The last attempt runs alone."""
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
        """Append a task."""
        self._waiting.append(_Task(key, function, arguments))

    def add_alone(self, key: Any, function: Callable[..., Any], *arguments: Any) -> None:
        """Append a task that may kill its worker: it is tried once, with no other task beside it."""
        self._suspects.append(_Task(key, function, arguments, _ATTEMPTS - 1))

    def outcomes(self, more: Iterator[tuple[Any, ...]] | None = None) -> Iterator[Outcome]:
        """Do the tasks and yield their outcomes, in the order in which they end.

        The caller may add tasks while iterating.
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

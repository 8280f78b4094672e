"""Who does the work: this process, processes of this machine, or a Dask cluster, all behind one small interface.

`TaskQueue` hands tasks out and gives their results back as they come. A worker that dies takes only the tasks with it
that it had; they are done again, and a task that kills its worker every time is given up.
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
from activesteer.studies import dask_cluster

_ATTEMPTS: Final = 3
"""How often a task is begun before it counts as the one that kills its worker; the last time it is alone."""
_engine: Final = threading.RLock()
"""The engine's callbacks belong to the process: of a worker's threads, one does a task at a time."""


class WorkerDied(StudyError):  # noqa: N818 - an event, named as one
    """A task's worker died every time that the task was tried."""


class Workers(Protocol):
    """Something that does tasks.

    Attributes:
        in_flight: How many tasks it should have at a time, so that nobody waits.
    """

    in_flight: int

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Begins a task; both function and arguments must pickle."""
        ...

    def died(self, error: BaseException) -> bool:
        """Whether an error says that a worker died, not that the task failed."""
        ...

    def replace(self) -> None:
        """Makes new workers in place of dead ones."""
        ...

    def everywhere(self, check: Callable[..., str], *arguments: Any) -> str:
        """Calls a function once on every machine before its workers begin; what one of them has to say against it."""
        ...

    def close(self, *, abandon: bool) -> None:
        """Ends the workers; where abandoned, without waiting for what they do."""
        ...


class ThisProcess:
    """Does every task at once, here."""

    in_flight = 1

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Does the task and returns a finished future."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def died(self, error: BaseException) -> bool:
        """Never: a death would be ours."""
        return False

    def replace(self) -> None:
        """Nothing to replace."""

    def everywhere(self, check: Callable[..., str], *arguments: Any) -> str:
        """See `Workers`."""
        return check(*arguments)

    def close(self, *, abandon: bool) -> None:
        """Nothing to end."""


class LocalProcesses:
    """Processes that share nothing with this one, started afresh: the engine's callbacks belong to a process."""

    def __init__(self, count: int) -> None:
        """Starts none yet: the pool starts them as tasks come.

        Args:
            count: How many.
        """
        self._count = count
        self.in_flight = count + 1  # one waits, so that nobody does
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(self._count, multiprocessing.get_context("spawn"), initializer=_begin_worker)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """See `Workers`."""
        # Processes are started here, as they are needed. They never see a Ctrl-C, not even while they start: what is
        # blocked here stays blocked there.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return self._pool.submit(function, *arguments)
        except BrokenExecutor as error:  # noticed before the futures that it breaks were looked at
            future: Future[Any] = Future()
            future.set_exception(error)
            return future
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def died(self, error: BaseException) -> bool:
        """See `Workers`."""
        return isinstance(error, BrokenExecutor)

    def replace(self) -> None:
        """A pool ends with the first of its processes that dies, so it is the pool that is replaced."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        self._pool = self._new_pool()

    def everywhere(self, check: Callable[..., str], *arguments: Any) -> str:
        """See `Workers`; it is this machine, so it is called here."""
        return check(*arguments)

    def close(self, *, abandon: bool) -> None:
        """See `Workers`."""
        if abandon:
            for process in list((self._pool._processes or {}).values()):
                process.terminate()
        self._pool.shutdown(cancel_futures=True)


def _begin_worker() -> None:
    """No worker outlives the process that gives it work, however that ends."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


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


@contextlib.contextmanager
def workers_for(jobs: int | None = None, *, client: Any = None, scheduler: str | None = None) -> Iterator[Workers]:
    """The workers that the arguments name; where the body ends early, what they do is abandoned.

    Args:
        jobs: Processes of this machine, as many as there are processors for us where not given; with 1 the work is done
            in this process.
        client: A `distributed.Client` instead.
        scheduler: Address of a Dask scheduler, or its scheduler file, instead.

    Yields:
        The workers.

    Raises:
        ParameterError: fewer than one job.
        StudyError: there is no such scheduler, it has no workers, or `distributed` is not installed.
    """
    if jobs is not None and jobs < 1:
        raise ParameterError("at least 1 is needed", key=f"--jobs {jobs}", value=jobs, allowed=Range(1))
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

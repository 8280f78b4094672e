"""Who does the work: this process, processes of this machine, or a Dask cluster, all behind one small interface."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from multiprocessing import connection
from typing import Any, Final, Protocol

from activesteer.config import Range
from activesteer.errors import ParameterError
from activesteer.studies.engine import dask_cluster

_BLAS_THREADS: Final = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Where the BLAS of numpy and scipy look for their number of threads as they are loaded."""
_MOST_JOBS: Final = 16
"""Number of processes that is allowed on a machine with few processors; four times the processors on a larger one."""


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
            with _one_thread_each():
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


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes that start in here solve linear equations in one thread, unless the environment says how many.

    There is a process for each processor already, and the equations of a run are small: BLAS would wait for threads
    longer than it calculates, which makes a run a tenth slower.
    """
    missing = [name for name in _BLAS_THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(missing, "1"))
    try:
        yield
    finally:
        for name in missing:
            del os.environ[name]


def _begin_worker() -> None:
    """No worker outlives the process that gives it work, however that ends."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


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
        ParameterError: `jobs` is below 1 or above four times the number of processors, or is given with a scheduler.
        StudyError: there is no such scheduler, it has no workers, or `distributed` is not installed.
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

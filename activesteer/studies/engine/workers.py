"""Workers for tasks, with one interface: this process, processes of this machine, or a Dask cluster.

`TaskQueue` distributes tasks and returns their results as they arrive. If a worker dies, only its own tasks are lost
and repeated. A task that kills its worker every time is abandoned.
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
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.config import Range
from activesteer.errors import ParameterError, StudyError, not_installed

_BLAS_THREADS: Final = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables from which the BLAS of numpy and scipy take their number of threads when loaded."""
_MOST_JOBS: Final = 16
"""Number of processes that is allowed on a machine with few processors; four times the processors on a larger one."""

Progress = Callable[[str, int, int], None]
"""Callback with the name of a finished part or of a search, the number of finished parts, and the total."""


class Workers:
    """Worker in this process, which executes every task immediately; `in_flight` tasks can be submitted at a time."""

    in_flight = 1

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task with a picklable function and arguments."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def died(self, error: BaseException) -> bool:
        """Return whether an error means that a worker died."""
        return False

    def replace(self) -> None:
        """Replace dead workers."""

    def everywhere(self, check: Callable[..., str], *arguments: Any) -> str:
        """Call a function once on every machine before its workers start, and return the first problem."""
        return check(*arguments)

    def close(self, *, abandon: bool) -> None:
        """End the workers. With `abandon`, do not wait for their tasks."""


class LocalProcesses(Workers):
    """Pool of new processes that share nothing with this one, because MuJoCo has one set of callbacks per process."""

    def __init__(self, count: int) -> None:
        """Prepare the pool. Its processes start as tasks arrive."""
        self._count = count
        self.in_flight = count + 1  # one task waits, so that no process does
        self._pool = self._new_pool()

    def _new_pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(self._count, multiprocessing.get_context("spawn"), initializer=_begin_worker)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task in the pool (see `Workers.submit`)."""
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
        """Return True if the pool is broken, because one of its processes died."""
        return isinstance(error, BrokenExecutor)

    def replace(self) -> None:
        """Replace the broken pool."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        self._pool = self._new_pool()

    def close(self, *, abandon: bool) -> None:
        """End the pool. With `abandon`, terminate its processes."""
        if abandon:
            for process in list((self._pool._processes or {}).values()):
                process.terminate()
        self._pool.shutdown(cancel_futures=True)


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """Context whose new processes solve linear equations in one thread, unless the environment sets a number."""
    # There is already a process for each processor, and the equations of a run are small: threads of BLAS would wait
    # longer than they calculate, which makes a run a tenth slower.
    missing = [name for name in _BLAS_THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(missing, "1"))
    try:
        yield
    finally:
        for name in missing:
            del os.environ[name]


def _begin_worker() -> None:
    """End this worker when its parent process ends."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


_CONNECT_S: Final = 10
_WORKERS_S: Final = 30
"""Time to wait for the first worker of a cluster [s]."""
_TASKS_A_WORKER: Final = 4
_SAME: Final = ("distributed", "dask", "cloudpickle", "msgpack")
"""Packages whose versions must agree between client, scheduler and workers."""


class DaskCluster(Workers):
    """A Dask cluster, accessed through its client. Start its workers with one thread each; they may join and leave."""

    def __init__(self, client: Any) -> None:
        """Check the cluster. Its client still belongs to the caller."""
        self._client = client
        self._executor = client.get_executor(pure=False)
        try:
            client.wait_for_workers(1, timeout=_WORKERS_S)
            found = client.get_versions()
        except Exception as reason:
            raise StudyError(f"the cluster at {client.scheduler.address} has no worker: {_line(reason)}") from reason
        _compare_versions(found)
        self.in_flight = 0
        self._count()

    def _count(self) -> None:
        self.in_flight = max(32, _TASKS_A_WORKER * len(self._client.nthreads()))

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task through the executor (see `Workers.submit`)."""
        return self._executor.submit(function, *arguments)

    def died(self, error: BaseException) -> bool:
        """Return True for a task that killed several workers or that the scheduler lost."""
        return type(error).__name__ == "KilledWorker" or isinstance(error, CancelledError)

    def replace(self) -> None:
        """Check that the scheduler still exists. The cluster replaces its workers itself."""
        try:
            self._client.wait_for_workers(1, timeout=_WORKERS_S)
        except Exception as reason:
            raise StudyError(
                "the scheduler or its workers are lost; finished runs are kept, start the study again to resume"
            ) from reason
        self._count()

    def everywhere(self, check: Callable[..., str], *arguments: Any) -> str:
        """Start one task per machine first, so that each machine compiles its kernels once."""
        hosts: dict[str, list[str]] = {}
        for address in self._client.nthreads():
            hosts.setdefault(address.rpartition(":")[0], []).append(address)
        for addresses in ([each[0] for each in hosts.values()], [one for each in hosts.values() for one in each[1:]]):
            if not addresses:
                continue
            answers = self._client.run(check, *arguments, workers=addresses, on_error="return")
            for address, answer in answers.items():
                problem = answer if isinstance(answer, str) else f"{type(answer).__name__}: {_line(answer)}"
                if problem:
                    return f"worker {address}: {problem}"
        return ""

    def close(self, *, abandon: bool) -> None:
        """Cancel the tasks that have not started."""
        with contextlib.suppress(Exception):  # without a cluster there is nothing to cancel
            self._executor.shutdown(wait=not abandon, cancel_futures=True)


@contextlib.contextmanager
def connected(scheduler: str) -> Iterator[Any]:
    """Yield a client of the scheduler at an address such as tcp://host:8786, or in a scheduler file."""
    try:
        from distributed import Client  # noqa: PLC0415 - an extra
    except ImportError as reason:
        raise not_installed(StudyError, "--scheduler", "distributed", "cluster") from reason
    if "://" in scheduler:
        where: dict[str, Any] = {"address": scheduler}
    elif Path(scheduler).is_file():
        where = {"scheduler_file": scheduler}
    else:
        raise StudyError(
            "is neither an address such as tcp://host:8786 nor a file", key=f"--scheduler {scheduler}", value=scheduler
        )
    try:
        client = Client(**where, timeout=_CONNECT_S)
    except Exception as reason:  # any error of the network, the address or the file
        raise StudyError(
            f"cannot be reached: {_line(reason)}", key=f"--scheduler {scheduler}", value=scheduler
        ) from reason
    with client:
        yield client


def _compare_versions(found: dict[str, Any]) -> None:
    """Check that client, scheduler and workers have the same versions, including activesteer."""
    here = found["client"]
    others = {"the scheduler": found["scheduler"]} | {f"worker {key}": value for key, value in found["workers"].items()}
    for who, theirs in others.items():
        ours, other = here["packages"], (theirs or {}).get("packages", {})
        wrong = {name: other.get(name) for name in _SAME if other.get(name) != ours.get(name)}
        python = [str(packages.get("python", "")).split(".")[:2] for packages in (ours, other)]
        if python[0] != python[1]:
            wrong["python"] = other.get("python")
        if wrong:
            words = "; ".join(f"{name} {version}, here {ours.get(name)}" for name, version in wrong.items())
            raise StudyError(f"{who} has other versions: {words}", value=wrong)


def _line(reason: BaseException) -> str:
    return (str(reason).splitlines() or [type(reason).__name__])[0][:200]


@contextlib.contextmanager
def workers_for(jobs: int | None = None, *, client: Any = None, scheduler: str | None = None) -> Iterator[Workers]:
    """Yield this process, processes of this machine, or a Dask cluster; abandon tasks if the body fails."""
    most = max(_MOST_JOBS, 4 * _processors())
    if jobs is not None and not 1 <= jobs <= most:
        raise ParameterError(f"must be 1 to {most}", key=f"--jobs {jobs}", value=jobs, allowed=Range(1, most))
    if jobs is not None and scheduler is not None:
        raise ParameterError(
            "has no effect with --scheduler, whose workers carry out all runs", key=f"--jobs {jobs}", value=jobs
        )
    with contextlib.ExitStack() as stack:
        if client is None and scheduler is not None:
            client = stack.enter_context(connected(scheduler))
        if client is not None:
            workers: Workers = DaskCluster(client)
        else:
            count = jobs or _processors()
            workers = LocalProcesses(count) if count > 1 else Workers()
        early = True
        try:
            yield workers
            early = False
        finally:
            workers.close(abandon=early)


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


_ATTEMPTS: Final = 3
"""Number of attempts before a task counts as fatal for its worker. The last attempt runs alone."""
_engine: Final = threading.RLock()
"""Lock of the engine: MuJoCo's callbacks belong to the process, so one thread of a worker does one task at a time."""


class WorkerDied(StudyError):  # noqa: N818 - an event, named as one
    """Error for a task whose worker died at every attempt."""


class Outcome(NamedTuple):
    """Outcome of a task by its key: its result or its error."""

    key: Any
    value: Any
    error: BaseException | None

    def result(self) -> Any:
        """Return the result, or raise the error."""
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
        """Append a risky task, which runs alone and only once."""
        self._suspects.append(_Task(key, function, arguments, _ATTEMPTS - 1))

    def outcomes(self, more: Iterator[tuple[Any, ...]] | None = None) -> Iterator[Outcome]:
        """Execute the tasks, also those added meanwhile, and yield their outcomes in the order of completion."""
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
                    yield Outcome(task.key, None, WorkerDied("its process died (killed, or out of memory)"))
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
    """Call a function with each set of arguments, and return the results in the same order."""
    results: dict[int, Any] = {}
    with workers_for(jobs, scheduler=scheduler) if workers is None else contextlib.nullcontext(workers) as crew:
        tasks = ((place, function, *each) for place, each in enumerate(arguments))
        for outcome in TaskQueue(crew).outcomes(tasks):
            results[outcome.key] = outcome.result()
            report(outcome.key, len(results))
    return [results[place] for place in range(len(arguments))]

"""Workers of a Dask cluster, behind the interface of `workers.Workers`."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from pathlib import Path
from typing import Any, Final

from activesteer.errors import StudyError, not_installed

_CONNECT_S: Final = 10
_WORKERS_S: Final = 30
"""Time to wait for the first worker of a cluster [s]."""
_TASKS_A_WORKER: Final = 4
_SAME: Final = ("distributed", "dask", "cloudpickle", "msgpack")
"""Packages whose versions must agree between client, scheduler and workers."""


class DaskCluster:
    """A cluster, accessed through its client.

    Workers may join and leave. One thread of a worker does one task at a time (see `workers`), so start a worker
    with one thread.

    Attributes:
        in_flight: Number of tasks that the cluster should have at a time.
    """

    def __init__(self, client: Any) -> None:
        """Check the cluster. The client still belongs to the caller."""
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
        """See `Workers`."""
        return self._executor.submit(function, *arguments)

    def died(self, error: BaseException) -> bool:
        """Return True for the error of a task that killed several workers or that the scheduler lost."""
        return type(error).__name__ == "KilledWorker" or isinstance(error, CancelledError)

    def replace(self) -> None:
        """Check that the scheduler still exists. The cluster replaces its workers itself."""
        try:
            self._client.wait_for_workers(1, timeout=_WORKERS_S)
        except Exception as reason:
            raise StudyError(
                "the scheduler or its workers are gone; what is finished is kept, start the study again to go on"
            ) from reason
        self._count()

    def everywhere(self, check: Callable[..., str], *arguments: Any) -> str:
        """See `Workers`. One worker of each machine goes first, so that kernels are compiled once."""
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
        """Cancel the tasks that have not begun."""
        with contextlib.suppress(Exception):  # without a cluster there is nothing to cancel
            self._executor.shutdown(wait=not abandon, cancel_futures=True)


@contextlib.contextmanager
def connected(scheduler: str) -> Iterator[Any]:
    """Yield a client of the scheduler at an address, such as tcp://host:8786, or of the file that it wrote."""
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
            "is no address, as tcp://host:8786, and no scheduler file", key=f"--scheduler {scheduler}", value=scheduler
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
    """Check that client, scheduler and workers have the same versions. Ask the workers for that of activesteer."""
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

"""The processes that drive the runs of a study."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import pytest

from activesteer.config import Range
from activesteer.errors import ParameterError
from activesteer.studies.engine.workers import _ATTEMPTS, LocalProcesses, TaskQueue, WorkerDied, workers_for
from tests.raising import raises


@pytest.mark.parametrize(("given", "there"), [(None, "1"), ("3", "3")])
def test_a_worker_solves_equations_in_one_thread_unless_told_otherwise(monkeypatch, given, there) -> None:
    name = "OPENBLAS_NUM_THREADS"
    monkeypatch.delenv(name, raising=False)
    if given is not None:
        monkeypatch.setenv(name, given)
    workers = LocalProcesses(1)
    try:
        assert workers.submit(os.getenv, name).result() == there
    finally:
        workers.close(abandon=False)
    assert os.environ.get(name) == given, "this process is as it was"


def test_without_a_number_there_is_a_process_for_each_processor(monkeypatch) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _pid: {0, 1, 5}, raising=False)
    with workers_for() as workers:
        assert isinstance(workers, LocalProcesses)
        assert workers.in_flight == 4  # one task waits
    monkeypatch.setattr("os.sched_getaffinity", lambda _pid: {5}, raising=False)
    with workers_for() as workers:
        assert not isinstance(workers, LocalProcesses)
        assert workers.in_flight == 1


@pytest.mark.parametrize("jobs", [0, 65, 99_999_999])
def test_the_number_of_processes_is_bounded_before_one_is_started(monkeypatch, jobs) -> None:
    monkeypatch.setattr("activesteer.studies.engine.workers._processors", lambda: 16)
    monkeypatch.setattr("activesteer.studies.engine.workers.LocalProcesses", lambda _: pytest.fail("started"))
    with raises(ParameterError, key=f"--jobs {jobs}", value=jobs, allowed=Range(1, 64)), workers_for(jobs):
        pytest.fail("accepted")


class _DyingWorkers:
    """Workers of which one dies whenever it does the task `deadly`, with all that run beside it."""

    in_flight = 3

    def __init__(self) -> None:
        self.running: list[tuple[str, Future[str]]] = []
        self.beside: list[int] = []

    def submit(self, _alone: Callable[..., Any], function: Callable[[str], str], name: str) -> Future[str]:
        future: Future[str] = Future()
        self.running.append((name, future))
        if name == "deadly":
            self.beside.append(len(self.running) - 1)
            for _, other in self.running:
                other.set_exception(BrokenPipeError())
        elif len(self.running) == self.in_flight or self.beside:
            for each, other in self.running:
                other.set_result(function(each))
        if future.done():
            self.running = []
        return future

    def died(self, error: BaseException) -> bool:
        return isinstance(error, BrokenPipeError)

    def replace(self) -> None:
        """Start new processes."""


def test_a_task_that_kills_its_worker_is_tried_again_at_last_alone_and_then_given_up() -> None:
    workers = _DyingWorkers()
    queue = TaskQueue(workers)  # type: ignore[arg-type]
    for name in ("before", "deadly", "after"):
        queue.add(name, str.upper, name)
    outcomes = {outcome.key: outcome for outcome in queue.outcomes()}
    assert len(workers.beside) == _ATTEMPTS
    assert workers.beside[-1] == 0
    assert isinstance(outcomes["deadly"].error, WorkerDied)
    assert outcomes["before"].value == "BEFORE"  # blamed for nothing
    assert outcomes["after"].value == "AFTER"

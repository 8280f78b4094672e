"""The processes that drive the runs of a study."""

from __future__ import annotations

import os

import pytest

from activesteer.config import Range
from activesteer.errors import ParameterError
from activesteer.studies.engine.workers import LocalProcesses, workers_for
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

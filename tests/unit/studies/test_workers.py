"""The processes that drive the runs of a study."""

from __future__ import annotations

import os

import pytest

from activesteer.studies.workers import LocalProcesses


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

"""Studies on a Dask cluster: a scheduler and two workers in processes of their own."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, cast

import psutil
import pytest

from activesteer import simulate, study
from activesteer.errors import StudyError
from activesteer.measured.fitting import fit
from activesteer.studies.engine.workers import TaskQueue, Workers, in_parallel, workers_for
from tests.raising import raises
from tests.unit.studies.short import RATIO, short_study, write_controller

MU = tuple(0.7 + 0.01 * number for number in range(20))


class Cluster(NamedTuple):
    """A scheduler and its workers.

    Attributes:
        file: The scheduler file.
        workers: Their processes.
    """

    file: Path
    workers: list[subprocess.Popen[bytes]]


def _dask(*words: object) -> subprocess.Popen[bytes]:
    path = os.pathsep.join([str(Path.cwd()), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *map(str, words)],
        env=os.environ | {"PYTHONPATH": path},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


@pytest.fixture(scope="module")
def cluster(tmp_path_factory) -> Iterator[Cluster]:
    file = tmp_path_factory.mktemp("dask") / "scheduler.json"
    common = ("--scheduler-file", file, "--host", "127.0.0.1", "--no-dashboard")
    processes = [_dask("scheduler", "--port", 0, *common)]
    try:
        processes += [_dask("worker", "--nthreads", 1, *common) for _ in range(2)]
        deadline = time.monotonic() + 60
        while not file.exists():
            assert time.monotonic() < deadline
            time.sleep(0.1)
        yield Cluster(file, processes[1:])
    finally:
        for process in reversed(processes):
            for child in psutil.Process(process.pid).children(recursive=True):
                child.kill()
            process.kill()
            process.wait()


@pytest.mark.slow
def test_a_cluster_gives_the_same_bits_as_this_process(cluster, tmp_path):
    table = short_study(*MU, controllers=["none", "ars"])
    study(table, output=tmp_path / "dask", scheduler=str(cluster.file), limit=7)
    study(table, output=tmp_path / "dask", scheduler=str(cluster.file))
    study(table, output=tmp_path / "serial", jobs=1)
    assert (tmp_path / "dask/results.parquet").read_bytes() == (tmp_path / "serial/results.parquet").read_bytes()


@pytest.mark.slow
def test_a_cluster_fits_as_this_process_does(cluster, tmp_path):
    step = {"time_s": [0.1, 0.3], "steering_wheel_deg": [0.0, 40.0]}
    short = {"kind": "open_loop", "speed_kmh": 80.0, "duration_s": 1.0, "settle_s": 0.3, "hold_last": True}
    simulate({**short, "steering": step}, overrides={"factors.yaw_inertia": 1.1}).save(tmp_path / "a.mcap")
    table = {
        "maneuvers": [str(tmp_path / "a.mcap")],
        "overrides": {"settle_s": 0.3},
        "factors": {"factors.yaw_inertia": {"uniform": [0.8, 1.4]}},
        "fit": {"noise": {"yaw_rate_degps": 0.2}},
    }
    assert fit(table, scheduler=str(cluster.file)).to_json() == fit(table, jobs=1).to_json()


@pytest.mark.slow
def test_a_worker_of_a_cluster_that_dies_is_replaced(cluster, tmp_path):
    path = write_controller(tmp_path, MU[5], str(tmp_path / "once"))
    rows = study(short_study(*MU, key=RATIO, controllers=[f"{path}:Kills"]), scheduler=str(cluster.file)).to_pylist()
    assert (tmp_path / "once").exists()
    assert {row["status"] for row in rows} == {"ok"}


@pytest.mark.slow
def test_a_controller_that_differs_on_a_worker_is_told_before_the_first_run(cluster, tmp_path, monkeypatch):
    monkeypatch.setattr(
        "activesteer.studies.engine.plan.present_inputs", lambda _: {"controller mine.py:Mine": "another"}
    )
    with raises(StudyError) as refused:
        study(short_study(*MU), output=tmp_path, scheduler=str(cluster.file))
    assert "controller mine.py:Mine" in refused.value.problem


@pytest.mark.slow
def test_a_scheduler_that_dies_ends_the_study_with_what_is_finished(tmp_path):
    common = ("--scheduler-file", tmp_path / "scheduler.json", "--host", "127.0.0.1", "--no-dashboard")
    processes = [_dask("scheduler", "--port", 0, *common), _dask("worker", "--nthreads", 1, "--no-nanny", *common)]
    try:
        while not (tmp_path / "scheduler.json").exists():
            time.sleep(0.1)

        def kill(progress: Any) -> None:
            for process in processes:
                process.send_signal(signal.SIGKILL)

        with raises(StudyError, cause=OSError):
            study(
                short_study(*MU), output=tmp_path / "s", scheduler=str(tmp_path / "scheduler.json"), progress=kill
            )  # fmt: skip
        assert study(short_study(*MU), output=tmp_path / "s", jobs=1).num_rows == len(MU)
    finally:
        for process in processes:
            process.kill()
            process.wait()


def _free_port() -> int:
    with socket.socket() as here:
        here.bind(("127.0.0.1", 0))
        return here.getsockname()[1]


class FakeClient:
    """A cluster of one worker that reports its versions and does nothing else."""

    def __init__(self, **worker: str) -> None:
        packages = {"python": "3.11.7.final.0", "distributed": "2026.1.0", "dask": "2026.1.0"}
        here = {"packages": packages}
        self.versions = {"client": here, "scheduler": here, "workers": {"tcp://w": {"packages": packages | worker}}}

    def get_executor(self, **_: Any) -> Any:
        return None

    def wait_for_workers(self, *_: Any, **__: Any) -> None:
        pass

    def get_versions(self) -> dict[str, Any]:
        return self.versions

    def nthreads(self) -> dict[str, int]:
        return {"tcp://w": 1}


@pytest.mark.parametrize("worker", [{"distributed": "2025.1.0"}, {"python": "3.12.1.final.0"}])
def test_a_worker_with_other_versions_is_told_before_the_first_run(tmp_path, worker):
    with raises(StudyError, value=worker):
        study(short_study(*MU), output=tmp_path, client=FakeClient(**worker))
    with workers_for(client=FakeClient()) as workers:
        assert workers.in_flight >= 1


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_told(tmp_path):
    address = f"tcp://127.0.0.1:{_free_port()}"
    with raises(StudyError, cause=OSError, value=address):
        study(short_study(*MU[:2]), output=tmp_path, scheduler=address)


def test_what_is_no_address_is_told(tmp_path):
    with raises(StudyError, value="nowhere"):
        study(short_study(*MU[:2]), output=tmp_path, scheduler="nowhere")


def _same(value: int) -> int:
    return value


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.slow
def test_ten_thousand_tasks_come_back_each_once(jobs):
    with workers_for(jobs) as workers:
        tasks = ((number, _same, number) for number in range(10_000))
        found = [(outcome.key, outcome.value) for outcome in TaskQueue(workers).outcomes(tasks)]
    assert sorted(found) == [(number, number) for number in range(10_000)]


class Threads(ThreadPoolExecutor):
    """A cluster's worker with four threads."""

    in_flight = 8

    def died(self, _: BaseException) -> bool:
        return False


BUSY = threading.Lock()


def _finds_nobody_else(_: int) -> bool:
    alone = BUSY.acquire(blocking=False)
    if alone:
        time.sleep(0.005)  # in which another thread may begin
        BUSY.release()
    return alone


def test_of_a_workers_threads_one_does_a_task_at_a_time():
    with Threads(4) as workers:
        assert all(in_parallel(_finds_nobody_else, [(number,) for number in range(16)], workers=cast(Workers, workers)))
        alone = [task.result() for task in [workers.submit(_finds_nobody_else, number) for number in range(16)]]
    assert not all(alone)  # without the queue they meet


@pytest.mark.slow
def test_ten_thousand_tasks_come_back_from_a_cluster_each_once(cluster):
    with workers_for(scheduler=str(cluster.file)) as workers:
        tasks = ((number, abs, -number) for number in range(10_000))
        found = [(outcome.key, outcome.value) for outcome in TaskQueue(workers).outcomes(tasks)]
    assert sorted(found) == [(number, number) for number in range(10_000)]

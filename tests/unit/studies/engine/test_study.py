"""Complete studies: the same result for each way to run them, and the handling of errors."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from activesteer import study
from activesteer.errors import StudyError
from activesteer.recording import Recording
from activesteer.resources import find_vehicle, models_dir
from activesteer.studies.engine import study as engine_study
from activesteer.studies.engine.store import Store
from activesteer.studies.engine.workers import Workers, workers_for
from tests.raising import raises
from tests.unit.studies.short import MANEUVER, RATIO, short_study, write_controller

MU = (0.7, 0.8, 0.9, 1.0)
MANY = tuple(0.7 + 0.01 * number for number in range(10))
"""More than a task holds."""
BOTH: dict[str, Any] = {"controllers": ["none", "ars"]}


@pytest.fixture(scope="module")
def serial(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("serial") / "study"
    study(short_study(*MU, **BOTH), output=folder, jobs=1)
    return folder / "results.parquet"


def test_a_row_says_what_was_driven_and_what_came_of_it(serial):
    table = pq.read_table(serial)
    rows = table.to_pylist()
    assert [row["run"] for row in rows] == list(range(8))
    assert [(row["road.mu"], row["controller"]) for row in rows] == [(mu, c) for mu in MU for c in ("none", "ars")]
    assert {row["status"] for row in rows} == {"ok"}
    assert len({row["run_id"] for row in rows}) == 8
    assert all(row["yaw_rate_steady_state_radps"] > 0.01 for row in rows)
    assert table.schema.field("yaw_rate_steady_state_radps").metadata[b"unit"] == b"rad/s"
    assert table.schema.field("yaw_rate_response_time_s").metadata[b"unit"] == b"s"


@pytest.fixture(scope="module")
def processes() -> Iterator[Workers]:
    with workers_for(2) as workers:
        yield workers


@pytest.mark.parametrize("limits", [(None,), (3, 1, None)])
def test_processes_and_interruptions_change_no_bit(serial, processes, tmp_path, limits):
    for limit in limits:
        table = study(short_study(*MU, **BOTH), output=tmp_path, workers=processes, limit=limit)
        if limit is not None:
            assert table.num_rows == sum(other for other in limits[: limits.index(limit) + 1] if other)
    assert (tmp_path / "results.parquet").read_bytes() == serial.read_bytes()


def test_a_finished_study_is_not_driven_again(serial, monkeypatch):
    monkeypatch.setattr("activesteer.studies.engine.study.workers_for", lambda *_, **__: pytest.fail("it works"))
    assert study(short_study(*MU, **BOTH), output=serial.parent).num_rows == 8


_KILLED = """
import sys
from activesteer import study
from tests.unit.studies.short import short_study
if __name__ == "__main__":
    study(short_study(*[0.7 + 0.01 * i for i in range(20)]), output=sys.argv[1], jobs=2)
"""


@pytest.mark.slow
def test_a_killed_study_goes_on_with_what_is_missing(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(_KILLED)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(Path.cwd()), os.environ.get("PYTHONPATH", "")])}
    process = subprocess.Popen([sys.executable, script, tmp_path / "killed"], env=environment)
    parts = tmp_path / "killed" / "parts"
    deadline = time.monotonic() + 120
    while not list(parts.glob("[0-9]*.parquet")) and time.monotonic() < deadline:
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    done = {path: path.stat().st_mtime_ns for path in parts.glob("[0-9]*.parquet")}
    assert 0 < len(done) < 20
    progress = Store(tmp_path / "killed", ()).progress()
    assert (progress.total, progress.running) == (20, False)
    assert 0 < progress.done < 20
    table = short_study(*[0.7 + 0.01 * i for i in range(20)])
    study(table, output=tmp_path / "killed", jobs=1, limit=1)
    assert {path: path.stat().st_mtime_ns for path in done} == done
    study(table, output=tmp_path / "killed", jobs=1)
    study(table, output=tmp_path / "whole", jobs=1)
    assert (tmp_path / "killed/results.parquet").read_bytes() == (tmp_path / "whole/results.parquet").read_bytes()


@pytest.mark.slow
def test_a_worker_that_dies_is_replaced(processes, tmp_path):
    path = write_controller(tmp_path, 0.9, str(tmp_path / "once"))
    rows = study(short_study(*MU, key=RATIO, controllers=["none", f"{path}:Kills"]), workers=processes).to_pylist()
    assert (tmp_path / "once").exists()
    assert {row["status"] for row in rows} == {"ok"}


@pytest.mark.slow
def test_only_the_run_is_lost_that_kills_its_worker_every_time(tmp_path):
    path = write_controller(tmp_path, 0.9)
    rows = study(short_study(*MU, key=RATIO, controllers=["none", f"{path}:Kills"]), jobs=2).to_pylist()
    assert [row["status"] for row in rows] == ["ok"] * 5 + ["crashed"] + ["ok"] * 2
    assert "died" in rows[5]["error"]
    assert (rows[5][RATIO], rows[5]["controller"]) == (0.9, "bad.py:Kills")


def test_a_failed_run_is_a_row(tmp_path):
    path = write_controller(tmp_path, 0.9)
    rows = study(short_study(*MU, key=RATIO, controllers=["none", f"{path}:Fails"]), jobs=1).to_pylist()
    assert [row["status"] for row in rows] == ["ok"] * 5 + ["failed"] + ["ok"] * 2
    assert "on purpose" in rows[5]["error"]
    assert rows[5]["yaw_rate_steady_state_radps"] is None


def test_a_run_without_metrics_is_a_row_that_says_so():
    maneuver = {**MANEUVER, "duration_s": 1.0}
    [row] = study({"maneuvers": [maneuver]}, jobs=1).to_pylist()
    assert row["status"] == "unevaluated"
    assert "the run ends" in row["error"]


def test_another_study_in_the_same_folder_is_refused(serial):
    for other in (short_study(*MU), short_study(*MU, **BOTH, seed=5), short_study(*MU[:2], **BOTH)):
        with raises(StudyError, value=serial.parent):
            study(other, output=serial.parent, jobs=1)


def test_results_of_another_version_are_not_gone_on_with(tmp_path, monkeypatch):
    study(short_study(*MU), output=tmp_path, jobs=1, limit=1)
    monkeypatch.setattr("activesteer.studies.engine.runs.source_digest", lambda: "another")
    from activesteer.studies.engine import runs  # noqa: PLC0415

    runs.versions.cache_clear()
    try:
        with raises(StudyError, value=tmp_path):
            study(short_study(*MU), output=tmp_path, jobs=1)
    finally:
        monkeypatch.undo()
        runs.versions.cache_clear()


def test_two_processes_do_not_work_on_one_study(tmp_path):
    with Store(tmp_path, ()).opened("", "x", 1), raises(StudyError, cause=BlockingIOError, value=tmp_path):
        study(short_study(*MU), output=tmp_path, jobs=1)


def test_an_input_that_changes_while_the_study_runs_is_noticed(tmp_path):
    vehicle = tmp_path / "mine.toml"
    vehicle.write_bytes(find_vehicle("compact").read_bytes())

    def change(progress):
        vehicle.write_text(vehicle.read_text() + "\n# changed\n")

    rows = study(short_study(*MANY, vehicles=[str(vehicle)]), jobs=1, progress=change).to_pylist()
    assert rows[0]["status"] == "ok"
    assert rows[-1]["status"] == "failed"
    assert "changed while the study ran" in rows[-1]["error"]


def test_a_file_that_a_factor_names_and_that_changes_while_the_study_runs_is_noticed(tmp_path):
    tyres = [tmp_path / "one.tir", tmp_path / "other.tir"]
    for tyre in tyres:
        tyre.write_bytes((models_dir() / "tyres" / "compact_205_55R16.tir").read_bytes())
    vehicle = tmp_path / "mine.toml"
    vehicle.write_bytes(find_vehicle("compact").read_bytes())

    def change(progress):
        tyres[1].write_text(tyres[1].read_text() + "\n$ changed\n")

    many = short_study(*MANY[:5], vehicles=[str(vehicle)])
    many["factors"]["tyres.rear"] = {"grid": [str(tyre) for tyre in tyres]}
    rows = study(many, jobs=1, progress=change).to_pylist()
    of = {str(tyre): [row for row in rows if row["tyres.rear"] == str(tyre)] for tyre in tyres}
    assert {row["status"] for row in of[str(tyres[0])]} == {"ok"}
    assert of[str(tyres[1])][-1]["status"] == "failed"
    assert "changed while the study ran" in of[str(tyres[1])][-1]["error"]


@pytest.mark.parametrize(
    ("kept", "runs"), [("none", []), ("all", [0, 1, 2, 3]), ({"every": 2}, [0, 2]), ("failed", [2])]
)
def test_recordings_are_kept_as_asked(tmp_path, kept, runs):
    path = write_controller(tmp_path, 0.9)
    study(short_study(*MU, key=RATIO, controllers=[f"{path}:Fails"], recordings=kept), output=tmp_path / "s", jobs=1)
    found = sorted((tmp_path / "s" / "recordings").glob("*.mcap"))
    assert [int(file.name[:7]) for file in found] == runs
    for file in found:
        assert Recording.open(file, recover=True).metadata["overrides"][RATIO] == MU[int(file.name[:7])]


def test_only_the_metrics_asked_for_are_kept():
    table = study(short_study(0.9, metrics=["yaw_rate_*", "tb_srad"]), jobs=1)
    metrics = table.column_names[table.column_names.index("error") + 1 :]
    assert "tb_srad" in metrics
    assert len(metrics) > 3
    assert all(name.startswith("yaw_rate_") or name == "tb_srad" for name in metrics)


def test_what_a_row_lacks_is_empty_and_a_case_keeps_its_own_keys():
    other = {**MANEUVER, "name": "other", "steer": {**MANEUVER["steer"], "steering_wheel_deg": -20.0}}
    cases = [{"road.mu": 1, "speed_kmh": 70}, {"road.mu": 0.85}]
    rows = study({"maneuvers": [MANEUVER, other], "design": {"cases": cases}}, jobs=1).to_pylist()
    assert [(row["maneuver"], row["road.mu"], row["speed_kmh"]) for row in rows] == [
        ("short", 1.0, 70), ("short", 0.85, None), ("other", 1.0, 70), ("other", 0.85, None),
    ]  # fmt: skip


def test_a_full_disk_ends_the_study_and_keeps_what_is_finished(tmp_path, monkeypatch):
    written = pq.write_table
    calls = []

    def full(table, path, **options):
        calls.append(path)
        if len(calls) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")
        written(table, path, **options)

    monkeypatch.setattr("activesteer.studies.engine.store.pq.write_table", full)
    with raises(StudyError, cause=OSError):
        study(short_study(*MANY), output=tmp_path, jobs=1)
    progress = Store(tmp_path, ()).progress()
    assert 0 < progress.done < progress.total
    assert study(short_study(*MANY), output=tmp_path, jobs=1).num_rows == 10


def test_a_folder_that_cannot_be_written_is_told_before_anything_runs(tmp_path):
    (tmp_path / "file").touch()
    with raises(StudyError, cause=NotADirectoryError):
        study(short_study(*MU), output=tmp_path / "file" / "study", jobs=1)


def test_damaged_files_are_told(tmp_path):
    study(short_study(*MU), output=tmp_path, jobs=1, limit=2)
    part = next((tmp_path / "parts").glob("*.parquet"))
    part.write_bytes(part.read_bytes()[:100])
    with raises(StudyError, value=part):
        study(short_study(*MU), output=tmp_path, jobs=1)
    (tmp_path / "environment.json").write_text("{")
    with raises(StudyError, cause=json.JSONDecodeError, value=tmp_path / "environment.json"):
        study(short_study(*MU), output=tmp_path, jobs=1)


def test_environment_says_what_the_study_ran_on(serial):
    about = json.loads((serial.parent / "environment.json").read_text())
    assert {"activesteer", "mujoco", "numpy", "python"} <= set(about["versions"])
    assert about["runs"] == 8


def test_a_task_hands_over_its_finished_runs_in_time(tmp_path, monkeypatch):
    table = short_study(*[0.7 + 0.01 * number for number in range(8)])
    study(table, output=tmp_path / "once", jobs=1)
    monkeypatch.setattr(engine_study, "_KEPT_EVERY_S", 0.0)
    study(table, output=tmp_path / "often", jobs=1, limit=7)
    assert len(list((tmp_path / "often" / "parts").glob("[0-9]*.parquet"))) == 7
    study(table, output=tmp_path / "often", jobs=1)
    assert (tmp_path / "often/results.parquet").read_bytes() == (tmp_path / "once/results.parquet").read_bytes()

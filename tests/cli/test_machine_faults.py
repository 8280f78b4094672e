"""Machine faults (full disk, read-only folder, no home, kill, little memory), and repeatability of runs."""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import subprocess
import threading
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import activesteer
from activesteer import Recording
from activesteer.simulation.recorder import BLOCK_INTERVAL_S
from tests.cli.process import MAIN, begun, ended, environment

MORE_LIMITS = (100, 5_000, 50_000, 100_000, 200_000, 800_000)
MORE_STEPS = range(700, 9_700, 1_000)
SHORT = ("--set", "duration_s=2", "--set", "settle_s=0")
STUDY = """
maneuvers = ["straight_line"]
controllers = ["none"]

[overrides]
duration_s = 0.5
settle_s = 0.1

[factors]
"road.mu" = { grid = [0.5, 0.7, 0.9] }
"""
"""Three runs."""


def program(
    folder: Path,
    *words: str,
    limit: int | None = None,
    before: tuple[str, ...] = (),
) -> subprocess.CompletedProcess[str]:
    """Run the program in a folder with a size limit for its files [bytes]."""
    # CPython 3.11 keeps byte code that it could write in part only, and is broken by it at the next import.
    changed = {} if limit is None else {"PYTHONDONTWRITEBYTECODE": "1"}
    limited = "" if limit is None else f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit},) * 2); "
    return ended(folder, *words, code=limited + MAIN, before=before, changes=changed)


def assert_refused(done: subprocess.CompletedProcess[str]) -> None:
    assert done.returncode == 1, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("activesteer: ")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    activesteer.simulate("step_steer", "ars").save(path)
    return path


# -- the disk fills up -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("limit", [500_000, *(pytest.param(limit, marks=pytest.mark.slow) for limit in MORE_LIMITS)])
def test_a_full_disk_ends_a_run_with_one_error_and_what_was_saved(tmp_path: Path, limit: int) -> None:
    done = program(tmp_path, "run", "slalom", "-o", "run.mcap", limit=limit)
    assert_refused(done)
    assert "File too large" in done.stderr
    if "saved up to" in done.stderr:
        rows = Recording.open(tmp_path / "run.mcap")
        assert f"saved up to {rows.time_s[-1]:.3f} s" in done.stderr
    assert {path.name for path in tmp_path.iterdir()} <= {"run.mcap"}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> pa.Table:
    folder = tmp_path_factory.mktemp("study")
    (folder / "grip.toml").write_text(STUDY)
    assert program(folder, "study", "grip.toml", "-o", "s", "--jobs", "1").returncode == 0
    return pq.read_table(folder / "s" / "results.parquet")


@pytest.mark.parametrize(
    "limit",
    [
        pytest.param(200, id="its own file", marks=pytest.mark.slow),
        pytest.param(2_000, id="the first part", marks=pytest.mark.slow),
        pytest.param(7_000, id="the results", marks=pytest.mark.slow),
    ],
)
def test_a_study_resumes_after_a_full_disk_with_the_same_results(
    tmp_path: Path, undisturbed: pa.Table, limit: int
) -> None:
    (tmp_path / "grip.toml").write_text(STUDY)
    words = ("study", "grip.toml", "-o", "s", "--jobs", "1")
    assert_refused(program(tmp_path, *words, limit=limit))
    resumed = program(tmp_path, *words)
    assert resumed.returncode == 0, resumed.stderr
    assert pq.read_table(tmp_path / "s" / "results.parquet").equals(undisturbed)


@pytest.mark.slow
@pytest.mark.parametrize("limit", [100, pytest.param(100_000, marks=pytest.mark.slow)])
def test_a_full_disk_leaves_no_half_report(tmp_path: Path, recording: Path, limit: int) -> None:
    done = program(tmp_path, "report", str(recording), "-o", "report.html", limit=limit)
    assert_refused(done)
    assert list(tmp_path.iterdir()) == []


# -- folders, homes and languages --------------------------------------------------------------------------------------


@pytest.mark.slow  # the quick tests of test_errors.py have other targets that cannot be written
@pytest.mark.parametrize("command", ["run", "study", "report"])
def test_a_folder_that_may_not_be_written_is_one_error(
    tmp_path: Path, request: pytest.FixtureRequest, command: str
) -> None:
    (tmp_path / "grip.toml").write_text(STUDY)
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o555)
    words = {
        "run": ("run", "straight_line", *SHORT, "-o", "closed/run.mcap"),
        "study": ("study", "grip.toml", "-o", "closed/s", "--jobs", "1"),
        "report": ("report", "-o", "closed/report.html"),
    }[command]
    if command == "report":
        words += (str(request.getfixturevalue("recording")),)
    done = program(tmp_path, *words, before=unprivileged())
    assert_refused(done)
    assert "closed" in done.stderr
    assert "Permission denied" in done.stderr
    assert list(closed.iterdir()) == []


def unprivileged() -> tuple[str, ...]:
    """Return the prefix of a command that drops root's right to write everywhere; empty without root."""
    if os.geteuid() != 0:
        return ()
    words = ("setpriv", "--bounding-set=-dac_override,-dac_read_search")
    if shutil.which("setpriv") is None or subprocess.run([*words, "true"], check=False).returncode != 0:
        pytest.skip("root may write everywhere, and setpriv cannot take that right here")
    return words


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [{"HOME": "", "LANG": "C", "LC_ALL": "C"}, {"HOME": "/nonexistent", "XDG_CACHE_HOME": "/nonexistent"}],
    ids=["no home, language C", "home that does not exist"],
)
def test_a_run_and_its_report_need_no_home_and_no_language(tmp_path: Path, changes: dict[str, str]) -> None:
    words = (("run", "step_steer", "-c", "ars", "-o", "run.mcap"), ("report", "run.mcap", "-o", "report.html"))
    both = f"import sys; from activesteer.commands.cli import main; sys.exit(any([main(words) for words in {words}]))"
    done = ended(tmp_path, code=both, changes=changes)
    assert done.returncode == 0, done.stderr
    assert "m/s²" in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_two_first_compilations_at_once_both_drive(tmp_path: Path) -> None:
    empty = environment(NUMBA_CACHE_DIR=str(tmp_path / "kernels"))
    words = ("run", "straight_line", *SHORT, "--json", "-o")
    both = [begun(tmp_path, *words, name, env=empty) for name in ("one.mcap", "two.mcap")]
    for process in both:
        _, errors = process.communicate(timeout=300)
        assert process.returncode == 0, errors
    one, two = (Recording.open(tmp_path / name) for name in ("one.mcap", "two.mcap"))
    np.testing.assert_array_equal(one.values, two.values)


# -- killed ------------------------------------------------------------------------------------------------------------

LARGEST_LOSS_S = 2.0 * BLOCK_INTERVAL_S
JUST_BEFORE_A_BLOCK = 1_198
"""One block is almost full and the one before it may still be in the writer's hands, so that most is lost."""


@pytest.mark.slow
@pytest.mark.parametrize("step", [JUST_BEFORE_A_BLOCK, *MORE_STEPS])
def test_a_killed_run_loses_less_than_two_blocks(call, controller, tmp_path: Path, step: int) -> None:
    body = f"if self.steps > {step}:\n    import os\n    os.kill(os.getpid(), 9)\nreturn ActuatorCommand()"
    words = ("run", "slalom", "-c", controller(body), "--set", "settle_s=0", "-o", "run.mcap")
    assert LARGEST_LOSS_S < 0.7
    assert program(tmp_path, *words).returncode == -9
    left = Recording.open(tmp_path / "run.mcap")
    assert left.time_s[-1] >= 0.001 * step - LARGEST_LOSS_S
    assert np.isfinite(left.values).all()
    for words in (("info", "run.mcap"), ("report", "run.mcap"), ("replay", "run.mcap", "--save", "run.rrd")):
        told = call(*words)
        assert told.status == 0, told.err


@pytest.mark.slow
@pytest.mark.parametrize("after_s", np.linspace(0.2, 3.0, 10).round(2).tolist())
def test_a_run_killed_at_any_moment_leaves_a_recording_or_one_error(call, tmp_path: Path, after_s: float) -> None:
    words = ("run", "straight_line", "--set", "duration_s=300", "-o", "run.mcap")
    process = begun(tmp_path, *words, stdout=None, stderr=None)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(after_s)
    process.kill()
    process.wait()
    assert {path.name for path in tmp_path.iterdir()} <= {"run.mcap"}
    for words in (("info", "run.mcap"), ("report", "run.mcap"), ("replay", "run.mcap", "--save", "run.rrd")):
        told = call(*words)
        assert told.status == 0 or told.err.startswith("activesteer: "), told.err


# -- memory and repetition ---------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_half_an_hour_of_driving_takes_less_than_a_gigabyte(tmp_path: Path) -> None:
    # Not `ru_maxrss`, which a new process takes over from the test process that starts it.
    code = "from activesteer.commands.cli import main; status = main(); "
    code += "print(open('/proc/self/status').read().partition('VmHWM:')[2].split()[0]); raise SystemExit(status)"
    for duration_s in (1, 1800):  # the first run compiles, which takes a quarter of a gigabyte itself
        words = ("run", "straight_line", "--set", f"duration_s={duration_s}", "--json", "-o", f"{duration_s}.mcap")
        done = ended(tmp_path, *words, code=code)
        assert done.returncode == 0, done.stderr
    assert 1024 * int(done.stdout.split()[-1]) < 1e9


SHORT_RUNS = """
import ctypes, gc
import activesteer

def used_MB():
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)  # pages that the allocator keeps for later are not lost
    with open("/proc/self/statm") as stat:
        return int(stat.read().split()[1]) * 4096 / 1e6

for run in range(1000):
    activesteer.simulate("straight_line", "ars", overrides={"duration_s": 0.05, "settle_s": 0.01})
    if (run + 1) % 200 == 0:
        print(used_MB())
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="needs the C library of GNU/Linux")
def test_a_thousand_runs_in_one_process_lose_less_than_2_kB_each() -> None:
    done = ended(None, code=SHORT_RUNS)
    assert done.returncode == 0, done.stderr
    after_200_MB, *_, after_1000_MB = map(float, done.stdout.split())
    assert after_1000_MB < after_200_MB + 800 * 0.002


LANE = {
    "kind": "follow_path", "speed_kmh": 80, "duration_s": 3.0, "road": {"mu": 0.4},
    "path": {"x_m": [0.0, 20.0, 30.0, 40.0, 60.0, 80.0], "y_m": [0.0, 0.0, 1.0, 2.0, 2.0, 2.0]},
}  # fmt: skip
OVERRIDES = {"sensors.preset": "production"}
HASH = f"""
import hashlib, activesteer
run = activesteer.simulate({LANE}, "lqr", overrides={OVERRIDES})
print(hashlib.sha256(run.values.tobytes() + run.poses.positions_m.tobytes()).hexdigest())
"""


def test_a_run_is_the_same_to_the_last_bit_in_processes_threads_and_after_other_runs() -> None:
    found: list[str] = []

    def drive() -> None:
        run = activesteer.simulate(LANE, "lqr", overrides=OVERRIDES)
        found.append(hashlib.sha256(run.values.tobytes() + run.poses.positions_m.tobytes()).hexdigest())

    activesteer.simulate("straight_braking", "none", "sedan", overrides={"duration_s": 1.0})
    drive()
    threads = [threading.Thread(target=drive) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    # Another hash seed than this process has, which is random unless it is given.
    seed = "1" if os.environ.get("PYTHONHASHSEED") == "0" else "0"
    done = ended(None, code=HASH, changes={"PYTHONHASHSEED": seed})
    assert done.returncode == 0, done.stderr
    found.append(done.stdout.strip())
    assert len(found) == 4
    assert len(set(found)) == 1

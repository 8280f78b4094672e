"""`activesteer study` and `tune`: output, interruption, resuming."""

from __future__ import annotations

import re
import signal
import time
from pathlib import Path

import pytest

from activesteer.commands.terminal import Progress
from activesteer.studies.engine.study import StudyProgress
from tests.cli.process import MAIN, begun

STUDY = """
controllers = ["none"]

[[maneuvers]]
name = "short"
kind = "step_steer"
speed_kmh = 80
duration_s = 2.3
settle_s = 0.1
steer = { start_s = 0.05, steering_wheel_deg = 20.0 }

[factors]
"road.mu" = { uniform = [0.7, 1.0] }

[design]
kind = "sobol"
samples = 64

[tune]
trials = 3
minimise = { yaw = "abs(yaw_rate_overshoot(none))" }
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "grip.toml"
    path.write_text(STUDY, encoding="utf-8")
    return path


def test_a_study_is_made_in_pieces_and_says_how_far_it_is(file, tmp_path, call):
    folder = str(tmp_path / "s")
    first = call("study", str(file), "-o", folder, "--jobs", "1", "--limit", "2")
    assert first.status == 0
    assert "2 of 64 runs are done: 2 ok" in first.out
    assert f"resume with `activesteer study {folder}`" in first.out
    second = call("study", folder, "--jobs", "1", "--limit", "1", "--json").json
    assert (second["done"], second["missing"], second["results"]) == (3, 61, None)
    assert call("study", folder, "--status", "--json").json["by_status"] == {"ok": 3}
    page = call("study", folder, "--report", "--json").json["report"]
    assert "3 ok" in Path(page).read_text(encoding="utf-8")


def test_a_search_goes_on_where_it_was(file, tmp_path, call):
    folder = str(tmp_path / "t")
    assert call("tune", str(file), "-o", folder, "--jobs", "1", "--trials", "2", "--json").json["done"] == 2
    told = call("tune", str(file), "-o", folder, "--jobs", "1")
    assert told.status == 0
    assert told.out.startswith("3 sets tried, 0 with a failed run; the best:")
    assert "road.mu = " in told.out
    # Sets that differ by little can be told apart.
    best = call("tune", str(file), "-o", folder, "--jobs", "1", "--json").json["front"][0]["objectives"]
    assert told.out.splitlines()[1] == "  ".join(f"{name} {value:.3g}" for name, value in best.items())


GRID = """
controllers = ["{controller}"]
metrics = ["yaw_rate_over*", "yaw_rate_peek*"]

[[maneuvers]]
name = "short"
kind = "step_steer"
speed_kmh = 80
duration_s = 2.3
settle_s = 0.1
steer = {{ start_s = 0.05, steering_wheel_deg = 20.0 }}

[factors]
"road.mu" = {{ grid = [0.8, 1.0] }}
"""


def test_a_study_whose_runs_all_fail_has_a_status_other_than_0(call, controller, tmp_path):
    name = controller("raise RuntimeError('on purpose') if self.steps > 200 else None\nreturn ActuatorCommand()")
    (tmp_path / "bad.toml").write_text(GRID.format(controller=name))
    told = call("study", "bad.toml", "-o", "s", "--jobs", "1")
    assert told.status == 1
    assert "2 of 2 runs are done: 2 failed" in told.out
    assert call("study", "s", "--json").status == 1


def test_a_metric_pattern_that_matches_nothing_is_said(call, tmp_path):
    (tmp_path / "good.toml").write_text(GRID.format(controller="none"))
    told = call("study", "good.toml", "-o", "s", "--jobs", "1")
    assert told.status == 0
    assert "metrics: the pattern 'yaw_rate_peek*' matches no metric of these runs" in told.err
    assert "yaw_rate_over*" not in told.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "made", "how"),
    [
        (("study",), "parts/[0-9]*", r"resume with `activesteer study \S+`"),
        (("tune", "--trials", "1000"), "*.journal", "the same command resumes it"),
    ],
)
def test_ctrl_c_says_how_to_go_on(file, tmp_path, words, made, how):
    often = "import activesteer.studies.engine.study as engine; engine._KEPT_EVERY_S = 0.5; " + MAIN
    process = begun(tmp_path, words[0], str(file), *words[1:], "-o", str(tmp_path / "out"), "--jobs", "1", code=often)
    try:
        deadline = time.monotonic() + 120.0
        while not list((tmp_path / "out").glob(made)) and time.monotonic() < deadline:
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=30.0)
    finally:
        process.kill()
    assert process.returncode == 128 + signal.SIGINT, told
    assert re.search(rf"activesteer: stopped by Ctrl-C; saved: .*; {how}$", told.strip().splitlines()[-1]), told


def test_a_log_gets_a_line_of_progress_at_the_end(capsys):
    with Progress("study", quiet=False) as progress:
        progress.count(StudyProgress(done=4, total=8, failed=0, here=2))
        assert capsys.readouterr().err == ""  # not more than one in ten seconds
        progress.count(StudyProgress(done=8, total=8, failed=1, here=6))
    line = capsys.readouterr().err
    assert re.fullmatch(r"8/8 runs, \S+ runs/s, 0:00:00 left, 1 failed\n", line)
    with Progress("study", quiet=True) as progress:
        progress.count(StudyProgress(done=8, total=8, failed=1, here=6))
    assert capsys.readouterr().err == ""

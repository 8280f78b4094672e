"""Tables of all commands fit a terminal of 80 columns."""

from __future__ import annotations

from pathlib import Path

import pytest

from activesteer.resources import models_dir
from tests.cli.conftest import Call, Told

STUDY = """
controllers = ["none", "broken.py:Broken"]

[[maneuvers]]
name = "short"
kind = "step_steer"
speed_kmh = 80
duration_s = 2.3
settle_s = 0.1
steer = { start_s = 0.05, steering_wheel_deg = 20.0 }

[factors]
"road.mu" = { grid = [0.9] }
"""
BROKEN = """
class Broken:
    def __init__(self, setup):
        pass

    def step(self, command, measurement):
        raise ValueError("a reason that takes more than one line: " + "word " * 20)
"""
SHORT = ("--set", "duration_s=3", "--set", "settle_s=0")
CONTROLLERS = ("none", "ars", "afs", "ars_sideslip", "afs_tuned", "ars_tuned", "integrated")


def check(told: Told) -> None:
    # A path is not broken.
    wide = [line for line in told.out.splitlines() if len(line) > 80 and len(line.split()) > 1]
    assert told.out
    assert wide == []


@pytest.fixture
def runs(call: Call) -> list[Path]:
    """Return recordings of many controllers, whose table is checked too."""
    words = [word for name in CONTROLLERS for word in ("-c", name)]
    told = call("run", "step_steer", *words, *SHORT, "--all", "-o", "runs")
    assert told.status == 0
    check(told)
    assert all(name in told.out for name in ("afs", "integrated", "ars_tuned"))
    return sorted(Path("runs").glob("*.mcap"))


def test_run_info_and_compare(call: Call, runs: list[Path]) -> None:
    check(call("info", runs[0]))
    told = call("compare", runs[0], runs[1])
    check(told)
    assert "lateral acceleration, m/s²" in told.out
    assert told.out.count("side") >= 6  # inside or outside, for each quantity


@pytest.mark.parametrize("path", sorted((models_dir() / "tyres").glob("*.tir")), ids=lambda path: path.stem)
def test_tyre(call: Call, path: Path) -> None:
    check(call("tyre", path))


def test_lists_and_checks(call: Call) -> None:
    for words in ("list", "vehicle check compact", "linearise", "linearise --loop controller --speed-kmh 80"):
        check(call(*words.split()))


def test_study_with_a_failed_run(call: Call, tmp_path: Path) -> None:
    (tmp_path / "some.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "broken.py").write_text(BROKEN, encoding="utf-8")
    told = call("study", "some.toml", "-o", "out", "--jobs", "1")
    assert "1 failed" in told.out, told.err
    check(told)
    check(call("study", "out", "--status"))


@pytest.mark.slow
def test_verdicts_of_a_standard(call: Call) -> None:
    told = call("test", "iso4138", "-c", "none", "-c", "ars", "--jobs", "1")
    check(told)
    assert [line.split()[0] for line in told.out.splitlines()[1:] if line[0] != " "] == ["none", "ars"]

"""The examples run as their first lines say, and show their subject."""

from __future__ import annotations

import ast
import functools
import math
import re
import runpy
import shlex
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import activesteer
from activesteer.commands.cli import main

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
NEED_MORE = {"train_rear_steer.py", "udp_client.py"}
"""Scripts that need arguments, minutes of training or another process; tests of learning and of UDP use them."""
SLOW = {"cosimulation.py"}
DRIVEN = {"own_controller.py", "own_driver.py", "own_estimating_controller.py", "own_mpc.py", "own_manoeuvre.toml"}
"""Files whose command drives what another test drives; the slow tests run it."""
SHOWN = {f"own_{name}.py" for name in ("car", "controller", "driver", "loop", "manoeuvre", "mpc", "study")}
"""Scripts with a test of their own below, which drives once and gives the result to the part that prints."""
SCRIPTS = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if path.name in SLOW else [])
    for path in sorted(EXAMPLES.glob("*.py"))
    if path.name not in NEED_MORE | SHOWN
]


def example(name: str) -> dict[str, Any]:
    """Return the names that a script defines."""
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


@pytest.fixture
def show(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., None]:
    """Run what a script does if it is called, with functions that return results which are already there."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")

    def show(name: str, scope: dict[str, Any], **functions: Callable[..., Any]) -> None:
        called = ast.parse((EXAMPLES / f"{name}.py").read_text(encoding="utf-8")).body[-1]
        assert isinstance(called, ast.If)
        assert ast.unparse(called.test) == "__name__ == '__main__'"
        exec(compile(ast.Module(called.body, []), name, "exec"), scope | functions)
        assert len(capsys.readouterr().out.splitlines()) >= 2
        assert not list(Path().iterdir()), "an example leaves no files where it is run"

    return show


@pytest.mark.parametrize("path", SCRIPTS)
def test_script_runs_and_prints(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if "Needs a C compiler" in path.read_text(encoding="utf-8") and shutil.which("cc") is None:
        pytest.skip("needs a C compiler")
    monkeypatch.chdir(tmp_path)
    # A study's processes would load the engine once more each.
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    monkeypatch.setattr("os.sched_getaffinity", lambda _pid: {0}, raising=False)
    runpy.run_path(str(path), run_name="__main__")
    assert len(capsys.readouterr().out.splitlines()) >= 2
    assert not list(tmp_path.iterdir()), "an example leaves no files where it is run"


COMMANDS = [
    pytest.param(path.name, line.strip(), id=path.name, marks=[pytest.mark.slow] if path.name in DRIVEN else [])
    for path in sorted(EXAMPLES.iterdir())
    if path.suffix in {".py", ".toml"} and path.name not in NEED_MORE
    for line in re.findall(r"^(?:#| )\s+(activesteer .*)$", path.read_text(encoding="utf-8"), re.MULTILINE)
]


@pytest.mark.parametrize(("name", "command"), COMMANDS)
def test_command_in_an_example_runs(
    name: str, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(EXAMPLES)
    assert name in command
    assert main(shlex.split(command)[1:]) == 0, capsys.readouterr().err
    assert list(tmp_path.glob("runs/*.mcap"))


def test_every_example_is_listed() -> None:
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    files = {path.name for path in EXAMPLES.iterdir() if path.is_file()}
    assert not {name for name in files if f"examples/{name}" not in text}


def test_own_controller_keeps_the_car_from_spinning(show: Callable[..., None]) -> None:
    runs = (scope := example("own_controller"))["compare"]()
    show("own_controller", scope, compare=lambda: runs)
    sideslip_rad = {name: run.metrics["sideslip_peak_abs_rad"] for name, run in runs.items()}
    assert sideslip_rad["yaw damper"] < 0.3 * sideslip_rad["none"]
    assert runs["yaw damper"]["rear_steer_demand_rad"].any()


def test_own_mpc_keeps_the_car_within_its_envelope(show: Callable[..., None]) -> None:
    pytest.importorskip("daqp")
    scope = example("own_mpc")
    found = scope["compare"]()
    peaks = {name: run.metrics["sideslip_peak_abs_rad"] for name, run in found.items()}
    assert peaks["envelope"] < math.radians(5.0) < peaks["none"]
    assert found["envelope"].metrics["lateral_displacement_m"] > 1.83  # FMVSS 126
    show("own_mpc", scope, compare=lambda: found)


def test_own_driver_keeps_the_lane_change_but_cuts_it(show: Callable[..., None]) -> None:
    runs = (scope := example("own_driver"))["compare"]()
    show("own_driver", scope, compare=lambda: runs)
    typical, own = (runs[name].metrics for name in ("typical", "pure pursuit"))
    assert own["speed_end_mps"] > 15.0
    # A single point ahead: the corners of the path are cut, more than by the typical driver and by less than a lane.
    assert typical["track_deviation_max_m"] < own["track_deviation_max_m"] < 2.0


def test_own_loop_drives_the_car_into_its_turn(show: Callable[..., None]) -> None:
    simulation = (scope := example("own_loop"))["drive"]()
    show("own_loop", scope, drive=lambda: simulation)
    recording = simulation.recording()
    assert recording.metadata["commands_given"] == {"driver": 8000, "controller": 8000}
    assert recording["speed_mps"][[0, -1]] == pytest.approx([10.0, 15.0], rel=0.02)
    assert recording["speed_mps"][-1] / recording["yaw_rate_radps"][-1] == pytest.approx(50.0, rel=0.02)
    # One command each 10 ms, held in between, is what the car got.
    held = recording["rear_steer_demand_rad"].reshape(-1, 10)
    assert (held == held[:, :1]).all()
    assert len(set(held[:, 0])) > 300


def test_own_manoeuvre_tightens(show: Callable[..., None]) -> None:
    drive = functools.cache((scope := example("own_manoeuvre"))["drive"])
    show("own_manoeuvre", scope, drive=drive)
    slow, fast = drive(40.0), drive(60.0)
    # v^2 / R; the end of the bend, of some 45 m radius, is at the recording's end.
    ratio = fast.metrics["ay_peak_abs_mps2"] / slow.metrics["ay_peak_abs_mps2"]
    assert ratio == pytest.approx((60.0 / 40.0) ** 2, rel=0.1)
    assert fast["yaw_rate_radps"][-1] > 2.0 * fast["yaw_rate_radps"][len(fast) // 2]


def test_own_manoeuvre_file_brakes_in_its_turn() -> None:
    table = tomllib.loads((EXAMPLES / "own_manoeuvre.toml").read_text(encoding="utf-8"))
    run = activesteer.simulate(EXAMPLES / "own_manoeuvre.toml")
    braking = (run.time_s > 3.1) & (run.time_s < 3.4)
    assert run["ax_mps2"][braking].mean() < -1.5
    assert run["ay_mps2"][braking].mean() > 2.0
    assert run["fl_mu"].min() == pytest.approx(table["road"]["patches"][0]["mu"])


@pytest.mark.slow
def test_own_cars_roll_as_their_changes_say(tmp_path: Path, show: Callable[..., None]) -> None:
    runs = (scope := example("own_car"))["compare"](tmp_path)
    show("own_car", scope, compare=lambda _folder: runs)
    roll_rad = {name: run.metrics["roll_steady_state_rad"] for name, run in runs.items()}
    assert roll_rad["300 kg in the boot"] > 1.03 * roll_rad["compact"]
    assert roll_rad["stiffer front"] < 0.95 * roll_rad["compact"]
    masses_kg = [runs[name].metadata["vehicle"]["load"]["payload_kg"] for name in ("compact", "300 kg in the boot")]
    assert masses_kg == [0.0, 300.0]


@pytest.mark.slow
def test_own_study_shows_that_rear_steering_takes_the_overshoot_out(show: Callable[..., None]) -> None:
    scope = example("own_study")
    table = activesteer.study(scope["STUDY"], jobs=1)
    show("own_study", scope, study=lambda _table: table)
    found = scope["overshoots"](table)
    assert set(found) == {(controller, mu) for controller in ("none", "ars_tuned") for mu in (0.7, 1.0)}
    assert all(found["ars_tuned", mu] < 0.6 * found["none", mu] for mu in (0.7, 1.0))

"""Errors of the command line: one message, status 1, no traceback, no lost file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from activesteer import Recording
from activesteer.commands.arguments import SUCCESSORS
from activesteer.commands.cli import command_line, main
from activesteer.resources import find_vehicle

SHORT = ("--set", "settle_s=0", "--set", "duration_s=0.3")


def refused(told, *texts: str) -> None:
    assert told.status == 1
    assert told.out == ""
    assert told.err.startswith("activesteer: ")
    assert "Traceback" not in told.err
    for text in texts:
        assert text in told.err


@pytest.mark.parametrize(
    ("words", "texts"),
    [
        (["step_ster"], ["no manoeuvre is named 'step_ster'", "did you mean 'step_steer'"]),
        (["nowhere/mine.toml"], ["nowhere/mine.toml does not exist"]),
        (["step_steer", "-c", "asr"], ["there is no controller 'asr'", "did you mean 'ars'"]),
        (["step_steer", "-c", "mpc"], ["'mpc' is an example now; use -c examples/own_mpc.py:EnvelopeMpc"]),
        (["step_steer", "-c", "mine.py:Mine"], ["controller mine.py:Mine: mine.py does not exist"]),
        (["step_steer", "--vehicle", "compct"], ["no vehicle is named 'compct'", "did you mean 'compact'"]),
        (["step_steer", "--set", "road.mue=1"], ["override road.mue", "did you mean 'road.mu'"]),
        (["step_steer", "--set", "road.mu=wet"], ["override road.mu: 'wet' is not a number"]),
        (["step_steer", "--set", "speed_kmh=999"], ["override speed_kmh: 999 is out of range; allowed: -72 to 360"]),
        (["step_steer", "--set", "road.mu"], ["--set road.mu: KEY=VALUE is needed"]),
        (["step_steer", "--set", "=3"], ["--set =3: KEY=VALUE is needed"]),
        (["step_steer", "--set", "road.mu=" + "[" * 3000], ["nested too deeply"]),
        (["step_steer", "--set", "road=5", "--set", "road.mu=0.5"], ["override road.mu: replaces the value of road"]),
        (["step_steer", "--set", "road.mu=1", "--set", "road.mu=0.5"], ["override road.mu: is given twice"]),
        (["step_steer", "--set", "name=x"], ["use maneuver.name or vehicle.name"]),
        (["step_steer", "--set", "tyres.rear=x.tir"], ["override tyres.rear: there is no file 'x.tir'"]),
        (["step_steer", "--set", "mjcf=x.xml"], ["override mjcf: there is no file 'x.xml'"]),
        (["step_steer", "--set", "steer.start_s=9"], ["steer.start_s: is 9 s, but the run ends at 5 s"]),
        (["step_steer", "-c", "ars", "-c", "ars"], ["-c ars -c ars", "same name"]),
        (
            ["step_steer", "-c", "ars", "-c", "afs", "-o", "a.mcap"],
            ["-o a.mcap: 2 controllers need a folder"],
        ),
        (["step_steer", "-o", "film.mp4"], ["-o film.mp4", "ends in .mcap"]),
    ],
)
def test_wrong_input_is_answered_before_anything_runs(call, tmp_path, words, texts):
    refused(call("run", *words), *texts)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "texts"),
    [
        (["rnu", "step_steer"], ["no command 'rnu'", "'run'"]),
        (["--json", "run", "step_steer"], ["activesteer run --json"]),
        (["run", "step_steer", "--fualt", "rear:stuck@2"], ["usage: activesteer run", "--fault"]),
        (["run", "step_steer", "--jobs", "4"], ["usage: activesteer run", "activesteer run --help"]),
        (["run", "step_steer", "road.mu=0.4"], ["--set road.mu=0.4"]),
        (["run", "step_steer", "--set", "road.mu", "0.4"], ["KEY=VALUE"]),
        (["vehicle", "new", "mine", "--tabel", "x.toml"], ["usage: activesteer vehicle new", "--table"]),
    ],
)
def test_a_misplaced_or_misspelt_word_is_answered_with_the_right_one(capsys, words, texts):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert all(text in said for text in texts)


@pytest.mark.parametrize(
    ("words", "texts"),
    [
        (["study", "populaton"], ["'population'"]),
        (["study", "population"], ["-o DIR is needed"]),
        (["fit", "population"], ["population.toml: fit"]),
        (["linearise", "--loop", "controller", "-c", "none", "--speed-kmh", "80"], ["-c", "no loop"]),
        (["study", "envelope", "-o", "envelope", "-c", "asr"], ["'asr'", "'ars'"]),
        (["compare", "bmw_m8", "--samples", "5"], ["--samples", "bmw_m8"]),
        (["compare", "tesla_model_s", "--filter", "none"], ["--filter", "a folder"]),
        (["compare", "a.mcap", "b.mcap", "--jobs", "1"], ["--jobs", "recordings"]),
        (["compare", "golf"], ["no folder golf", "bmw_m8"]),
        (["fit", "tesla_model_s"], ["nothing to fit", "activesteer compare tesla_model_s"]),
        (["report", "."], ["DIR/*.mcap"]),
        (["run", "straight_line", "--watch", "--plot"], ["--plot", "--watch"]),
        (["test", "iso4138", "--jobs", "2", "--scheduler", "tcp://nowhere:1"], ["--jobs 2", "--scheduler"]),
        (["video", "run.mcap", "--corner", "rl"], ["--corner", "--camera wheel"]),
        (["identify", "--write", "--vehicle", str(find_vehicle("compact")), "--set", "factors.mass=1.1"], ["--write"]),
    ],
)
def test_an_option_without_effect_or_a_wrong_name_is_answered(call, tmp_path, words, texts):
    refused(call(*words), *texts)
    assert list(tmp_path.iterdir()) == []


def test_last_controller_is_looked_at_before_the_first_run(call, tmp_path):
    refused(call("run", "straight_line", *SHORT, "-c", "none", "-c", "asr"), "'asr'")
    assert list(tmp_path.iterdir()) == []


def test_bad_files_are_answered_with_file_key_and_line(call, tmp_path):
    (tmp_path / "mine.toml").write_text('kind = "open_loop"\nspeed_kmh = 80\nduration_s = "long"\n')
    refused(call("run", "mine.toml"), "mine.toml, line 3: duration_s: 'long' is not a number")
    (tmp_path / "mine.toml").write_text('kind = "open_loop\n')
    refused(call("run", "mine.toml"), "mine.toml: invalid TOML", "line 1")
    shipped = find_vehicle("compact").read_text()
    (tmp_path / "car.toml").write_text(shipped.replace("compact/compact.xml", str(tmp_path / "car.xml")))
    (tmp_path / "car.xml").write_text("<mujoco><worldbody></worldbody></mujoco>")
    refused(call("run", "standstill", "--vehicle", "car.toml"), "car.xml: ", "chassis")
    (tmp_path / "car.xml").write_text("<mujoco><worldbody>")
    refused(call("run", "standstill", "--vehicle", "car.toml"), "car.xml, line 1: ")


def test_two_files_with_a_class_of_the_same_name_are_answered(call, controller):
    first, second = (controller("return ActuatorCommand()", name) for name in ("a.py", "b.py"))
    refused(call("run", "straight_line", "-c", first, "-c", second), "a.py:Mine", "b.py:Mine", "same name")


@pytest.mark.parametrize(
    ("body", "text"),
    [
        ("return None if self.steps > 1000 else ActuatorCommand()", "step returned None"),
        ("return ActuatorCommand(float('nan') if self.steps > 1000 else 0.0)", "rear_steer_demand_rad = nan"),
        ("return ActuatorCommand(superposition_demand_rad=3.0 if self.steps > 1000 else 0.0)", "radians, not degrees"),
        (
            "return ActuatorCommand(1.0 / (1001 - self.steps) if self.steps > 1000 else 0.0)",
            "step raised ZeroDivisionError",
        ),
    ],
)
def test_run_that_fails_keeps_what_was_recorded(call, controller, tmp_path, body, text):
    name = controller(body)
    told = call("run", "straight_line", "-c", name, "--set", "settle_s=0", "--set", "duration_s=3", "-o", "out")
    refused(told, "controller mine.py:Mine: ", text)
    path = Path("out/straight_line-Mine.mcap")
    assert f"1000 steps were made; what was recorded until then is in {path}" in told.err
    recording = Recording.open(path)
    assert recording.metadata["complete"] is False
    assert text in recording.metadata["error"]
    assert recording.metadata["error"].startswith("ControllerError: ")
    assert len(recording) == 1000
    assert recording.time_s[-1] == pytest.approx(0.999)
    assert np.isfinite(recording["yaw_rate_radps"]).all()
    assert len(recording.poses.time_s) == 100
    info = call("info", path)
    assert info.status == 0
    assert "INCOMPLETE: ControllerError" in info.out


def test_car_that_diverges_keeps_what_was_recorded(call):
    """Dampers that push in the direction of motion add energy without end."""
    told = call(
        "run", "straight_line", "--set", "settle_s=0", "--set", "duration_s=3", "-o", "run.mcap",
        "--set", "dampers.front.force_N=" + json.dumps([5e8, 0.0, -5e8]),
        "--set", "dampers.front.velocity_mps=[-1.0, 0.0, 1.0]",
    )  # fmt: skip
    refused(told, " s", "what was recorded until then is in run.mcap")
    recording = Recording.open("run.mcap")
    assert recording.metadata["complete"] is False
    assert recording.metadata["error"].startswith("SimulationDiverged: ")
    assert 0 < len(recording) < 3000


@pytest.mark.parametrize("output", ["file/run.mcap", "file", "folder.mcap"])
def test_output_that_cannot_be_written_is_answered(call, tmp_path, output):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder.mcap").mkdir()
    refused(call("run", "straight_line", *SHORT, "-o", output), output.partition("/")[0])
    assert (tmp_path / "file").read_text() == "in the way"


def test_file_that_is_no_recording_is_kept_and_nothing_runs(call, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "straight_line-ars.mcap").write_text("my notes")
    told = call("run", "straight_line", "-c", "none", "-c", "ars", *SHORT, "-o", "out")
    refused(told, "straight_line-ars.mcap: it exists already and is not a recording of activesteer")
    (tmp_path / "out" / "slalom-afs.mcap").write_text("my notes")
    refused(call("reproduce", "-o", "out"), "slalom-afs.mcap: it exists already")
    assert {path.read_text() for path in (tmp_path / "out").iterdir()} == {"my notes"}


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, a disk that is always full")
def test_full_disk_is_answered(call, tmp_path):
    (tmp_path / "run.mcap").symlink_to("/dev/full")
    refused(call("run", "straight_line", *SHORT, "-o", "run.mcap"), "run.mcap", "No space left on device")


def test_interrupt_keeps_what_was_recorded(call, controller):
    name = controller("if self.steps > 700:\n    raise KeyboardInterrupt\nreturn ActuatorCommand()")
    told = call("run", "straight_line", "-c", name, "--set", "settle_s=0", "--set", "duration_s=3", "-o", "run.mcap")
    assert told.status == 130
    assert "stopped" in told.err
    recording = Recording.open("run.mcap")
    assert recording.metadata["complete"] is False
    assert len(recording) == 700


def test_a_removed_command_names_its_successor(capsys):
    for removed, successor in SUCCESSORS.items():
        with pytest.raises(SystemExit, match="2"):
            main([removed])
        assert f"use `activesteer {successor}`" in capsys.readouterr().err
        assert successor.split()[0] in command_line().names

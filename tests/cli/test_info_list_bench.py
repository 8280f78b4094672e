"""`activesteer list`, `info` and `bench`, and the options of the program."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import activesteer
from activesteer.commands.cli import main
from activesteer.core.version import __version__
from activesteer.resources import list_maneuvers

KEYS = {
    "bare_step_us",
    "plant_step_us",
    "closed_loop_step_us",
    "with_file_step_us",
    "closed_loop_to_bare_ratio",
    "with_file_to_bare_ratio",
    "real_time_factor",
    "real_time_factor_with_file",
}
"""Those that the interface promises."""


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    """Return a recording of 2.5 s, which has three blocks."""
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    settings = ("settle_s=0", "duration_s=2.5", "road.mu=0.7")
    words = [word for setting in settings for word in ("--set", setting)]
    assert main(["run", "straight_line", "-c", "ars", *words, "-o", str(path), "--json"]) == 0
    return path


def test_list_names_everything_that_can_be_run(call):
    told = call("list")
    assert told.status == 0
    for name in (*list_maneuvers(), "none", "ars", "afs", "compact", "my_file.py:MyController"):
        assert f"\n  {name} " in told.out + " " or f"\n  {name}\n" in told.out
    assert "Step steer, 80 km/h, 0.4 g, dry" in told.out
    table = json.loads(call("list", "--json").out)
    assert {"population", "tune_ars"} <= set(table["studies"])
    assert all(f"\n  {name}" in told.out for names in table.values() for name in names)


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["video", "--help"], ["list"]])
def test_what_is_listed_fits_into_80_columns(capsys, monkeypatch, words):
    monkeypatch.setenv("COLUMNS", "80")
    if "--help" in words:
        with pytest.raises(SystemExit, match="0"):
            main(words)
    else:
        assert main(words) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 80


def test_info_tells_what_a_recording_holds(call, file):
    told = call("info", file)
    assert told.status == 0
    assert max(map(len, told.out.splitlines()[1:])) <= 80
    printed = " ".join(told.out.split())
    for text in (
        f"{file}: 0.000 to 2.499 s, 2500 steps",
        "maneuver: straight_line Straight line, 80 km/h",
        "vehicle: compact",
        "controller: ars",
        "road.mu 0.7",
        f"activesteer {__version__}",
        "largest lateral acceleration",
        "mjcf/compact/compact.xml",
    ):
        assert text in printed
    for channel in activesteer.Recording.open(file).channels:
        assert channel.name in told.out
        assert channel.meaning in printed
    assert "INCOMPLETE" not in told.out
    table, opened = json.loads(call("info", file, "--json").out), activesteer.Recording.open(file)
    assert (table["steps"], table["to_s"], table["metrics"]) == (2500, opened.time_s[-1], opened.metrics)
    assert list(table["channels"]) == [channel.name for channel in opened.channels]


def test_info_of_a_file_cut_short_tells_what_is_left(call, file, tmp_path):
    data = file.read_bytes()
    short = tmp_path / "short.mcap"
    short.write_bytes(data[: len(data) * 7 // 10])
    told = call("info", short)
    assert told.status == 0
    assert "INCOMPLETE: " in told.out
    assert "controller: ars" in told.out
    steps = int(told.out.splitlines()[0].split(", ")[1].split()[0])
    assert steps in {1000, 1500, 2000}  # whole blocks of half a second


def test_info_of_a_damaged_file_tells_what_comes_before(call, file, tmp_path):
    data = bytearray(file.read_bytes())
    middle = len(data) * 7 // 10
    data[middle : middle + 1000] = bytes(1000)
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(data)
    told = call("info", damaged)
    assert told.status == 0
    steps = int(told.out.splitlines()[0].split(", ")[1].split()[0])
    assert steps in {1000, 1500, 2000}
    assert "INCOMPLETE: the file is damaged: the chunk in bytes " in told.out


@pytest.mark.parametrize(
    ("data", "told"),
    [(None, "cannot read"), (b"not an MCAP file", "is not an MCAP file"), (b"", "is not an MCAP file")],
)
def test_info_of_something_else_is_an_error(call, tmp_path, data, told):
    path = tmp_path / "x.mcap"
    if data is not None:
        path.write_bytes(data)
    answer = call("info", path)
    assert answer.status == 1
    assert answer.out == ""
    assert answer.err.startswith("activesteer: ")
    assert told in answer.err
    assert str(path) in answer.err


DIFFERENCES = {"estimator_lqr_us", "integrated_us", "own_controller_us"}


def test_bench_has_the_promised_keys_and_ratios(call, monkeypatch):
    """The stages are replaced, because `make test` runs the whole benchmark."""
    times_us = itertools.count(20)
    monkeypatch.setattr(
        "activesteer.studies.benchmark._interleaved", lambda stages, _: {name: [next(times_us)] for name in stages}
    )
    driven = SimpleNamespace(vehicle=SimpleNamespace(timestep_s=0.001), replay_us=None)
    for name, instead in {
        "with_amplitude_found": lambda scenario: scenario,
        "KeptInputs": lambda _: driven, "_runs_per_min": lambda: 100.0,
    }.items():  # fmt: skip
        monkeypatch.setattr(f"activesteer.studies.benchmark.{name}", instead)
    told = call("bench", "--rounds", "1", "--json")
    assert told.status == 0
    assert told.err == ""
    assert set(told.json) >= KEYS
    # What a controller costs is the difference of two loops: on a busy machine it may be less than nothing.
    assert all(value > 0.0 for name, value in told.json.items() if name not in DIFFERENCES)
    found = told.json
    assert found["closed_loop_to_bare_ratio"] == pytest.approx(found["closed_loop_step_us"] / found["bare_step_us"])
    assert found["with_file_to_bare_ratio"] == pytest.approx(found["with_file_step_us"] / found["bare_step_us"])
    assert found["sedan_real_time_factor"] == pytest.approx(1000.0 / found["sedan_step_us"])
    sensed = found["production_step_us"] / found["closed_loop_step_us"]
    assert found["production_to_ideal_ratio"] == pytest.approx(sensed)
    assert "estimator_lqr_us" in found
    engine = found["closed_loop_step_us"] / found["engine_step_us"]
    assert found["closed_loop_to_engine_ratio"] == pytest.approx(engine)
    engine = found["path_following_step_us"] / found["path_engine_step_us"]
    assert found["path_following_to_engine_ratio"] == pytest.approx(engine)
    assert {"threads_2_speedup", "step_steers_per_min", "path_following_to_bare_ratio"} <= set(found)
    assert found["real_time_factor"] == pytest.approx(1000.0 / found["closed_loop_step_us"])
    assert found["real_time_factor_with_file"] == pytest.approx(1000.0 / found["with_file_step_us"])


def test_bench_needs_a_round(call):
    told = call("bench", "--rounds", "0")
    assert told.status == 1
    assert "--rounds 0: at least 1 is needed" in told.err


def test_version_is_told(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"activesteer {__version__}\n"


def test_the_command_line_is_also_a_module():
    command = [sys.executable, "-m", "activesteer", "--version"]
    told = subprocess.run(command, cwd=Path(__file__).resolve().parents[2], capture_output=True, text=True, check=True)
    assert told.stdout == f"activesteer {__version__}\n"


@pytest.mark.parametrize("words", [[], ["fly"], ["run"], ["info"]])
def test_misused_command_line_is_told_with_its_usage(capsys, words):
    with pytest.raises(SystemExit) as stop:
        main(words)
    assert stop.value.code == 2
    assert "usage: activesteer" in capsys.readouterr().err


def test_reader_that_stops_early_is_no_error(file):
    """As in `activesteer info FILE | head -1`."""
    program = f"import sys; from activesteer.commands.cli import main; sys.exit(main(['info', {str(file)!r}]))"
    root = Path(__file__).resolve().parents[2]
    with subprocess.Popen(
        [sys.executable, "-u", "-c", program], cwd=root, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == ""

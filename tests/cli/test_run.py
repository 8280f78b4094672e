"""`activesteer run`: files, table, JSON, overrides."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from activesteer import Recording
from activesteer.analysis.metrics import KEY_METRICS
from activesteer.analysis.tables import comparison
from activesteer.commands import drive as run_command
from activesteer.commands.terminal import BAD, coloured, painted
from activesteer.core.metric_table import recorded_metric
from activesteer.resources import find_vehicle
from tests.cli.process import ended

SHORT = ("--set", "settle_s=0", "--set", "duration_s=0.3")
STEP = ("--set", "settle_s=0.1", "--set", "steer.steering_wheel_deg=30", "--set", "steer.start_s=0.1")
EVALUATED = (*STEP, "--set", "duration_s=2.4")
PAPER = ("--set", "duration_s=3")


def test_each_controller_makes_a_file_and_a_column(call, tmp_path):
    told = call("run", "step_steer", "-c", "none", "-c", "ars", "--controller", "afs", *PAPER, "-o", "out")
    assert told.status == 0
    files = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert files == ["step_steer-afs.mcap", "step_steer-ars.mcap", "step_steer-none.mcap"]
    lines = told.out.splitlines()
    assert lines[0].split() == ["none", "ars", "afs"]
    (peak,) = (line for line in lines if line.startswith("peak yaw rate  "))
    shown = [float(number) for number in peak.split()[-3:]]
    for name, value in zip(("none", "ars", "afs"), shown, strict=True):
        metrics = Recording.open(tmp_path / "out" / f"step_steer-{name}.mcap").metrics
        assert value == pytest.approx(math.degrees(metrics["yaw_rate_peak_radps"]), abs=6e-4)
    names = KEY_METRICS["step_steer"]
    assert [" ".join(line.split("  ")[:1]) for line in lines[1:11]] == [recorded_metric(name).label for name in names]
    assert lines[11:] == ["10 of 29 metrics; --all prints all"]
    again = call("run", "step_steer", "-c", "none", *PAPER, "-o", "out", "--all").out.splitlines()
    assert len(again) == 30
    assert not [line for line in [*lines, *again] if len(line) > 80]
    for name in ("none", "ars", "afs"):
        assert f"step_steer {name}: out/step_steer-{name}.mcap" in told.err


def test_a_run_notes_an_actuator_that_is_slower_than_its_controller_needs(call):
    arguments = ("run", "step_steer", "-c", "none", "-c", "ars", *STEP, "--set", "duration_s=0.3")
    told = call(*arguments, "--set", "rear_actuator.preset=screw_3deg", "-o", "slow")
    assert "step_steer ars: rear steering turns the wheels at 12 deg/s, but ars needs" in told.err
    assert "step_steer none: rear steering" not in told.err
    assert "needs" not in call(*arguments, "-o", "servo").err


def test_json_is_nothing_but_json(call):
    told = call("run", "step_steer", "-c", "none", "-c", "ars", *EVALUATED, "--json")
    assert told.status == 0
    assert told.err == ""
    assert set(told.json) == {"maneuver", "vehicle", "runs"}
    assert (told.json["maneuver"], told.json["vehicle"]) == ("step_steer", "compact")
    assert [run["controller"] for run in told.json["runs"]] == ["none", "ars"]
    for run in told.json["runs"]:
        stored = Recording.open(run["file"]).metrics
        assert set(run["metrics"]) == set(stored)
        for name, value in run["metrics"].items():
            assert value is None if math.isnan(stored[name]) else value == stored[name]


def test_json_says_null_where_a_metric_is_not_defined(call):
    # The least step that counts as one: the sideslip angle is too small to say when it peaked.
    told = call(
        "run", "step_steer", "--json", "--set", "steer.steering_wheel_deg=0.51", "--set", "steer.start_s=0.1",
        "--set", "duration_s=2.4", "--set", "settle_s=0.5",
    )  # fmt: skip
    values = told.json["runs"][0]["metrics"]
    assert None in values.values()
    assert any(isinstance(value, float) for value in values.values())


def test_output_may_be_a_file(call, tmp_path):
    assert call("run", "straight_line", *SHORT, "-o", "deep/er/run.mcap").status == 0
    assert len(Recording.open(tmp_path / "deep" / "er" / "run.mcap")) == 300


def test_output_goes_to_runs_where_nothing_is_said(call, tmp_path):
    assert call("run", "straight_line", *SHORT).status == 0
    assert (tmp_path / "runs" / "straight_line-none.mcap").is_file()


def test_recording_that_exists_is_replaced_but_one_of_other_settings_only_where_that_is_said(call, tmp_path):
    words = ("run", "straight_line", "--set", "settle_s=0", "-o", "run.mcap", "--set")
    for _ in range(2):
        assert call(*words, "duration_s=0.2").status == 0
    told = call(*words, "duration_s=0.3")
    assert told.status == 1
    assert "run.mcap was made with other settings (maneuver.duration_s 0.2); --replace replaces it" in told.err
    assert "controller 'none'" in call(*words, "duration_s=0.2", "-c", "ars").err
    assert len(Recording.open(tmp_path / "run.mcap")) == 200
    assert call(*words, "duration_s=0.3", "--replace").status == 0
    assert len(Recording.open(tmp_path / "run.mcap")) == 300


@pytest.mark.parametrize(
    ("text", "key", "value"),
    [
        ("road.mu=0.4", ("maneuver", "road", "mu"), 0.4),
        ("speed_kmh=72", ("maneuver", "speed_mps"), 20.0),
        ("title=a short one", ("maneuver", "title"), "a short one"),
        ('title="quoted"', ("maneuver", "title"), "quoted"),
        ("controllers.ars.limit_deg=2", ("vehicle", "controllers", "ars", "limit_rad"), math.radians(2.0)),
        ("aerodynamics.pressure_point_m=[-1, 0, 0.5]", ("vehicle", "aerodynamics", "pressure_point_m"), [-1, 0, 0.5]),
        ("brake={time_s=[0.0], pedal=[0.1]}", ("maneuver", "brake", "pedal"), [0.1]),
    ],
)
def test_set_takes_values_as_toml_does(call, text, key, value):
    assert call("run", "straight_line", "-c", "ars", *SHORT, "--set", text, "-o", "run.mcap").status == 0
    found = Recording.open("run.mcap").metadata
    for part in key:
        found = found[part]
    assert found == (pytest.approx(value) if isinstance(value, float) else value)


def test_setting_of_a_controller_needs_one_that_reads_it(call, tmp_path):
    words = ("run", "straight_line", *SHORT, "--set", "controllers.ars.limit_deg=2", "-o", "out", "-c", "none")
    told = call(*words)
    assert told.status == 1
    assert (
        "override controllers.ars.limit_deg: has no effect: controller none reads controllers.desired_yaw_rate;"
        in told.err
    )
    assert not list((tmp_path / "out").glob("*"))
    assert call(*words, "-c", "ars").status == 0


def test_maneuver_and_vehicle_may_be_files(call, tmp_path):
    (tmp_path / "roll.toml").write_text('kind = "open_loop"\nspeed_kmh = 30\nduration_s = 0.2\nsettle_s = 0\n')
    shipped = find_vehicle("compact").read_text()
    (tmp_path / "heavy.toml").write_text(shipped + "\n[factors]\nmass = 1.2\n")
    assert call("run", "roll.toml", "--vehicle", "heavy.toml", "-o", "out").status == 0
    recording = Recording.open(tmp_path / "out" / "roll-none.mcap")
    assert recording.metadata["vehicle"]["name"] == "heavy"
    assert recording.metadata["vehicle"]["factors"]["mass"] == 1.2
    assert recording.attachments["vehicle.toml"] == (tmp_path / "heavy.toml").read_bytes()


def test_run_that_is_too_short_to_evaluate_says_so_and_is_kept(call):
    told = call("run", "step_steer", *STEP, "--set", "duration_s=0.5", "-o", "run.mcap")
    assert told.status == 0
    assert "no metrics: the run ends" in told.err
    assert told.out == ""
    recording = Recording.open("run.mcap")
    assert recording.metadata["complete"] is True
    assert recording.metrics == {}
    assert "need at least 2 s" in recording.metadata["metrics_error"]


def test_search_for_the_amplitude_is_the_same_for_all_controllers(call):
    told = call(
        "run", "step_steer", "-c", "none", "-c", "ars", "--set", "settle_s=0.5", "--set", "duration_s=4", "--json"
    )
    none, ars = (Recording.open(run["file"]) for run in told.json["runs"])
    assert np.array_equal(none["steering_wheel_demand_rad"], ars["steering_wheel_demand_rad"])
    assert told.json["runs"][0]["metrics"]["ay_steady_state_mps2"] == pytest.approx(0.4 * 9.81, rel=0.01)


def test_program_starts_from_a_shell_whose_terminal_lacks_letters(tmp_path):
    done = ended(tmp_path, "list", changes={"PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert "Braking in a turn, 80 km/h, 5 m/s?, dry" in done.stdout


def test_plot_is_drawn_beside_the_files(call, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("activesteer.plotting.drawing.DOTS_PER_INCH", 100)
    told = call("run", "step_steer", "-c", "none", "-c", "ars", *EVALUATED, "--plot", "-o", "out")
    assert told.status == 0
    assert (tmp_path / "out" / "step_steer.png").stat().st_size > 10_000
    assert "figure: out/step_steer.png" in told.out
    assert (tmp_path / "out" / "step_steer-models.png").stat().st_size > 10_000


@pytest.mark.parametrize(("environment", "green"), [({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "dumb"}, False)])
def test_verdicts_are_coloured_on_a_terminal_alone(monkeypatch, environment, green):
    for name in ("NO_COLOR", "FORCE_COLOR", "TERM"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    text = "S1 passed: faster\nS2 FAILED: passed by\nS1  not reproduced  slower"
    assert coloured(text) == text
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    shown = text.replace("passed:", "\x1b[32mpassed\x1b[0m:").replace("FAILED", "\x1b[31mFAILED\x1b[0m")
    shown = shown.replace("not reproduced", "\x1b[33mnot reproduced\x1b[0m")
    assert coloured(text) == (shown if green else text)


@pytest.mark.parametrize(
    ("environment", "colours"),
    [
        ({}, False),
        ({"FORCE_COLOR": "1"}, True),
        ({"FORCE_COLOR": "0"}, False),
        ({"FORCE_COLOR": "1", "NO_COLOR": "1"}, False),
    ],
)
def test_a_pipe_has_colours_only_where_they_are_forced(monkeypatch, environment, colours):
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert ("\x1b[" in painted("lost", BAD)) is colours


def test_metrics_that_are_better_than_in_the_first_run_are_green_and_worse_ones_red(monkeypatch):
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("FORCE_COLOR", "1")
    none = {"sideslip_peak_abs_rad": 0.3, "cones_hit": 0.0, "yaw_rate_peak_abs_radps": 0.5}
    ars = {"sideslip_peak_abs_rad": 0.1, "cones_hit": 2.0, "yaw_rate_peak_abs_radps": 0.6}
    runs = {"none": none, "ars": ars}
    table = comparison(runs, partial(run_command._paint, runs))
    assert "\x1b[32m5.730\x1b[0m" in table
    assert "\x1b[31m2\x1b[0m" in table
    assert table.count("\x1b[0m") == 2
    monkeypatch.delenv("FORCE_COLOR")
    assert comparison(runs, partial(run_command._paint, runs)) == comparison(runs)


def test_nothing_is_better_or_worse_next_to_a_run_that_is_lost(monkeypatch, capsys):
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("FORCE_COLOR", "1")
    lost = {"sideslip_peak_abs_rad": 0.8, "cones_hit": 0.0}
    kept = {"sideslip_peak_abs_rad": 0.1, "cones_hit": 2.0}
    better = {"sideslip_peak_abs_rad": 0.05, "cones_hit": 0.0}
    for runs in ({"none": lost, "ars": kept}, {"none": kept, "ars": lost}):
        assert comparison(runs, partial(run_command._paint, runs)) == comparison(runs)
    runs = {"none": kept, "ars": lost, "afs": better}
    assert comparison(runs, partial(run_command._paint, runs)).count("\x1b[32m") == 2
    recordings = {
        name: Recording((), (), np.empty((0, 0)), metrics=found) for name, found in (("none", lost), ("ars", kept))
    }
    run_command._print_outcomes(recordings)
    told = capsys.readouterr().out
    assert "none: \x1b[31mlost with a sideslip angle of 46 deg\x1b[0m" in told
    assert "ars: \x1b[31mhits 2 cones\x1b[0m" in told

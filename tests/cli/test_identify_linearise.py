"""`activesteer identify`, `activesteer linearise` with its loops."""

from __future__ import annotations

import json
import shutil

import pytest

from activesteer.commands.cli import main
from activesteer.resources import find_vehicle


@pytest.fixture
def own_vehicle(tmp_path):
    """Return a copy of the compact's file with another characteristic speed."""
    text = find_vehicle("compact").read_text(encoding="utf-8")
    file = tmp_path / "own.toml"
    before, _, after = text.partition("characteristic_speed_kmh = ")
    file.write_text(before + "characteristic_speed_kmh = 120.0" + after[after.index("\n") :], encoding="utf-8")
    return file


@pytest.mark.slow
def test_identify_writes_the_single_track_model_into_the_vehicle_file(own_vehicle, capsys):
    kept = shutil.copy(own_vehicle, own_vehicle.with_name("kept.toml"))
    assert main(["identify", "--vehicle", str(kept), "--json"]) == 0
    assert kept.read_text(encoding="utf-8") == own_vehicle.read_text(encoding="utf-8")
    found = json.loads(capsys.readouterr().out)["single_track"]
    assert main(["identify", "--vehicle", str(own_vehicle), "--write"]) == 0
    assert "understeer gradient" in capsys.readouterr().out
    written = own_vehicle.read_text(encoding="utf-8")
    assert "120.0" not in written
    assert f"characteristic_speed_kmh = {3.6 * found['characteristic_speed_mps']:.1f}"[:-2] in written
    assert "activesteer identify --vehicle" in written
    assert "[dampers.front]" in written


@pytest.mark.slow
def test_linearise_tells_the_modes_and_draws(tmp_path, capsys):
    assert main(["linearise", "--speed-kmh", "80", "-o", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    for mode in ("bounce", "pitch", "roll", "yaw/sideslip", "wheel hop"):
        assert mode in told
    assert (tmp_path / "bode.png").stat().st_size > 10_000
    assert (tmp_path / "root_locus.png").stat().st_size > 10_000
    assert "wheel hop" in (tmp_path / "modes.html").read_text("utf-8")


def test_linearise_takes_other_values_of_the_car(capsys):
    assert main(["linearise", "--set", "rear_actuator.preset=screw_3deg", "--json"]) == 0
    modes = json.loads(capsys.readouterr().out)["modes"]
    assert any("act_rl_screw" in mode["participation"] for mode in modes)
    assert all(mode["real_1ps"] < 0.0 < mode["natural_frequency_Hz"] for mode in modes)


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["linearise", "--set", "speed_kmh=60"], "manoeuvre"),
        (["linearise", "--set", "driver.preview_s=1"], "driver"),
        (["identify", "--set", "duration_s=50"], "manoeuvre"),
        (["linearise", "--loop", "driver", "-c", "none", "--set", "settle_s=1"], "manoeuvre"),
    ],
)
def test_what_makes_its_manoeuvre_itself_takes_no_override_of_it(capsys, words, part):
    assert main(words) == 1
    assert f"belongs to the {part}, which this command sets" in capsys.readouterr().err


def test_linearise_needs_a_speed(capsys):
    assert main(["linearise", "--speed-kmh", "0"]) == 1
    assert "speed_mps" in capsys.readouterr().err


@pytest.mark.usefixtures("figures")
def test_driver_tells_how_stable_the_loop_is_and_draws(tmp_path, capsys):
    words = ("--driver", "expert", "--speed-kmh", "100", "-c", "afs_tuned", "--json", "-o", str(tmp_path))
    assert main(["linearise", "--loop", "driver", *words]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [(row["speed_kmh"], row["controller"]) for row in rows] == [(100.0, "afs_tuned")]
    for row in rows:
        assert 0.25 < row["damping"] < 1.0
        # In the run the path is not crossed again: there is no swing whose damping could be read.
        assert row["damping_in_run"] == row["damping_in_step"] == 1.0
        assert row["step_difference_m"] < 0.03
        assert 30.0 < row["phase_margin_deg"] < 60.0
        # From the slow end of what is measured of humans to a little beyond the quick one, 4 rad/s.
        assert 1.5 < row["crossover_rad_s"] < 4.5
    assert (tmp_path / "driver.png").exists()
    assert "afs_tuned" in (tmp_path / "driver.html").read_text("utf-8")


def test_driver_that_is_code_has_no_linear_form(tmp_path, capsys):
    (tmp_path / "mine.py").write_text("class Mine:\n    def step(self, setpoint, measurement, motion): ...\n")
    assert main(["linearise", "--loop", "driver", "--driver", f"{tmp_path}/mine.py:Mine"]) == 1
    assert "only a driver file has a linear form" in capsys.readouterr().err

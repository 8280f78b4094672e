"""`activesteer vehicle`: from a table to a driven car."""

from __future__ import annotations

import contextlib
import io
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.commands.cli import main
from activesteer.recording import Recording
from activesteer.resources import models_dir

Call = Callable[..., Any]

TABLES = models_dir() / "tables"


@pytest.fixture(scope="module")
def saloon(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a car from a table."""
    folder = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as told:
        patch.chdir(folder)
        assert main(["vehicle", "new", "saloon", "--table", str(TABLES / "wishbone.csv")]) == 0
    assert "missing values were assumed by rules" in told.getvalue()
    return folder / "vehicles" / "saloon"


def test_from_a_table_to_a_step_steer(call: Call, saloon: Path, tmp_path: Path) -> None:
    file = saloon / "saloon.toml"
    assert file.is_file()

    checked = call("vehicle", "check", saloon)
    assert checked.status == 0
    assert "0 errors, 0 warnings" in checked.out

    driven = call("run", "step_steer", "--vehicle", file, "-c", "none", "-o", "out")
    assert driven.status == 0
    recording = Recording.open(tmp_path / "out" / "step_steer-none.mcap")
    late = recording.time_s > 3.0
    # A left turn at 0.4 g: yaw and acceleration to the left, roll to the right, some degrees; nobody warned or fell.
    assert 0.15 < recording["yaw_rate_radps"][late].mean() < 0.2
    assert 3.7 < recording["ay_mps2"][late].mean() < 4.1
    assert 1.5 < np.degrees(recording["roll_rad"][late].mean()) < 3.0
    assert recording["steering_wheel_rad"][late].mean() > 0.3
    for wheel in ("fl", "fr", "rl", "rr"):
        assert recording[f"{wheel}_tyre_fz_N"].min() > 1000.0
    assert np.isfinite(recording["sideslip_rad"]).all()


def test_new_and_check_as_json_and_their_status(call: Call, tmp_path: Path) -> None:
    made = call("vehicle", "new", "car", "--table", TABLES / "wishbone.csv", "-o", "car", "--json").json
    assert made["vehicle_file"] == "car/car.toml"
    assert {"key", "value", "rule"} == set(made["assumptions"][0])
    axle = tmp_path / "car" / "front_axle.xml"
    text, count = re.subn(r'(fl_tie_rod_outer" pos="\S+) (\S+)', r"\1 -\2", axle.read_text())
    assert count == 1
    axle.write_text(text)
    bad = call("vehicle", "check", "car", "--json")
    assert bad.status == 1
    report = json.loads(bad.out)
    assert report["errors"] >= 2
    assert {"topic", "what", "level", "value", "usual", "advice"} == set(report["findings"][0])


def test_new_says_all_that_is_wrong_with_a_table(call: Call, tmp_path: Path) -> None:
    (tmp_path / "mine.csv").write_text("units, m\nfront.wheel_centre, 0, 762, 297\nfront.strut_topp, 0, 1, 1\n")
    told = call("vehicle", "new", "mine", "--table", "mine.csv")
    assert told.status == 1
    assert "did you mean 'strut_top'" in told.err
    assert "also needs strut_top, strut_bottom, lca_front_inner" in told.err
    assert "mass: either total_kg (of the whole car) or chassis_kg is needed" in told.err
    assert "not in metres" in told.err
    assert not (tmp_path / "vehicles").exists()


def test_keyframe_is_written_anew(call: Call, saloon: Path, tmp_path: Path) -> None:
    file = shutil.copytree(saloon, tmp_path / "saloon") / "keyframes.xml"
    before = file.read_text()
    file.write_text("<mujocoinclude>\n  <keyframe/>\n</mujocoinclude>\n")
    assert call("vehicle", "keyframe", "saloon/saloon.toml").status == 0
    assert file.read_text() == before


def test_shipped_tables_are_listed_and_printed(call: Call) -> None:
    assert call("vehicle", "table").out.split() == ["compact.toml", "wishbone.csv"]
    assert call("vehicle", "table", "wishbone").out == (TABLES / "wishbone.csv").read_text(encoding="utf-8")
    wrong = call("vehicle", "table", "wishbones")
    assert wrong.status == 1
    assert "did you mean 'wishbone'" in wrong.err

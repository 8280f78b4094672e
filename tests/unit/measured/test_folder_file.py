"""The file of a folder of measured runs: units, and one error for each mistake."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import activesteer
from activesteer.errors import ParameterError
from activesteer.measured.comparison import TOLERANCES
from activesteer.measured.folder_file import NAME, read_measured
from tests.raising import raises

EXAMPLE = Path(activesteer.__file__).parent / "measured" / "example"
CIRCLE = """vehicle = "compact"
[circle]
radius_m = 40.0
ay_mps2 = 4.0
steering_wheel_deg = [70.0, 72.0]
spread = { radius_m = 0.2, "load.payload_kg" = 20.0 }
[intervals]
"load.payload_kg" = { ends = [0.0, 150.0], source = "not weighed" }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(EXAMPLE, tmp_path / "mine"))


def changed(folder: Path, old: str, new: str) -> Path:
    text = (folder / NAME).read_text()
    assert old in text
    (folder / NAME).write_text(text.replace(old, new))
    return folder


def test_numbers_are_in_the_unit_of_their_key(folder: Path) -> None:
    mine = "{ noise = 0.2, offset = 0.5, gain = 0.1, source = 'mine' }"
    found = read_measured(changed(folder, "yaw_rate_degps = { noise = 0.2 }", f"yaw_rate_degps = {mine}"))
    assert found.noise == pytest.approx({"yaw_rate_radps": math.radians(0.2), "ay_mps2": 0.1})
    assert found.tolerances["yaw_rate_radps"] == (pytest.approx(math.radians(0.5)), 0.1, "mine")
    assert found.tolerances["ay_mps2"] == TOLERANCES["ay_mps2"]
    assert found.predict_channels == ("yaw_rate_radps",)
    assert [factor.key for factor in found.factors] == ["steering.factor", "factors.front_cornering_stiffness"]


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('vehicle = "compact"', 'vehicle = "compakt"', "vehicle"),
        ('name = "lane_changes"', "", "runs.0.name"),
        ('files = ["run.csv"]', 'files = ["no.csv"]', "runs.0.files"),
        ('files = ["run.csv"]', "files = []", "runs.0.files"),
        ('map = "map.toml"', 'map = "no.toml"', "runs.0.map"),
        ("check_s = [3.0, 6.0]", "check_s = [6.0, 3.0]", "runs.0.check_s"),
        ("check_s = [3.0, 6.0]", "", "runs"),
        ("fit_s = [0.3, 3.0]", "", "runs"),
        ("yaw_rate_degps = {", "yaw_rate_dogps = {", "quantities.yaw_rate_dogps"),
        ("ay_mps2 = {", "ax_mps2 = {", "quantities.ax_mps2"),
        ("ay_mps2 = {", "yaw_rate_radps = {", "quantities.yaw_rate_radps"),
        ('factors = ["steering.factor"]', 'factors = ["steering.facto"]', "predict.factors"),
        ('channels = ["yaw_rate_degps"]', 'channels = ["roll_deg"]', "predict.channels.roll_deg"),
        ('"steering.factor" = {', '"steering.facto" = {', "factors.steering.facto"),
        ("{ uniform = [0.5, 2.0] }", "{ normal = [0.5, 2.0] }", "factors.steering.factor"),
        ("ends = [0.0, 150.0]", "ends = [150.0, 0.0]", "intervals.load.payload_kg"),
        ('"load.payload_kg" =', '"load.payload" =', "intervals.load.payload"),
    ],
)
def test_a_mistake_is_answered_with_its_key(folder: Path, old: str, new: str, key: str) -> None:
    with raises(ParameterError, key=key, file=NAME):
        read_measured(changed(folder, old, new))


def test_of_two_runs_of_one_name_and_of_one_without_a_purpose_none_is_taken(folder: Path) -> None:
    text = (folder / NAME).read_text()
    head, run, rest = text.partition("[[runs]]")
    table, quantities, end = rest.partition("[quantities]")
    (folder / NAME).write_text(head + run + table + run + table + quantities + end)
    with raises(ParameterError, key="runs.1.name"):
        read_measured(folder)
    useless = '[[runs]]\nname = "other"\nfiles = ["run.csv"]\n'
    (folder / NAME).write_text(head + run + table + useless + quantities + end)
    with raises(ParameterError, key="runs.1.check_s"):
        read_measured(folder)


def test_a_circle_varies_from_lap_to_lap_and_within_its_intervals(tmp_path: Path) -> None:
    (tmp_path / NAME).write_text(CIRCLE)
    found = read_measured(tmp_path)
    assert found.nominal == {
        "radius_m": 40.0,
        "ay_mps2": 4.0,
        "zero_deg": 0.0,
        "body_roll": 0.0,
        "load.payload_kg": 0.0,
    }
    lap = found.drawn(found.on_circle, np.array([1.0, -0.5]))
    assert (lap["radius_m"], lap["load.payload_kg"]) == (pytest.approx(40.2), pytest.approx(-10.0))
    # Changes of a lap add to what it differs by from the files.
    heavy = found.changed(lap, {"load.payload_kg": 150.0, "road.mu": 0.8})
    assert (heavy["load.payload_kg"], heavy["road.mu"]) == (pytest.approx(140.0), 0.8)
    interval = found.table.intervals["load.payload_kg"]
    assert (interval.low, interval.high) == ({"load.payload_kg": 0.0}, {"load.payload_kg": 150.0})
    assert replace(found, nominal={}).changed(lap, {"load.payload_kg": 150.0})["load.payload_kg"] == 150.0


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("[70.0, 72.0]", "[70.0, 70.0]", "circle"),
        ('"load.payload_kg" = 20.0', '"road.along" = 20.0', "circle.spread.road.along"),
        ("[intervals]", "[quantities]\nay_mps2 = {}\n[intervals]", "quantities"),
        (
            "ends = [0.0, 150.0]",
            "low = { radius_m = 0.2 }, high = { radius_m = 50.0 }",
            "intervals.load.payload_kg.low.radius_m",
        ),
        ("[circle]", "[predict]\nfactors = []\n[circle]", "predict"),
    ],
)
def test_a_mistake_in_a_circle_is_answered_with_its_key(tmp_path: Path, old: str, new: str, key: str) -> None:
    (tmp_path / NAME).write_text(CIRCLE)
    with raises(ParameterError, key=key):
        read_measured(changed(tmp_path, old, new))

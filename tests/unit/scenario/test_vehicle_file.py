"""Writing values into a table of a vehicle file."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from activesteer.errors import ParameterError
from activesteer.scenario.vehicle_file import write_values
from tests.raising import raises

TEXT = """# A car.
mjcf = "a.xml"

# How it handles.
[single_track]
mass_kg = 1000   # weighed
characteristic_speed_mps = 20.0
cg_to_front_m = 1.1

# The next one.
[driver]
mass_kg = 75  # not ours
"""
VALUES = {"mass_kg": "1234.5", "characteristic_speed_kmh": "80.00", "cg_to_rear_m": "1.5"}


def written(tmp_path: Path, text: str = TEXT, times: int = 1) -> str:
    path = tmp_path / "car.toml"
    path.write_text(text)
    for day in range(1, times + 1):
        write_values(path, "single_track", VALUES, "activesteer identify", f"2026-01-0{day}")
    return path.read_text()


def test_values_are_replaced_and_missing_ones_added(tmp_path):
    table = tomllib.loads(written(tmp_path))["single_track"]
    assert table == {"mass_kg": 1234.5, "characteristic_speed_kmh": 80.0, "cg_to_front_m": 1.1, "cg_to_rear_m": 1.5}


def test_everything_else_stays_with_its_comments(tmp_path):
    text = written(tmp_path)
    assert "mass_kg = 1234.5   # weighed\n" in text
    assert text.startswith(TEXT[: TEXT.index("mass_kg")])
    assert text.endswith(TEXT[TEXT.index("\n# The next one.") :])


def test_command_and_date_stand_beside_the_values_and_only_once(tmp_path):
    text = written(tmp_path, times=2)
    assert "[single_track]\n# Written by `activesteer identify` on 2026-01-02.\n" in text
    assert "2026-01-01" not in text


def test_missing_table_is_added(tmp_path):
    text = written(tmp_path, "a = 1\n", times=2)
    assert tomllib.loads(text)["single_track"]["cg_to_rear_m"] == 1.5
    assert text.count("[single_track]") == 1


def test_table_at_the_end_of_the_file_is_found(tmp_path):
    text = written(tmp_path, "[single_track]\nmass_kg = 1")
    assert tomllib.loads(text)["single_track"]["cg_to_rear_m"] == 1.5


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ('"single_track".mass_kg = 1\n', "[single_track]"),
        ("[single_track\n", None),
        ('[single_track]\nnote = """\nmass_kg = 1\n"""\n', "[single_track]"),
    ],
)
def test_file_that_cannot_be_edited_is_left_alone(tmp_path, text, key):
    path = tmp_path / "car.toml"
    path.write_text(text)
    with raises(ParameterError, key=key):
        write_values(path, "single_track", VALUES, "x", "2026-01-01")
    assert path.read_text() == text


def test_missing_file_is_named(tmp_path):
    with raises(ParameterError, cause=FileNotFoundError):
        write_values(tmp_path / "nowhere.toml", "single_track", VALUES, "x", "2026-01-01")

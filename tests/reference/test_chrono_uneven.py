"""Reference folders with uneven roads: what is understood, and what is an error."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.errors import ParameterError
from tests.reference.chrono.uneven import UnevenRun, uneven_runs

TABLE = {"t": np.array([0.0, 1.0]), "vx": np.array([10.0, 10.0])}


def read(folder: Path, roads: Any, names: tuple[str, ...]) -> list[UnevenRun]:
    (folder / "roads.json").write_text(json.dumps(roads))
    return uneven_runs(folder, ["coast_80"], dict.fromkeys(names, TABLE), 0.1)


def test_a_description_becomes_a_manoeuvre(tmp_path: Path) -> None:
    wave = {"kind": "wave", "start_m": 10, "length_m": 8, "amplitude_m": 0.02, "side": "left"}
    roads = {
        "a": {"speed_kmh": 60, "obstacles": [wave], "steer": {"value": 0.03, "from_s": 0.5, "to_s": 0.6}},
        "b": {"speed_kmh": 60, "bank": {"slope_y": 0.07, "from_m": 5, "to_m": 25}},
    }
    a, b = read(tmp_path, roads, ("a", "b"))
    driven = a.maneuver(20.0)
    assert driven["road"]["obstacle"] == [
        {"kind": "sine_wave", "start_m": 10.1, "length_m": 8.0, "height_m": 0.02, "side": "left"}
    ]
    assert driven["steering"]["rack_m"] == pytest.approx([0.0, 0.0024])
    assert b.maneuver(20.0)["road"]["obstacle"][0]["slope"] == 0.07


@pytest.mark.parametrize(
    ("roads", "names", "problem"),
    [
        ({}, ("stranger",), "neither a run of the reference nor described"),
        ({"a": {"obstacles": [{"kind": "crater", "start_m": 5}]}}, ("a",), "no known kind"),
        ({"a": {"obstacles": [{"kind": "wave", "start_m": "far"}]}}, ("a",), "a number is needed"),
        ({"a": {"snow": 1}}, ("a",), "no meaning for 'snow'"),
        ({"a": {"steer": {"value": "left"}}}, ("a",), "the times of its ramp are needed"),
        ([], ("a",), "no table of runs"),
    ],
)
def test_what_is_not_understood_is_an_error(tmp_path: Path, roads: Any, names: tuple[str, ...], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        read(tmp_path, roads, names)

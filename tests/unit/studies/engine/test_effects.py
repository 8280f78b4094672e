"""Factors that change no metric of any run."""

from __future__ import annotations

import json
from typing import Any

import pytest

from activesteer import study
from activesteer.studies.engine.analysis import without_effect
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.store import Store
from activesteer.studies.engine.study_file import read_study
from tests.unit.studies.short import TIMESTEP_S

MINE = """
from activesteer import ActuatorCommand


class Mine:
    def __init__(self, gain=0.1, unused=1.0):
        self.gain = gain

    def step(self, command, measurement):
        return ActuatorCommand(-self.gain * command.front_steer_demand_rad)
"""
GAIN, UNUSED = "controllers.Mine.gain", "controllers.Mine.unused"


@pytest.fixture
def table(tmp_path) -> dict[str, Any]:
    path = tmp_path / "mine.py"
    path.write_text(MINE)
    short = {"duration_s": 2.6, "settle_s": 0.05, "steer.start_s": 0.05, "steer.steering_wheel_deg": 36.5}
    return {
        "timestep_s": TIMESTEP_S,
        "maneuvers": ["step_steer"],
        "controllers": ["none", f"{path}:Mine"],
        "overrides": short,
    }


@pytest.mark.parametrize("kind", ["grid", pytest.param("uniform", marks=pytest.mark.slow)])
def test_factor_that_changes_no_metric_is_reported(table, tmp_path, kind):
    factors = {GAIN: {kind: [0.0, 0.2]}, UNUSED: {kind: [0.0, 2.0]}}
    design = {"samples": 2, "kind": "random"} if kind == "uniform" else {}
    rows = study({**table, "factors": factors, "design": design}, output=tmp_path / "s", jobs=1)
    assert rows.column("status").to_pylist() == ["ok"] * rows.num_rows
    assert Store(tmp_path / "s", ()).progress().to_json()["without_effect"] == [UNUSED]
    # What the runs had is not driven again to find it.
    assert rows.num_rows == (8 if kind == "grid" else 4)


def test_texts_that_no_sample_combines_are_driven_to_find_it(table, tmp_path):
    factors = {
        "sensors.preset": {"choice": ["ideal", "production"]},
        "rear_actuator.preset": {"choice": ["hinge", "screw_3deg"]},
    }
    design = {"samples": 1, "kind": "random"}
    study({**table, "factors": factors, "design": design}, output=tmp_path / "s", jobs=1)
    assert Store(tmp_path / "s", ()).progress().to_json()["without_effect"] == []


def test_nothing_is_said_of_runs_that_all_failed(table):
    plan = Plan(read_study({**table, "factors": {UNUSED: {"grid": [0.0, 1.0]}}}))
    row = {"status": "failed", "maneuver": "step_steer", "vehicle": "compact", "controller": "none", UNUSED: 0.0}
    assert without_effect(plan, [row]) == []


def test_damaged_note_is_no_note(table, tmp_path):
    store = Store(tmp_path, ())
    for text in ("{", json.dumps({"a": 1}), json.dumps("a")):
        (tmp_path / "without_effect.json").write_text(text)
        assert store.without_effect() == []

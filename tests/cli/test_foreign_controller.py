"""A controller file with three parameters, on a car from hardpoints, through all commands."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from activesteer.resources import models_dir
from tests.cli.conftest import Call

pytestmark = pytest.mark.slow

CODE = """
from activesteer import ActuatorCommand


class YawBeta:
    PARAMETERS = {"k_beta": {"unit": "rad/rad", "range": (0.0, 3.0)}}

    def __init__(self, setup, k_beta=0.8, k_yaw: float = 0.05, limit_rad=0.05):
        self.k_beta, self.k_yaw, self.limit_rad = k_beta, k_yaw, limit_rad
        self.step_s, self.sideslip = setup.timestep_s, 0.0

    def step(self, command, measurement):
        speed = max(measurement.speed_mps, 3.0)
        rate = measurement.ay_mps2 / speed - measurement.yaw_rate_radps
        self.sideslip += self.step_s * (rate - self.sideslip / 0.7)
        angle = self.k_yaw * measurement.yaw_rate_radps - self.k_beta * self.sideslip
        return ActuatorCommand(rear_steer_demand_rad=min(max(angle, -self.limit_rad), self.limit_rad))
"""
STUDY = """
maneuvers = ["step_steer"]
vehicles = ["vehicles/mine/mine.toml"]
controllers = ["none", "rsc.py:YawBeta"]
[factors]
"controllers.YawBeta.k_beta" = { KIND = [0.0, 1.0] }
"controllers.YawBeta.k_yaw" = { KIND = [0.0, 0.1] }
"""
TUNE = """
"controllers.YawBeta.limit_deg" = { uniform = [2.8, 2.9] }
[tune]
trials = 2
[tune.minimise]
overshoot = 'abs(yaw_rate_overshoot("rsc.py:YawBeta"))'
"""


def test_foreign_controller_goes_through_all_commands(call: Call) -> None:
    Path("rsc.py").write_text(CODE)
    given = ("-c", "rsc.py:YawBeta", "--vehicle", "vehicles/mine/mine.toml", "--set", "controllers.YawBeta.k_yaw=0.1")
    assert call("vehicle", "new", "mine", "--table", str(models_dir() / "tables/wishbone.csv")).status == 0

    run = call("run", "sine_with_dwell", *given, "--json").json["runs"][0]
    assert abs(run["metrics"]["yaw_rate_after_1000ms_share"]) < 0.35

    Path("grid.toml").write_text(STUDY.replace("KIND", "grid"))
    found = call("study", "grid.toml", "-o", "grid", "--jobs", "1", "--json").json
    assert found["by_status"] == {"ok": 8}
    assert found["without_effect"] == []
    call("study", "grid", "--report")
    data = re.search(r'id="data">(.*?)</script>', Path("grid/report.html").read_text())
    assert data is not None
    shown = json.loads(data[1])
    assert [(factor["label"], factor["unit"]) for factor in shown["factors"]] == [
        ("YawBeta: k_beta", "rad/rad"), ("YawBeta: k_yaw", ""),
    ]  # fmt: skip
    heat = shown["by_group"][0]["yaw_rate_overshoot"]["heat"]
    assert [axis["key"] for axis in heat["axes"]] == ["controllers.YawBeta.k_beta", "controllers.YawBeta.k_yaw"]
    assert len({value for row in heat["maps"][1] for value in row}) == 4

    Path("tune.toml").write_text(STUDY.replace("KIND", "uniform") + TUNE)
    tuned = call("tune", "tune.toml", "-o", "tune", "--jobs", "1", "--json").json
    assert tuned["without_effect"] == ["controllers.YawBeta.limit_deg"]  # the angle stays below it
    assert set(tuned["front"][0]["values"]) >= {"controllers.YawBeta.k_beta", "controllers.YawBeta.k_yaw"}

    (margins,) = call("linearise", "--loop", "controller", *given, "--speed-kmh", "100", "--json").json
    assert margins["disk_margin"] > 0.5
    verdict = call("test", "fmvss126", *given, "--jobs", "1", "--json")
    assert verdict.status == 0, json.dumps(verdict.json)[:300]

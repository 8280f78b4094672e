"""Falsification: a known violation is found, a requirement that holds is not violated, and a search resumes."""

from __future__ import annotations

import json
import math
import shlex
from pathlib import Path

import pytest

from activesteer.cli import main
from activesteer.config import Source
from activesteer.errors import ActiveSteerError, StudyError
from activesteer.studies.engine.requirement import Requirement
from activesteer.studies.falsification import falsify
from tests.raising import raises
from tests.unit.studies.short import MANEUVER, RATIO, write_controller

REQUIREMENT = {
    "maneuvers": [MANEUVER],
    "controllers": ["none"],
    "factors": {"maneuver.steer.steering_wheel_deg": {"uniform": [5.0, 30.0]}},
    "falsify": {"requirement": "abs(ay_steady_state_mps2(controller)) <= 2.5", "runs": 14},
}


def requirement(text: str) -> Requirement:
    return Requirement(text, Source("test", error=StudyError), ("falsify", "requirement"))


def test_robustness_is_the_margin_to_the_limit():
    text = "max(0, lane_overstep_m(lqr)) - max(0, lane_overstep_m(none)) <= 0.05"
    rows = {"lqr": {"lane_overstep_m": 2.45}, "none": {"lane_overstep_m": 0.12}}
    assert requirement(text).robustness(rows, "lqr") == pytest.approx(0.05 - 2.33)
    assert requirement(text).controllers == ["lqr", "none"]
    inside = {"lqr": {"lane_overstep_m": -0.4}, "none": {"lane_overstep_m": -0.9}}
    assert requirement(text).robustness(inside, "lqr") == pytest.approx(0.05)
    assert requirement("lateral_displacement_m(controller) >= 2 * 0.9").robustness(
        {"x": {"lateral_displacement_m": 2.0}}, "x"
    ) == pytest.approx(0.2)


def test_a_run_that_defines_no_metric_is_as_bad_as_can_be():
    nothing = {"lqr": {"lane_overstep_m": None}, "none": {"lane_overstep_m": 0.1}}
    assert requirement("lane_overstep_m(lqr) <= 0.1").robustness(nothing, "lqr") == -math.inf
    assert requirement("mean_deceleration_mps2(lqr) >= 3").robustness(nothing, "lqr") == -math.inf
    neither = {"lqr": {}, "none": {}}
    assert math.isnan(requirement("lane_overstep_m(lqr) - lane_overstep_m(none) <= 0").robustness(neither, "lqr"))


def test_harm_is_the_growth_in_multiples_of_its_size():
    lane = {"lane_overstep_m": 0.1, "cones_hit": 1.0, "sideslip_peak_abs_rad": 0.1}
    rows = {"none": lane, "lqr": lane | {"lane_overstep_m": 0.2}}
    assert requirement("harm(controller) <= 1").robustness(rows, "lqr") == pytest.approx(-1.0)


@pytest.mark.parametrize(
    "text",
    [
        "1 <= 2", "lane_overstep_m(lqr)", "lane_overstep(lqr) <= 0", "__import__('os') <= 0",
        "lane_overstep_m.x(lqr) <= 0", "lane_overstep_m(lqr) < 1",
        "max(1) <= lane_overstep_m(lqr)", "(" * 900, "0 <= lane_overstep_m(lqr) <= 1", "9" * 2000,
        "[lane_overstep_m(lqr)][0] <= 1", "True <= lane_overstep_m(lqr)",
    ],
)  # fmt: skip
def test_a_text_that_is_no_requirement_is_refused(text: str):
    with raises(StudyError, key="falsify.requirement"):
        requirement(text)


def test_a_violation_is_found_with_the_command_that_repeats_it(tmp_path: Path):
    [found] = falsify(REQUIREMENT, tmp_path, jobs=1)
    assert found.violated
    assert found.runs == 14
    worst_deg = found.values["maneuver.steer.steering_wheel_deg"]
    assert worst_deg == max(values["maneuver.steer.steering_wheel_deg"] for values, _ in found.sets)
    falls = [value for _, value in found.fall]
    assert falls == sorted(falls, reverse=True)
    assert falls[-1] == found.robustness < 0.0
    words = shlex.split(found.commands["none"])
    assert words == [
        "activesteer",
        "run",
        "short",
        "-c",
        "none",
        "--set",
        f"maneuver.steer.steering_wheel_deg={worst_deg}",
    ]


def test_a_search_resumes_and_another_is_refused(tmp_path: Path):
    [first] = falsify(REQUIREMENT, tmp_path, jobs=1, runs=3)
    [second] = falsify(REQUIREMENT, tmp_path, jobs=1, runs=5)
    assert (first.runs, second.runs) == (3, 5)
    assert second.sets[:3] == first.sets
    other = {**REQUIREMENT, "falsify": {"requirement": "abs(ay_steady_state_mps2(controller)) <= 3"}}
    with raises(StudyError, value=tmp_path / "none-short"):
        falsify(other, tmp_path, jobs=1)


def test_a_run_that_fails_with_the_controller_alone_violates(tmp_path: Path):
    path = write_controller(tmp_path, 0.9)
    table = {**REQUIREMENT, "factors": {RATIO: {"choice": [0.8, 0.9]}}}
    table["falsify"] = {"requirement": "abs(ay_steady_state_mps2(controller)) - abs(ay_steady_state_mps2(none)) <= 0.1"}
    [found] = falsify(table, tmp_path / "f", jobs=1, controllers=[f"{path}:Fails"], runs=8)
    assert found.values == {RATIO: 0.9}
    assert found.violated
    assert found.controller == "bad.py:Fails"


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"sampler": "tpf"}, "falsify.sampler"),
        ({"requirement": "lane_overstep_m(controller) <= 0"}, "falsify.requirement"),
        ({"runz": 3}, "falsify.runz"),
    ],
)
def test_a_wrong_table_is_named(tmp_path: Path, change: dict[str, object], key: str):
    with raises(ActiveSteerError, key=key):
        falsify({**REQUIREMENT, "falsify": {**REQUIREMENT["falsify"], **change}}, tmp_path, jobs=1, runs=2)


@pytest.mark.slow
def test_command_says_what_it_found_and_fails_on_a_violation(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "r.toml"
    table = "\n".join(f"{key} = {json.dumps(value)}" for key, value in MANEUVER.items() if key != "steer")
    (tmp_path / "short.toml").write_text(table + "\n[steer]\nstart_s = 0.05\nsteering_wheel_deg = 20.0\n")
    head = 'maneuvers = ["short.toml"]\n[factors]\n"maneuver.steer.steering_wheel_deg" = { uniform = [5.0, 30.0] }\n'
    file.write_text(f'{head}[falsify]\nrequirement = "ay_steady_state_mps2(controller) <= 2.5"\nruns = 12\n')
    arguments = ["falsify", str(file), "-o", str(tmp_path / "found"), "--jobs", "1"]
    assert main(arguments) == 1
    text = capsys.readouterr().out
    assert "VIOLATED" in text
    assert "activesteer run" in text
    assert (tmp_path / "found" / "none-short" / "violations.png").stat().st_size > 10_000
    assert main([*arguments, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["violated"]
    file.write_text(file.read_text().replace("<= 2.5", "<= 50"))
    assert main([*arguments[:-3], str(tmp_path / "other"), "--jobs", "1"]) == 0

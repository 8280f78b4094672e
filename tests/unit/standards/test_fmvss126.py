"""FMVSS 126: amplitudes of the series, limits, and the verdict on runs with known results."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import pytest

from activesteer.core.files import json_text
from activesteer.errors import ManeuverError, ModelError
from activesteer.pages import render_page
from activesteer.standards import fmvss126
from activesteer.standards.examination import EXAMINED_BY, examination_page, examine
from activesteer.standards.fmvss126 import amplitudes, verdict
from activesteer.standards.standard import Findings, StandardRunner
from tests.raising import raises
from tests.unit.standards.runners import PrescribedRunner

GOOD = {"factor": 5.0, "yaw_ratio_1s": 0.35, "yaw_ratio_175s": -0.2, "displacement_m": 1.83}


def driven(series: str, case: Mapping[str, Any], spins_from_deg: float = 1e3) -> dict[str, float]:
    if series == "slowly_increasing_steer":
        # A car that needs 29 deg to the left and 31 deg to the right: A is 30 deg.
        left = case["steer.rate_degps"] > 0.0
        return {"steering_wheel_at_0_3g_rad": math.radians(29.02 if left else -31.02)}
    spins = case["steer.steering_wheel_deg"] >= spins_from_deg and case["steer.direction"] == "right"
    return {
        "yaw_rate_after_1000ms_share": 0.8 if spins else 0.1,
        "yaw_rate_after_1750ms_share": 0.7 if spins else 0.0,
        "lateral_displacement_by_ay_m": 2.0,
        "lateral_displacement_m": 1.9,
    }


@pytest.mark.parametrize(
    ("a_deg", "count", "last"),
    [
        (30.0, 16, (9.0, 270.0)),  # 6.5 A is 195 deg, so that the series goes on to 270 deg
        (28.1, 18, (270.0 / 28.1, 270.0)),
        (45.0, 11, (6.5, 292.5)),
        (50.0, 10, (6.0, 300.0)),  # 6.5 A would be 325 deg
    ],
)
def test_series_goes_from_1_5_a_by_0_5_a_to_the_last_amplitude(a_deg, count, last):
    found = amplitudes(a_deg)
    assert found[0] == (1.5, 1.5 * a_deg)
    assert found[1][0] == 2.0
    assert len(found) == count
    assert found[-1] == pytest.approx(last)
    assert all(a[1] < b[1] for a, b in pairwise(found))


def test_limits_themselves_are_allowed():
    assert verdict(GOOD, 1.83) == []


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"yaw_ratio_1s": 0.351}, "1.00 s"),
        ({"yaw_ratio_175s": 0.201}, "1.75 s"),
        ({"yaw_ratio_175s": -0.21}, "1.75 s"),
        ({"displacement_m": 1.82}, "displacement"),
        ({"yaw_ratio_1s": math.nan}, "1.00 s"),
    ],
)
def test_what_breaks_a_limit_is_named(change, word):
    [found] = verdict(GOOD | change, 1.83)
    assert word in found


def test_displacement_counts_from_5_a_on():
    assert verdict(GOOD | {"factor": 4.5, "displacement_m": 1.0}, 1.83) == []


def test_a_car_that_keeps_the_limits_passes():
    runner = PrescribedRunner(driven)
    found = fmvss126.examine(runner)
    assert found.passed is True
    assert found.values["A_deg"] == 30.0
    assert len(found.values["series"]) == 32
    assert [case["steer.rate_degps"] for case in runner.asked["slowly_increasing_steer"]] == [13.5] * 3 + [-13.5] * 3
    assert set(found.values["series"][0]) >= {
        "direction", "amplitude_deg", "factor", "yaw_ratio_1s", "yaw_ratio_175s", "displacement_m", "pass",
    }  # fmt: skip


def test_a_car_that_spins_to_one_side_fails_and_the_first_amplitude_is_named():
    found = fmvss126.examine(PrescribedRunner(lambda series, case: driven(series, case, spins_from_deg=164.0)))
    assert found.passed is False
    assert "first at 5.5 A (165 deg), right first: yaw rate 80 %" in found.summary
    assert [row["pass"] for row in found.values["series"]].count(False) == 8


def test_a_run_in_which_the_car_tips_over_is_a_row_that_fails():
    def tips(series: str, case: Mapping[str, Any]) -> Mapping[str, float] | str:
        over = case.get("steer.steering_wheel_deg", 0.0) > 260.0
        return "the car tips over" if over else driven(series, case)

    found = fmvss126.examine(PrescribedRunner(tips))
    assert found.passed is False
    assert [row["amplitude_deg"] for row in found.values["series"] if not row["pass"]] == [270.0, 270.0]
    assert "no result: the car tips over" in found.summary
    assert found.tables[1].rows[-1][-1] == "fail the car tips over"
    assert json.loads(json_text(found.values))["series"][-1]["yaw_ratio_1s"] is None


def test_a_controller_with_which_the_car_cannot_be_tested_does_not_stop_the_others(monkeypatch):
    def examined(runner: StandardRunner) -> Findings:
        good = runner.controller == "afs"
        return fmvss126.examine(PrescribedRunner(driven if good else lambda *_: "it spins"))

    monkeypatch.setitem(EXAMINED_BY, "fmvss126", examined)
    result = examine("fmvss126", ["ars", "afs"], jobs=1)
    assert result.failed == ["ars"]
    assert "A: " in result.findings["ars"].values["error"]
    assert "it spins" in result.findings["ars"].values["error"]
    assert result.findings["afs"].passed is True
    assert ">no result<" in render_page(examination_page(result))


def test_a_car_that_cannot_be_built_is_an_error_and_not_a_missing_result():
    with pytest.raises(ModelError, match="no toe link for a screw"):
        examine("fmvss126", vehicle="tesla_model_s", overrides={"rear_actuator.preset": "screw_3deg"}, jobs=1)


def test_noisy_sensors_are_drawn_anew_for_each_repetition():
    runner = PrescribedRunner(driven, changed={"sensors.preset": "production"})
    fmvss126.examine(runner)
    assert [case["sensors.seed"] for case in runner.asked["slowly_increasing_steer"]] == [0, 1, 2, 0, 1, 2]


def test_a_car_that_does_not_get_to_0_375_g_has_no_a():
    with raises(ManeuverError, key="A"):
        fmvss126.examine(PrescribedRunner(lambda *_: {"steering_wheel_at_0_3g_rad": math.nan}))


def test_the_compact_keeps_the_limits_at_3_a_and_not_without_control_at_6_5_a(monkeypatch, tmp_path):
    monkeypatch.setattr(fmvss126, "amplitudes", lambda a_deg: [(3.0, 3.0 * a_deg), (6.5, 6.5 * a_deg)])
    result = examine("fmvss126", output=tmp_path, jobs=1)
    found = result.findings["none"]
    assert found.values["A_deg"] == pytest.approx(28.1, abs=1.0)
    rows = {(row["direction"], row["factor"]): row for row in found.values["series"]}
    assert rows["left", 3.0]["pass"]
    assert not rows["left", 6.5]["pass"]
    assert rows["left", 6.5]["displacement_m"] == pytest.approx(
        rows["left", 6.5]["displacement_of_position_m"], rel=0.1
    )
    # The car is its own mirror image.
    for factor in (3.0, 6.5):
        assert rows["right", factor]["displacement_m"] == pytest.approx(
            rows["left", factor]["displacement_m"], rel=1e-4
        )
    assert result.failed == ["none"]

    # What is there is not driven again.
    def never(*_: Any) -> Any:
        raise AssertionError

    monkeypatch.setattr("activesteer.studies.engine.study.drive", never)
    assert examine("fmvss126", output=tmp_path, jobs=1).to_json() == result.to_json()

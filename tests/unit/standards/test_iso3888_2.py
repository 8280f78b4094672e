"""ISO 3888-2: the search for the highest clean entry speed, and the place of throttle release."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from activesteer.scenario import resolve
from activesteer.standards import iso3888_2
from activesteer.standards.examination import examine
from activesteer.standards.iso3888_2 import COARSE_KMH, best_run, highest_clean
from activesteer.standards.standard import StandardRun
from tests.unit.standards.runners import PrescribedRunner


@pytest.mark.parametrize(("limit", "found"), [(54.0, 54.0), (54.9, 54.0), (55.0, 55.0), (100.0, 80.0), (20.0, None)])
def test_search_finds_the_limit_of_a_car_whose_limit_is_known(limit, found):
    tried: list[str] = []

    def attempt(series: str, speeds: Sequence[float]) -> list[bool]:
        tried.append(series)
        return [speed <= limit for speed in speeds]

    assert highest_clean(attempt) == found
    assert tried == (["coarse", "fine"] if found not in (None, COARSE_KMH[-1]) else ["coarse"])


def test_a_faster_clean_run_counts_although_a_slower_one_is_not_clean():
    assert highest_clean(lambda _, speeds: [speed in (40.0, 50.0, 52.0) for speed in speeds]) == 52.0


def test_one_clean_line_is_enough_and_a_car_that_tips_over_is_a_row():
    """Clean up to 52 km/h and only with a margin of 0.15 m; at 80 km/h the car rolls over."""

    def driven(_: str, case: Mapping[str, Any]) -> Mapping[str, float] | str:
        if case["speed_kmh"] == 80.0:
            return "the car tips over"
        clean = case["speed_kmh"] <= 52.0 and case["lane.margin_m"] == 0.15
        return {"stays_in_lanes": float(clean), "cones_hit": 0.0 if clean else 1.0, "lane_overstep_m": -0.1 * clean}

    runner = PrescribedRunner(driven)
    # Without channels there is nothing to draw.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(iso3888_2, "_pictures", lambda *_: [])
        found = iso3888_2.examine(runner)
    assert found.values["entry_speed_kmh"] == {"left": 52.0, "right": 52.0}
    assert [case["speed_kmh"] for case in runner.asked["left_fine"][::3]] == [51.0, 52.0, 53.0, 54.0]
    tipped = [row for row in found.values["runs"] if row["speed_kmh"] == 80.0]
    assert len(tipped) == 6
    assert all(row["error"] == "the car tips over" and not row["clean"] for row in tipped)
    table = found.tables[0]
    rows = {(row[0], row[1]): row for row in table.rows}
    assert rows["left", "50"][2:] == ("0.000, 1 cone", "-0.100", "0.000, 1 cone", "-", "clean")
    assert rows["right", "80"][2:5] == ("the car tips over",) * 3
    assert {row[1] for index, row in enumerate(table.rows) if index not in table.outside} == {
        "35", "40", "45", "50", "51", "52",
    }  # fmt: skip


def test_the_run_that_is_shown_is_clean_where_there_is_one():
    def run(speed_kmh: float, overstep_m: float, error: str = "") -> StandardRun:
        return StandardRun({"speed_kmh": speed_kmh}, {"lane_overstep_m": overstep_m}, {}, error)

    roomy, narrow, wide = run(50.0, -0.2), run(54.0, -0.01), run(54.0, 0.3)
    assert best_run([roomy, narrow, wide], 54.0) is narrow
    assert best_run([wide, run(35.0, 0.1, "it diverged"), narrow], None) is narrow
    assert best_run([run(35.0, 0.1, "it diverged")], None) is None


@pytest.mark.parametrize("side", ["left", "right"])
def test_throttle_is_released_two_metres_into_the_entry_lane(side):
    changes = {"lane.throttle_off_m": 2.0, "lane.side": side, "speed_kmh": 36.0}
    maneuver = resolve("severe_lane_change", overrides=changes).maneuver
    off_s = (30.0 + 2.0) / 10.0
    assert maneuver.setpoint(off_s - 1e-6).hold_speed
    assert not maneuver.setpoint(off_s + 1e-6).hold_speed
    assert maneuver.setpoint(off_s + 1e-6).path is maneuver.setpoint(0.0).path
    assert resolve("severe_lane_change").maneuver.setpoint(off_s + 1e-6).hold_speed


@pytest.mark.slow
def test_the_compact_gets_through_at_50_and_not_at_65_kmh(monkeypatch):
    monkeypatch.setattr(iso3888_2, "COARSE_KMH", (50.0, 65.0))
    monkeypatch.setattr(iso3888_2, "FINE_KMH", 5.0)
    monkeypatch.setattr(iso3888_2, "MARGINS_M", (0.1,))
    result = examine("iso3888-2", jobs=1)
    assert result.driver == "expert"
    found = result.findings["none"]
    assert found.passed is None
    assert "pass" not in found.values
    runs = {(run["direction"], run["speed_kmh"]): run for run in found.values["runs"]}
    assert runs["left", 50.0]["clean"]
    assert not runs["left", 65.0]["clean"]
    assert runs["left", 50.0]["speed_end_mps"] < 50.0 / 3.6
    assert found.values["entry_speed_kmh"]["left"] == found.values["entry_speed_kmh"]["right"]

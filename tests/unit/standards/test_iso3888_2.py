"""ISO 3888-2: the search for the highest clean entry speed, and where the throttle is released."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from activesteer.scenario import resolve
from activesteer.standards import iso3888_2
from activesteer.standards.examination import examine
from activesteer.standards.iso3888_2 import COARSE_KMH, highest_clean


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


@pytest.mark.parametrize("side", ["left", "right"])
def test_throttle_is_released_two_metres_into_the_entry_lane(side):
    changes = {"lane.throttle_off_m": 2.0, "lane.side": side, "speed_kmh": 36.0}
    maneuver = resolve("severe_lane_change", overrides=changes).maneuver
    off_s = (30.0 + 2.0) / 10.0
    assert maneuver.reference(off_s - 1e-6).hold_speed
    assert not maneuver.reference(off_s + 1e-6).hold_speed
    assert maneuver.reference(off_s + 1e-6).path is maneuver.reference(0.0).path
    assert resolve("severe_lane_change").maneuver.reference(off_s + 1e-6).hold_speed


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

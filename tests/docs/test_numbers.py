"""Numbers in the README and the guide are those of stored results, or of the page that derives them."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any, Final

import pytest

from activesteer.core.metric_table import recorded_metric
from tools.baseline import BASELINE

ROOT: Final = Path(__file__).parents[2]
README: Final = (ROOT / "README.md").read_text("utf-8")
STORED: Final[dict[str, dict[str, dict[str, float]]]] = json.loads(BASELINE.read_text("utf-8"))
SYSTEMS: Final = ("none", "ars", "afs")


def guide(name: str) -> str:
    return (ROOT / "docs" / name).read_text("utf-8")


def cells(text: str, head: str) -> list[str]:
    """Return the cells after the first of the first table row whose first cell starts with a text."""
    (row, *_) = [line for line in text.splitlines() if line.startswith(f"| {head}")]
    return [cell.strip(" *") for cell in row.strip("| ").split("|")][1:]


def has_the_digits_of(text: str, value: float) -> bool:
    """Return whether a number with its digits is the value, rounded."""
    return text == f"{value:.{len(text.partition('.')[2])}f}"


@pytest.mark.parametrize(
    ("head", "maneuver"),
    [
        ("sine with dwell, 5 A", "sine_with_dwell"),
        ("slalom, 100 km/h", "slalom"),
        ("double lane change, 80 km/h", "double_lane_change"),
        ("slippery double lane change, 80 km/h", "double_lane_change_low_mu"),
    ],
)
def test_peaks_of_the_sideslip_angle_in_the_guide_are_the_stored_ones(head: str, maneuver: str) -> None:
    peaks = [math.degrees(STORED[maneuver][system]["sideslip_peak_abs_rad"]) for system in SYSTEMS]
    shown = cells(guide("claims.md"), head)
    assert all(map(has_the_digits_of, shown, peaks)), (shown, peaks)


def test_claims_are_counted_in_words_as_in_the_table() -> None:
    text = guide("claims.md")
    every, paper, literature, ideal, production = cells(text.partition("| scenario | the paper")[2], "all |")
    words = " ".join(text.split())
    assert f"{paper} of the {every} claims hold at the same time" in words
    assert f"from the literature, {literature} are reproduced" in words
    shares = f"{ideal} of the claims hold on average with ideal sensors, and {production} with production sensors"
    assert shares in words
    assert f"With a driver from the literature, {literature} of {every} hold." in README
    assert f"In one setting, found by a search for as many claims as possible, {paper} of them hold." in README


def test_the_measured_circle_has_the_same_numbers_on_all_pages() -> None:
    text = guide("measured_cars.md")
    about = cells(guide("validation.md"), "`tesla_model_s`")[-1]
    for head in ("measured", "predicted, measured K&C only"):
        angle_deg = cells(text, f"{head} |")[0].partition(" ")[0]
        assert f"{angle_deg} deg" in about
        assert f"{angle_deg} deg" in README
    assert f"the probability box of the remaining uncertainty is {cells(text, '**probability box**')[0]} deg" in about


def test_the_scorecard_in_the_guide_has_the_stored_numbers() -> None:
    shown = re.search(r"largest sideslip angle: none ([\d.]+)  ars ([\d.]+) deg", guide("claims.md"))
    assert shown is not None
    for system, text in zip(SYSTEMS, shown.groups(), strict=False):
        assert has_the_digits_of(text, math.degrees(STORED["sine_with_dwell"][system]["sideslip_peak_abs_rad"]))


def test_the_example_of_a_controller_has_the_stored_numbers_next_to_its_own() -> None:
    text = guide("controller.md")
    found: dict[str, list[str]] = {}
    for maneuver, part in zip(("step_steer", "sine_with_dwell"), text.split("$ activesteer run ")[1:], strict=False):
        assert part.startswith(maneuver)
        stored: dict[str, Any] = STORED[maneuver]
        for name in stored["none"]:
            metric = recorded_metric(name)
            if row := re.search(rf"^{re.escape(metric.label)} +\S+ +([-\d. ]+)$", part, re.MULTILINE):
                found[name] = row[1].split()
                for system, number in zip(SYSTEMS[:2], found[name], strict=False):
                    value = stored[system][name] * metric.unit.factor
                    assert float(number) == pytest.approx(value, rel=1e-4, abs=1e-3), name
    assert len(found) >= 5
    gain = re.search(r"gain_s=([\d.]+)", text)
    assert gain is not None
    (time_s, left) = cells(text, f"{gain[1]} |")
    assert has_the_digits_of(time_s, float(found["yaw_rate_response_time_s"][2]))
    assert has_the_digits_of(left, float(found["yaw_rate_after_1000ms_share"][2]))

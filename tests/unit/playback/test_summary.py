"""The text beside the pictures."""

from __future__ import annotations

from activesteer.playback import runs_of
from activesteer.playback.viewer import summary
from tests.unit.playback.synthetic import circle


def test_scenario_systems_and_metrics_side_by_side() -> None:
    one = circle(0.1, {"vehicle": {"name": "compact"}, "overrides": {"road.mu": 0.4}}, controller="none")
    other = circle(0.1)
    other.metrics["only_here_s"] = 1.5
    text = summary(runs_of({"ars": other, "none": one}))
    lines = text.splitlines()
    assert lines[0] == "**A circle**"
    assert text.count("A circle") == 1
    assert "- **1 no control**: controller none, vehicle compact, activesteer ?, road.mu = 0.4" in lines
    assert "| metric | none | ars |" in lines
    assert "| peak yaw rate [deg/s] | 11.459 | 11.459 |" in lines
    assert "| lag_s | - | - |" in lines  # not defined
    assert "| only_here_s |  | 1.500 |" in lines


def test_an_incomplete_run_says_so() -> None:
    run = circle(0.1, {"complete": False, "error": "SimulationDiverged: boom"})
    assert "**Incomplete**: SimulationDiverged: boom" in summary(runs_of({"ars": run}))


def test_what_came_out_stands_above_the_numbers() -> None:
    text = summary(runs_of({"ars": circle(0.1)}), ["ars: stays in the lanes", "S1 passed: something"])
    lines = text.splitlines()
    assert lines[2:4] == ["- **ars:** stays in the lanes", "- **S1 passed:** something"]
    assert text.index("stays in the lanes") < text.index("| metric |")

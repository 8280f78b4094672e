"""Controllers side by side: every run in a file of its own, every metric in the table, a picture of some."""

from __future__ import annotations

import json

import pytest

from activesteer.cli import main
from activesteer.controllers import find_controller
from activesteer.errors import ParameterError
from activesteer.recording import Recording
from activesteer.studies import comparison
from activesteer.studies.comparison import CASES, SHOWN, compare


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(comparison, "CASES", {"step_steer_120_kmh": CASES["step_steer_120_kmh"]})


def test_table_has_the_metrics_of_every_recording(few, tmp_path, capsys):
    arguments = ["--controllers", "none,esc", "--jobs", "1", "--figures", "-o", str(tmp_path), "--json"]
    assert main(["reproduce", *arguments]) == 0
    made = json.loads(capsys.readouterr().out)
    assert {row["controller"] for row in made["table"]} == {"none", "esc"}
    for name in ("none", "esc"):
        recording = Recording.open(tmp_path / f"step_steer_120_kmh-{name}.mcap")
        assert recording.metadata["vehicle"]["sensors"]["preset"] == "production"
        told = {row["metric"]: row["value"] for row in made["table"] if row["controller"] == name}
        assert set(told) == set(recording.metrics)
        assert told["yaw_rate_peak_radps"] == pytest.approx(recording.metrics["yaw_rate_peak_radps"])
    assert (tmp_path / "comparison.png").stat().st_size > 10_000


def test_two_of_the_same_name_are_refused(tmp_path):
    with pytest.raises(ParameterError, match="called the same"):
        compare(["none", "none"], tmp_path)


def test_every_scenario_has_metrics_to_show():
    assert set(SHOWN) == set(CASES)


def test_controllers_and_population_do_not_go_together(capsys):
    assert main(["reproduce", "--controllers", "none", "--population", "4"]) == 1
    assert "--population" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["ars_sideslip", "lqr", "esc", "integrated", "mpc"])
def test_controllers_of_the_package_are_found_by_name(name):
    assert find_controller(name).label == name

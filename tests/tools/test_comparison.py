"""Comparison of controllers: a file for each run, all metrics in the table, a picture of some."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.errors import ParameterError
from activesteer.recording import Recording
from tests.raising import raises
from tools import comparison
from tools.comparison import CASES, SHOWN, Comparison, Row, compare, comparison_figure


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(comparison, "CASES", {"step_steer_120_kmh": CASES["step_steer_120_kmh"]})


def test_table_has_the_metrics_of_every_recording(few, tmp_path):
    made = compare(["none", "esc"], tmp_path, jobs=1)
    assert {row.controller for row in made.rows} == {"none", "esc"}
    for name in ("none", "esc"):
        recording = Recording.open(tmp_path / f"step_steer_120_kmh-{name}.mcap")
        assert recording.metadata["vehicle"]["sensors"]["preset"] == "production"
        told = {row.metric: row.value for row in made.rows if row.controller == name}
        assert set(told) == set(recording.metrics)
        assert told["yaw_rate_peak_radps"] == pytest.approx(recording.metrics["yaw_rate_peak_radps"])


def test_two_of_the_same_name_are_refused(tmp_path):
    with raises(ParameterError, value=("none", "none")):
        compare(["none", "none"], tmp_path)


def test_every_scenario_has_metrics_to_show():
    assert set(SHOWN) == set(CASES)


def made_up(**values: tuple[float, float, float]) -> Comparison:
    """Controllers with overshoot of a step, amplitude of a slalom, and entry speed."""
    places = [
        ("step_steer", "yaw_rate_overshoot"),
        ("slalom", "track_amplitude_m"),
        ("severe_lane_change", "entry_speed_mps"),
    ]
    rows = [
        Row(scenario, name, metric, number)
        for name, numbers in values.items()
        for (scenario, metric), number in zip(places, numbers, strict=True)
    ]
    return Comparison(tuple(values), rows)


def test_targets_are_for_those_beyond_the_paper_and_bounds_are_kept_as_they_are_said():
    made = made_up(none=(0.1, 2.2, 14.0), ars=(0.2, 2.0, 20.0), lqr=(0.03, 2.2, 14.0), tv=(0.031, 2.1, 14.5))
    assert {target.controller for target in made.targets} == {"lqr", "tv"}
    passed = {name: [target.passed for target in made.targets if target.controller == name] for name in ("lqr", "tv")}
    assert passed["lqr"] == [True, False, False]  # as large as without control is not below, and as fast not faster
    assert passed["tv"] == [False, True, True]
    assert "FAILED  slalom: track amplitude 2.2 m, asked for < 2.2 m (none)" in made.to_text()


def test_colours_say_what_is_better_whatever_the_direction_of_the_metric():
    better, worse, same = (
        made_up(none=(0.1, 2.2, 14.0), lqr=numbers)
        for numbers in ((0.05, 2.0, 15.0), (0.2, 2.5, 13.0), (0.1, 2.2001, 14.0))
    )
    for made, sign in ((better, 1.0), (worse, -1.0), (same, 0.0)):
        shades = np.asarray(comparison_figure(made).axes[0].images[0].get_array())
        assert (shades[:, 0] == 0.0).all()
        assert (np.sign(shades[:, 1]) == sign).all()


def test_a_run_without_the_metric_fails_its_target():
    made = made_up(none=(0.1, math.nan, 14.0), lqr=(0.01, 2.1, math.nan))
    assert [target.passed for target in made.targets] == [True, False, False]
    assert "entry speed - km/h, asked for > 50.4 km/h (none)" in made.to_text()

"""The table of metrics: units for reading, one column a run."""

from __future__ import annotations

import math

import pytest

from activesteer.analysis import step_response
from activesteer.analysis.tables import comparison, label_and_unit
from tests.unit.analysis.made_up import step_steer


@pytest.mark.parametrize(
    ("name", "words", "unit", "shown_for_one"),
    [
        ("yaw_rate_peak_radps", "yaw rate peak", "deg/s", 180.0 / math.pi),
        ("roll_peak_rad", "roll peak", "deg", 180.0 / math.pi),
        ("tb_srad", "TB", "s deg", 180.0 / math.pi),
        ("ay_steady_state_mps2", "lateral acceleration steady state", "m/s2", 1.0),
        ("speed_end_mps", "speed end", "km/h", 3.6),
        ("yaw_rate_response_time_s", "yaw rate response time", "s", 1.0),
        ("ay_overshoot", "lateral acceleration overshoot", "%", 100.0),
        ("friction_used_max", "friction used max", "-", 1.0),
        ("yaw_rate_after_1000ms_share", "yaw rate after 1000ms share", "%", 100.0),
        ("lane_overstep_m", "lane overstep", "m", 1.0),
        ("steering_wheel_rate_rms_radps", "steering wheel rate rms", "deg/s", 180.0 / math.pi),
    ],
)
def test_names_become_words_and_display_units(name, words, unit, shown_for_one):
    assert label_and_unit(name) == (words, unit, pytest.approx(shown_for_one))


def test_values_stand_under_their_run():
    text = comparison({"none": {"roll_peak_rad": math.radians(2.0)}, "ars": {"roll_peak_rad": math.radians(-1.5)}})
    head, row = text.splitlines()
    assert head.split() == ["none", "ars"]
    assert row.split() == ["roll", "peak", "deg", "2.000", "-1.500"]
    for label, value in (("none", "2.000"), ("ars", "-1.500")):
        assert head.index(label) + len(label) == row.index(value) + len(value)


def test_what_does_not_exist_is_a_dash_and_what_is_missing_a_blank():
    text = comparison({"a": {"x_s": math.nan, "y_s": 1.0}, "b": {"x_s": 2.0}})
    _, first, second = text.splitlines()
    assert first.split() == ["x", "s", "-", "2.000"]
    assert second.split() == ["y", "s", "1.000"]


def test_table_of_real_metrics_has_a_line_for_each():
    values = step_response.metrics(step_steer())
    assert len(comparison({"none": values}).splitlines()) == len(values) + 1

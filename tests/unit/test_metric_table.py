"""Declared metrics: words, unit for display, significance; a name without a declaration is an error."""

from __future__ import annotations

import math

import pytest

from activesteer.analysis.metrics import KEY_METRICS
from activesteer.core.metric_table import METRICS, metric, recorded_metric
from activesteer.errors import ParameterError
from tests.raising import raises


@pytest.mark.parametrize(
    ("name", "label", "unit", "shown_for_one"),
    [
        ("yaw_rate_peak_radps", "peak yaw rate", "deg/s", 180.0 / math.pi),
        ("roll_peak_rad", "peak roll angle", "deg", 180.0 / math.pi),
        ("tb_srad", "TB factor", "s deg", 180.0 / math.pi),
        ("ay_steady_state_mps2", "steady-state lateral acceleration", "m/s²", 1.0),
        ("speed_end_mps", "final speed", "km/h", 3.6),
        ("yaw_rate_response_time_s", "yaw rate response time", "s", 1.0),
        ("ay_overshoot", "lateral acceleration overshoot", "%", 100.0),
        ("friction_utilisation_max", "largest friction utilisation", "%", 100.0),
        ("yaw_rate_after_1000ms_share", "yaw rate remaining after 1.00 s", "%", 100.0),
        ("lane_overstep_m", "lane overstep", "m", 1.0),
        ("steering_wheel_rate_rms_radps", "steering wheel rate, RMS", "deg/s", 180.0 / math.pi),
    ],
)
def test_a_metric_has_words_and_a_unit_for_display(name, label, unit, shown_for_one):
    found = metric(name)
    assert (found.label, found.unit.name, found.unit.factor) == (label, unit, pytest.approx(shown_for_one))


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("yaw_rate_overshoot", 0.125, "12.500"),
        ("cones_hit", 3.0, "3"),
        ("stays_in_lanes", 1.0, "yes"),
        ("stays_in_lanes", 0.0, "no"),
        ("speed_end_mps", math.nan, "-"),
    ],
)
def test_a_value_is_written_in_the_form_of_its_metric(name, value, text):
    assert metric(name).text(value) == text


@pytest.mark.parametrize(
    ("name", "significance"),
    [
        ("sideslip_steady_state_rad", math.radians(0.05)),
        ("sideslip_peak_rad", math.radians(0.1)),
        ("rear_steer_steady_state_rad", math.radians(0.05)),
        ("steering_wheel_rms_rad", math.radians(5.0)),
        ("yaw_rate_rms_radps", math.radians(0.5)),
        ("ay_lag_s", 0.01),
        ("track_deviation_max_m", 0.05),
        ("steering_wheel_rate_rms_radps", 0.0),
        ("ay_peak_mps2", 0.0),
    ],
)
def test_significance_is_the_declared_one(name, significance):
    assert metric(name).significance == significance


def test_a_name_without_a_declaration_is_an_error():
    with raises(ParameterError, value="sideslip_peek_rad") as caught:
        metric("sideslip_peek_rad")
    assert "sideslip_peak_rad" in str(caught.value)


def test_a_recorded_metric_of_another_version_is_shown_unconverted():
    found = recorded_metric("yaw_rate_ratio_old_rad")
    assert (found.label, found.unit_name, found.text(0.5)) == ("yaw_rate_ratio_old_rad", "", "0.500")


def test_every_key_metric_is_declared():
    assert METRICS.keys() >= {name for names in KEY_METRICS.values() for name in names}


def test_a_former_name_is_rejected_with_the_new_one():
    with raises(ParameterError, value="tyre_use_max") as caught:
        metric("tyre_use_max")
    assert "friction_utilisation_max" in str(caught.value)

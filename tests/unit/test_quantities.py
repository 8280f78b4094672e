"""How quantities are shown."""

from __future__ import annotations

import math

import pytest

from activesteer.quantities import display_unit, metric_label, parameter_title, quantity_of


@pytest.mark.parametrize(
    ("name", "words", "unit", "shown_for_one"),
    [
        ("yaw_rate_peak_radps", "yaw rate peak", "deg/s", 180.0 / math.pi),
        ("roll_peak_rad", "roll peak", "deg", 180.0 / math.pi),
        ("tb_srad", "TB", "s deg", 180.0 / math.pi),
        ("ay_steady_state_mps2", "lateral acceleration steady state", "m/s²", 1.0),
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
    assert metric_label(name) == (words, unit, pytest.approx(shown_for_one))


def test_the_channel_of_a_corner_is_shown_as_that_of_any_other():
    left, right = quantity_of("fl_tyre_fz_N"), quantity_of("rr_tyre_fz_N")
    assert left._replace(channel="") == right._replace(channel="")
    assert left.channel == "fl_tyre_fz_N"
    assert left.factor * 3500.0 == pytest.approx(3.5)
    assert left.title == "Wheel load [kN]"


def test_the_unit_of_a_quantity_is_the_one_of_its_metrics():
    for channel, metric in (
        ("yaw_rate_radps", "yaw_rate_peak_radps"), ("speed_mps", "speed_end_mps"), ("ay_mps2", "ay_rms_mps2"),
        ("sideslip_rad", "sideslip_peak_abs_rad"),
    ):  # fmt: skip
        assert quantity_of(channel).unit == display_unit(metric)


@pytest.mark.parametrize(
    ("channel", "value", "text"),
    [
        ("sideslip_rad", math.radians(-0.04), "0.0"),
        ("sideslip_rad", math.radians(-0.06), "-0.1"),
        ("speed_mps", 10.0, "36.0"),
        ("time_s", 12.345, "12.35"),
        ("speed_mps", math.nan, "n/a"),
        ("speed_mps", math.inf, "n/a"),
    ],
)
def test_values_are_written_with_the_digits_of_their_quantity(channel, value, text):
    assert quantity_of(channel).value_text(value) == text


@pytest.mark.parametrize(
    ("key", "title"),
    [
        ("maneuver.speed_kmh", "speed [km/h]"),
        ("road.mu", "road: friction coefficient"),
        ("vehicle.controllers.ars.corrector.deadband_end_degps", "ARS corrector: deadband end [deg/s]"),
        ("load.cg_height_change_m", "load: centre of gravity height change [m]"),
        ("sensors.preset", "sensors: preset"),
    ],
)
def test_parameters_are_called_by_the_words_of_their_keys(key, title):
    assert parameter_title(key) == title

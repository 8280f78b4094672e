"""Display of quantities."""

from __future__ import annotations

import math

import pytest

from activesteer.core.metric_table import METRICS
from activesteer.core.units import parameter_title, quantity_of, three_digits, typeset


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
        assert quantity_of(channel).unit == METRICS[metric].unit


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
        ("load.cg_height_change_m", "centre of gravity height change [m]"),
        ("vehicle.factors.mass", "mass factor"),
        ("sensors.preset", "sensors: preset"),
        ("road.patches.0.mu", "first road patch: friction coefficient"),
        ("phases.11.speed_kmh", "no. 12 phase: speed [km/h]"),
        ("steer.lateral_acceleration_mps2", "steer: lateral acceleration [m/s²]"),
        ("controllers.ars.corrector.derivative_gain_s2", "ARS corrector: derivative gain [s²]"),
    ],
)
def test_parameters_are_called_by_the_words_of_their_keys(key, title):
    assert parameter_title(key) == title


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("-0.0 deg", "0.0 deg"),
        ("-0", "0"),
        ("-0.05 m", "\N{MINUS SIGN}0.05 m"),
        ("-1 to -0.00", "\N{MINUS SIGN}1 to 0.00"),
    ],
)
def test_zero_has_no_minus_sign_on_a_page(text, shown):
    assert typeset(text) == shown


def test_a_page_gives_three_digits_and_whole_numbers_from_a_hundred_on():
    texts = [three_digits(value) for value in (19.0, -0.05541, 1.1, 330.7, 1530.2, 0.0)]
    assert texts == ["19.0", "\N{MINUS SIGN}0.0554", "1.10", "331", "1530", "0.00"]

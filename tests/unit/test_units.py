"""Display of quantities."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.core.metric_table import METRICS
from activesteer.core.units import (
    UNIT_NAMES,
    alike,
    find_unit,
    known_unit,
    parameter_title,
    quantity_of,
    three_digits,
    typeset,
)


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


BASE = {
    "kg": (1.0, (1, 0, 0, 0)), "m": (1.0, (0, 1, 0, 0)), "s": (1.0, (0, 0, 1, 0)), "rad": (1.0, (0, 0, 0, 1)),
    "N": (1.0, (1, 1, -2, 0)), "g": (9.81, (0, 1, -2, 0)), "deg": (math.pi / 180.0, (0, 0, 0, 1)),
    "mm": (1e-3, (0, 1, 0, 0)), "km": (1e3, (0, 1, 0, 0)), "h": (3600.0, (0, 0, 1, 0)), "Nm": (1.0, (1, 2, -2, 0)),
    "100deg": (math.pi / 1.8, (0, 0, 0, 1)), "1": (1.0, (0, 0, 0, 0)),
}  # fmt: skip
"""Factors to SI and exponents of kg, m, s and rad; 9.81 m/s2 is the gravity of all cars and roads."""
NAMED = {
    "kN": ("N", 1e3), "kNm": ("Nm", 1e3), "Pa": ("N/m2", 1.0), "kPa": ("N/m2", 1e3), "MPa": ("N/m2", 1e6),
    "bar": ("N/m2", 1e5), "J": ("Nm", 1.0), "kJ": ("Nm", 1e3), "W": ("Nm/s", 1.0), "mph": ("m/s", 0.44704),
    "rpm": ("rad/s", math.pi / 30.0), "Hz": ("rad/s", 2.0 * math.pi), "cm": ("m", 0.01), "ms": ("s", 1e-3),
    "us": ("s", 1e-6), "arcmin": ("deg", 1.0 / 60.0), "%": ("1", 0.01),
}  # fmt: skip
"""Units with names of their own, in others."""


def composed(name: str) -> tuple[float, np.ndarray]:
    """Return factor and exponents of a unit from the units in its name."""
    if name in NAMED:
        of, size = NAMED[name]
        factor, exponents = composed(of)
        return size * factor, exponents
    # `(m/s2)/rad` is divided at its last stroke, `rad/(m/s2)` at its first one.
    above, stroke, below = name.rpartition("/") if name.startswith("(") else name.partition("/")
    if stroke:
        (factor, exponents), (divisor, others) = (composed(part.strip("()")) for part in (above, below))
        return factor / divisor, exponents - others
    factor, exponents = 1.0, np.zeros(4, int)
    for word in name.split():
        unit, power = (word, 1) if word in BASE else (word[:-1], int(word[-1]))
        factor *= BASE[unit][0] ** power
        exponents += power * np.array(BASE[unit][1])
    return factor, exponents


@pytest.mark.parametrize("name", UNIT_NAMES)
def test_a_unit_has_the_size_and_the_dimension_of_its_parts(name):
    factor, exponents = composed(name)
    unit = known_unit(name)
    assert unit.factor == pytest.approx(factor, rel=1e-12)
    angles = {"rad/rad"}  # a ratio of two angles is a pure number
    assert unit.dimension == (tuple(exponents.tolist()) if name not in angles else (0, 0, 0, 0))


def test_units_of_one_quantity_are_alike_and_others_are_not():
    assert alike(find_unit("km/h"), find_unit("mph"))
    assert alike(find_unit("N.m"), find_unit("kNm"))
    assert not alike(find_unit("N"), find_unit("Nm"))
    assert not alike(find_unit("deg"), find_unit(""))
    assert find_unit("KM/H") is None
    assert find_unit("KM/H", any_case=True) == known_unit("km/h")

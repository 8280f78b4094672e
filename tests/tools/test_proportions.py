"""Confidence intervals of proportions and the resulting verdicts."""

from __future__ import annotations

import pytest
from scipy.stats import binomtest

from activesteer.errors import ParameterError
from tests.raising import raises
from tools.proportions import ProportionVerdict, percent, proportion_verdict, wilson_interval


@pytest.mark.parametrize(
    ("passed", "number", "low", "high"),
    [
        # R. G. Newcombe, Statistics in Medicine 17 (1998), 857-872, table I, method 3.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_interval_has_the_published_ends(passed: int, number: int, low: float, high: float) -> None:
    assert wilson_interval(passed, number) == pytest.approx((low, high), abs=5e-5)
    assert wilson_interval(number - passed, number) == pytest.approx((1.0 - high, 1.0 - low), abs=5e-5)


@pytest.mark.parametrize(("passed", "number"), [(0, 1), (1, 1), (3, 8), (400, 500), (499, 500), (500, 500)])
def test_interval_is_that_of_scipy(passed: int, number: int) -> None:
    found = binomtest(passed, number).proportion_ci(0.95, "wilson")
    assert wilson_interval(passed, number) == pytest.approx((found.low, found.high), abs=1e-12)


def test_nothing_is_known_of_no_samples() -> None:
    assert wilson_interval(0, 0) == (0.0, 1.0)
    assert proportion_verdict(*wilson_interval(0, 0)) is ProportionVerdict.DEPENDS


@pytest.mark.parametrize(("passed", "number"), [(3, 2), (-1, 2)])
def test_what_is_no_proportion_is_refused(passed: int, number: int) -> None:
    with raises(ParameterError, value=(passed, number)):
        wilson_interval(passed, number)


@pytest.mark.parametrize(
    ("passed", "verdict"),
    # Of 500: 418 is the first whose lower end reaches 80 %, 82 the last whose upper end stays within 20 %.
    [
        (500, ProportionVerdict.HOLDS), (418, ProportionVerdict.HOLDS), (417, ProportionVerdict.DEPENDS),
        (250, ProportionVerdict.DEPENDS), (83, ProportionVerdict.DEPENDS), (82, ProportionVerdict.DOES_NOT_HOLD),
        (0, ProportionVerdict.DOES_NOT_HOLD),
    ],
)  # fmt: skip
def test_verdict_is_given_where_chance_cannot_have_made_it(passed: int, verdict: ProportionVerdict) -> None:
    assert proportion_verdict(*wilson_interval(passed, 500)) is verdict


def test_a_few_samples_allow_no_verdict() -> None:
    # 15 of 15 still leave a lower end of 79.6 %.
    assert proportion_verdict(*wilson_interval(15, 15)) is ProportionVerdict.DEPENDS
    assert proportion_verdict(*wilson_interval(16, 16)) is ProportionVerdict.HOLDS


def test_a_small_share_is_not_rounded_to_another_one():
    assert [percent(count / 500) for count in (0, 1, 3, 5, 210, 497, 500)] == [
        "0",
        "0.2",
        "0.6",
        "1",
        "42",
        "99.4",
        "100",
    ]

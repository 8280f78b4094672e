"""Least squares and intervals for models with known solutions: coverage of the intervals, and impossible fits."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.errors import StudyError
from activesteer.measured.fit_result import autocorrelation_time, indistinguishable, intervals, without_effect
from activesteer.measured.fitting import search
from tests.raising import raises

TIME_S = np.arange(0.0, 4.0, 0.01)
TRUTH = np.array([0.3, 0.6])
FREE = np.array([True, True])


def lag(place):
    """Return two channels of a first-order lag with gain, nonlinear in the time constant."""
    gain, time_s = 1.0 + place[0], 0.2 + place[1]
    rate = gain * (1.0 - np.exp(-TIME_S / time_s))
    return [20.0 * rate, 10.0 * np.gradient(rate, TIME_S)]


def answers(measured):
    return lambda places: [[a - b for a, b in zip(lag(place), measured, strict=True)] for place in places]


def autoregressive(rng, alike):
    """Return correlated noise of variance 1; its autocorrelation time is (1 + a)/(1 - a)."""
    noise = np.empty(len(TIME_S))
    noise[0] = rng.standard_normal()
    for row, drive in enumerate(np.sqrt(1.0 - alike**2) * rng.standard_normal(len(noise) - 1), 1):
        noise[row] = alike * noise[row - 1] + drive
    return noise


def found_with(noise):
    measured = [a + b for a, b in zip(lag(TRUTH), noise, strict=True)]
    return search(answers(measured), np.array([0.5, 0.5]), lambda _: None)


def test_without_noise_the_truth_is_found():
    found = found_with([0.0, 0.0])
    np.testing.assert_allclose(found.place, TRUTH, atol=1e-6)
    assert found.settled
    assert found.rounds < 12


@pytest.mark.parametrize(("alike", "stated"), [(0.0, True), (0.0, False), (0.8, False)])
def test_of_100_intervals_95_hold_the_truth(rng, alike, stated):
    held = np.zeros(2)
    for _ in range(100):
        found = found_with([autoregressive(rng, alike) for _ in range(2)])
        half_widths, *_ = intervals(found.after, found.slopes, FREE, stated=stated)
        held += np.abs(found.place - TRUTH) < half_widths
    # Three standard deviations of a share of 95 % in 100 are 6.5; alike noise is known from few independent samples.
    assert np.all(held >= (88 if alike == 0.0 else 84))
    assert np.all(held <= 100 if alike else held < 100)


def test_noise_that_is_alike_would_otherwise_be_taken_for_more_than_it_is(rng):
    found = found_with([autoregressive(rng, 0.8) for _ in range(2)])
    told, stated = (intervals(found.after, found.slopes, FREE, stated=stated) for stated in (False, True))
    assert np.all(told[0] > 2.0 * stated[0])  # sqrt(9), but for what 400 samples say of it
    assert sum(told[2]) < 0.25 * sum(stated[2])


@pytest.mark.parametrize(("alike", "time"), [(0.0, 1.0), (0.5, 3.0), (0.8, 9.0)])
def test_the_autocorrelation_time_is_that_of_a_first_order_process(rng, alike, time):
    times = [autocorrelation_time(autoregressive(rng, alike)) for _ in range(50)]
    assert np.mean(times) == pytest.approx(time, rel=0.2)


def test_what_stays_on_one_side_counts_as_little():
    assert autocorrelation_time(np.ones(400)) > 100.0
    assert autocorrelation_time(np.zeros(400)) == 1.0


def test_a_parameter_at_an_end_of_its_range_has_no_interval_and_the_other_one_keeps_its_own():
    found = found_with([0.1, 0.1])
    both, *_ = intervals(found.after, found.slopes, FREE, stated=True)
    one, correlations, *_ = intervals(found.after, found.slopes, np.array([True, False]), stated=True)
    assert np.isnan(one[1])
    assert one[0] < both[0]  # nothing is lost to the other one
    assert np.isnan(correlations[0, 1])


def test_the_correlation_is_that_of_the_normal_equations():
    slopes = [np.column_stack([np.ones(50), np.ones(50) + 0.1 * np.resize([1.0, -1.0], 50)])]
    half_widths, correlations, *_ = intervals([np.ones(50)], slopes, FREE, stated=True)
    # J^T J = 50 [[1, 1], [1, 1.01]]: the errors' correlation is -1/sqrt(1.01).
    assert correlations[0, 1] == pytest.approx(-1.0 / np.sqrt(1.01))
    assert half_widths[1] == pytest.approx(1.96 / np.sqrt(50.0 * 0.01), rel=1e-3)


def test_what_cannot_be_told_is_named():
    ramp, wave = np.linspace(0.0, 10.0, 100), np.sin(np.arange(100.0))
    assert indistinguishable([np.column_stack([ramp, wave, 2.0 * ramp])]) == [0, 2]
    assert indistinguishable([np.column_stack([ramp, wave, 2.0 * ramp + np.cos(np.arange(100.0))])]) == []
    assert without_effect([np.column_stack([ramp, 0.0 * ramp, 1e-3 * wave])]) == [1, 2]


def test_where_nothing_can_be_driven_the_search_goes_around_or_says_so():
    measured = lag(TRUTH)

    def cliff(places):
        return ["off the road" if place[0] > 0.52 else each
                for place, each in zip(places, answers(measured)(places), strict=True)]  # fmt: skip

    found = search(cliff, np.array([0.05, 0.05]), lambda _: None)
    np.testing.assert_allclose(found.place, TRUTH, atol=1e-5)
    with raises(StudyError, value="off the road"):
        search(cliff, np.array([0.9, 0.5]), lambda _: None)

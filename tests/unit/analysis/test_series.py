"""Sampled signals: smoothing, filters, offsets, crossings, and the response to a step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import savgol_filter

from activesteer.analysis.series import (
    counted_sideslip,
    crossing_time,
    lag,
    largest_rate,
    low_pass,
    rate_rms,
    rms,
    smooth,
    step_response,
    timestep,
)
from activesteer.analysis.sine_with_dwell import _offset, _zeroing_range
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import SyntheticRun, first_order, second_order

TIME_S = np.arange(6001) * 0.001


def test_smoothing_keeps_a_3_hz_oscillation():
    wave = np.sin(2.0 * np.pi * 3.0 * TIME_S)
    inside = slice(50, -50)
    np.testing.assert_allclose(smooth(wave, 0.001)[inside], wave[inside], atol=1e-4)


def test_smoothing_is_the_filter_of_savitzky_and_golay(rng):
    values = rng.standard_normal(200)
    expected = np.asarray(savgol_filter(values, 41, polyorder=3))
    np.testing.assert_allclose(smooth(values, 0.001), expected, atol=1e-12)


def test_smoothing_takes_white_noise_to_a_quarter(rng):
    noise = rng.standard_normal(TIME_S.size)
    assert smooth(noise, 0.001).std() < 0.25 * noise.std()


def test_smoothing_leaves_coarse_samples_alone():
    values = np.array([0.0, 1.0, 0.0, 1.0, 0.0, 1.0])
    np.testing.assert_array_equal(smooth(values, 0.05), values)


def test_crossing_is_interpolated_between_samples():
    assert crossing_time(np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.0, 4.0]), 1.0) == pytest.approx(1.25)


def test_crossing_is_nan_for_a_signal_that_starts_above_the_level():
    assert math.isnan(crossing_time(np.array([0.0, 1.0]), np.array([3.0, 2.0]), 1.0))


def test_first_order_lag_takes_ln_10_time_constants_to_90_percent():
    response = step_response(TIME_S, 0.3 * first_order(TIME_S - 1.0, 0.2), 1.0, 1.0, 1e-3)
    assert response["steady_state"] == pytest.approx(0.3, rel=1e-8)
    assert response["response_time_s"] == pytest.approx(0.2 * math.log(10.0), abs=1e-5)


def test_first_order_lag_has_no_peak():
    response = step_response(TIME_S, 0.3 * first_order(TIME_S - 1.0, 0.2), 1.0, 1.0, 1e-3)
    assert math.isnan(response["peak_time_s"])
    assert response["overshoot"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("damping", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_second_order_lag_peaks_where_the_closed_form_says(damping, side):
    natural_radps = 9.0
    response = step_response(
        TIME_S, side * 0.2 * second_order(TIME_S - 1.0, natural_radps, damping), 1.0, 1.0, minimum=1e-3
    )
    root = math.sqrt(1.0 - damping**2)
    # Half a millisecond: peaks are taken from samples. 2e-4: what is left of the oscillation in the last second.
    assert response["peak_time_s"] == pytest.approx(math.pi / (natural_radps * root), abs=6e-4)
    assert response["overshoot"] == pytest.approx(math.exp(-math.pi * damping / root), abs=2e-4)
    assert response["peak"] == pytest.approx(side * 0.2 * (1.0 + math.exp(-math.pi * damping / root)), rel=1e-4)


def test_response_time_of_a_second_order_lag_solves_its_equation():
    response = step_response(TIME_S, second_order(TIME_S - 1.0, 9.0, 0.7), 1.0, 1.0, 1e-3)
    at_crossing = second_order(np.array([response["response_time_s"]]), 9.0, 0.7)[0]
    assert at_crossing == pytest.approx(0.9, abs=1e-4)


def test_noise_of_one_percent_moves_the_results_little(rng):
    clean = second_order(TIME_S - 1.0, 9.0, 0.5)
    noisy = clean + 0.01 * rng.standard_normal(TIME_S.size)
    wanted, got = (step_response(TIME_S, values, 1.0, 1.0, 1e-3) for values in (clean, noisy))
    assert got["steady_state"] == pytest.approx(wanted["steady_state"], abs=1e-3)
    assert got["response_time_s"] == pytest.approx(wanted["response_time_s"], abs=2e-3)
    assert got["overshoot"] == pytest.approx(wanted["overshoot"], abs=8e-3)
    assert got["peak_time_s"] == pytest.approx(wanted["peak_time_s"], abs=30e-3)


def test_response_that_first_moves_the_other_way_is_timed_by_its_final_direction():
    since_s = TIME_S - 1.0
    values = -0.02 * first_order(since_s, 0.3) + 0.015 * np.where(since_s > 0.0, np.exp(-since_s / 0.1), 0.0)
    response = step_response(TIME_S, values, 1.0, 1.0, 1e-4)
    assert response["steady_state"] < 0.0
    crossing_s = np.interp(response["response_time_s"] + 1.0, TIME_S, values)
    assert crossing_s == pytest.approx(0.9 * response["steady_state"], rel=1e-4)


def test_response_that_is_there_before_the_step_has_no_response_time():
    response = step_response(TIME_S, np.full_like(TIME_S, 0.2), 1.0, 1.0, 1e-3)
    assert math.isnan(response["response_time_s"])


def test_steady_state_near_zero_gives_no_times():
    response = step_response(TIME_S, 1e-6 * first_order(TIME_S - 1.0), 1.0, 1.0, 1e-3)
    assert math.isnan(response["response_time_s"])
    assert math.isnan(response["overshoot"])


def test_unequal_steps_are_refused():
    with raises(RecordingError, value=pytest.approx((0.001, 0.002))):
        timestep(np.array([0.0, 0.001, 0.003]))


def test_one_sample_is_refused():
    with raises(RecordingError, value=1):
        timestep(np.array([0.0]))


def test_largest_rate_of_a_ramp_is_its_slope():
    ramp = np.clip(TIME_S - 1.0, 0.0, 0.5)
    assert largest_rate(-4.0 * ramp, 0.001) == pytest.approx(4.0, rel=1e-9)


def test_largest_rate_is_that_of_a_step_between_coarse_samples():
    assert largest_rate(np.array([0.0, 0.0, 3.0, 3.0]), 0.5) == pytest.approx(6.0)


def test_rms_of_values_and_of_their_rate():
    time_s = np.arange(2000) * 0.001
    assert rms(np.array([3.0, -4.0])) == pytest.approx(math.sqrt(12.5))
    assert math.isnan(rms(np.empty(0)))
    assert rate_rms(3.0 * time_s, 0.001) == pytest.approx(3.0)
    assert math.isnan(rate_rms(time_s[:5], 0.001))


@pytest.mark.parametrize("shift_s", [0.01, 0.0874, 0.25])
def test_lag_of_a_shifted_signal_is_the_shift(shift_s):
    time_s = np.arange(6000) * 0.001

    def pulses(t):
        return np.exp(-((t - 2.0) ** 2) / 0.1) - np.exp(-((t - 4.0) ** 2) / 0.2)

    assert lag(pulses(time_s), 3.0 * pulses(time_s - shift_s), 0.001, 0.6) == pytest.approx(shift_s, abs=5e-4)


def test_lag_outside_the_range_or_of_nothing_does_not_exist():
    time_s = np.arange(6000) * 0.001
    sine = np.exp(-((time_s - 3.0) ** 2) / 0.1)
    later = np.exp(-((time_s - 3.8) ** 2) / 0.1)
    assert math.isnan(lag(later, sine, 0.001, 0.6))
    assert math.isnan(lag(sine, later, 0.001, 0.6))
    assert math.isnan(lag(sine, np.zeros_like(sine), 0.001, 0.6))
    assert math.isnan(lag(sine[:1000], later[:1000], 0.001, 0.6))


def test_a_sideslip_angle_counts_while_the_car_drives_and_not_while_it_swings_to_rest():
    """Two cars brake to rest. The one with less sideslip on its way swings more at the end."""
    speed_mps = np.linspace(20.0, 0.0, len(TIME_S))
    calm, wild = (
        SyntheticRun(TIME_S, {"speed_mps": speed_mps, "sideslip_rad": np.where(speed_mps > 2.7, driven, swings)})
        for driven, swings in ((0.01, 0.1), (0.02, 0.05))
    )
    assert [np.abs(counted_sideslip(run)).max() for run in (calm, wild)] == [0.01, 0.02]
    assert counted_sideslip(calm, slice(5250, None)).tolist() == [0.0]
    assert len(counted_sideslip(calm)) == np.count_nonzero(speed_mps > 10.0 / 3.6)


def test_without_a_speed_every_sideslip_angle_counts():
    assert counted_sideslip(SyntheticRun(TIME_S, {"sideslip_rad": 0.1 + 0.0 * TIME_S})).min() == 0.1


STEPS_S = np.arange(10001) * 0.001
MIDDLE = slice(3000, 7000)


@pytest.mark.parametrize(
    ("frequency_Hz", "gain", "tolerance"),
    # |H|^2 of a Butterworth filter of order 6: 1/(1 + (f/fc)^12), which is half at the cut-off.
    [(1.0, 1.0, 1e-6), (6.0, 0.5, 1e-3), (12.0, 1.0 / (1.0 + 2.0**12), 1e-4)],
)
def test_gain_is_that_of_twelve_poles_and_there_is_no_phase(frequency_Hz, gain, tolerance):
    sine = np.sin(2.0 * np.pi * frequency_Hz * STEPS_S)
    np.testing.assert_allclose(low_pass(sine, 0.001, 6.0)[MIDDLE], gain * sine[MIDDLE], atol=tolerance)


def test_a_ramp_keeps_its_ends():
    np.testing.assert_allclose(low_pass(STEPS_S, 0.001, 6.0), STEPS_S, atol=1e-3)


def test_slow_sampling_is_refused():
    with raises(RecordingError, value=0.1, allowed=0.05):
        low_pass(np.zeros(1000), 0.1, 10.0)


def test_a_few_samples_are_refused():
    with raises(RecordingError, value=5):
        low_pass(np.zeros(5), 0.001, 6.0)


TIMES_S = np.arange(4000) * 1e-3
RATE_RADPS = math.radians(150.0)


def ramp(begin_s: float, length_s: float) -> np.ndarray:
    return RATE_RADPS * np.clip(TIMES_S - begin_s, 0.0, length_s)


def test_range_is_the_second_before_the_average_rate_passes_75_deg_per_second():
    samples = _zeroing_range(TIMES_S, ramp(2.0, 0.5))
    # Half of a window of 0.1 s turns at 150 deg/s when its middle is where the ramp begins.
    assert samples.stop == pytest.approx(2000, abs=2)
    assert samples.stop - samples.start == 1000


def test_a_jerk_of_less_than_200_ms_is_passed_over():
    assert _zeroing_range(TIMES_S, ramp(1.2, 0.02) + ramp(2.5, 0.5)).stop == pytest.approx(2500, abs=2)


def test_range_is_as_long_as_the_run_allows():
    samples = _zeroing_range(TIMES_S, ramp(0.4, 0.5))
    assert samples.start == 0
    assert samples.stop == pytest.approx(400, abs=2)


@pytest.mark.parametrize("slow", [ramp(1.0, 0.1), 0.2 * ramp(1.0, 2.0)])
def test_a_wheel_that_never_turns_fast_leaves_signals_as_they_are(slow):
    samples = _zeroing_range(TIMES_S, slow)
    assert samples.start == samples.stop
    assert _offset(TIMES_S, samples) == 0.0


def test_offset_is_the_mean_over_the_range():
    assert _offset(np.where(TIMES_S < 2.0, 0.3, 1.0), slice(1500, 2500)) == pytest.approx(0.65)

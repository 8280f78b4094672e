"""The errors of a sensor have the statistics of its table."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.unit.sensors.runs import PLACES, block, said_of, shown

N = 40_000
SURE = 4.5 / math.sqrt(N)
"""A correlation of independent numbers is larger once in 150 000 draws."""


def test_noise_is_white_and_normal_with_the_rms_that_is_asked_for():
    noise = said_of("yaw_rate", 0.2, N, noise_radps=0.01) - 0.2
    assert noise.std() == pytest.approx(0.01, rel=4.5 / math.sqrt(2 * N))
    assert abs(noise.mean()) < 0.01 * SURE
    # Of a normal distribution: 68.3 % within one rms, 99.73 % within three.
    assert np.mean(np.abs(noise) < 0.01) == pytest.approx(0.6827, abs=0.01)
    assert np.mean(np.abs(noise) < 0.03) == pytest.approx(0.9973, abs=0.0015)
    for lag in (1, 2, 7, 100):
        assert abs(np.corrcoef(noise[lag:], noise[:-lag])[0, 1]) < SURE
    power = np.abs(np.fft.rfft(noise - noise.mean())) ** 2
    low, high = power[1 : len(power) // 2].mean(), power[len(power) // 2 :].mean()
    assert low == pytest.approx(high, rel=0.05)


def test_every_sensor_and_every_seed_has_a_noise_of_its_own():
    asked = block(yaw_rate={"noise_radps": 0.1}, ay={"noise_mps2": 0.1}, wheel_speed={"noise_radps": 0.1})
    rows = shown(asked, np.zeros((N, 15)))
    noisy = [rows[:, place] for place in (PLACES["yaw_rate"], PLACES["ay"], 7, 8, 9, 10)]
    other_seed = said_of("yaw_rate", 0.0, N, seed=1, noise_radps=0.1)
    again = said_of("yaw_rate", 0.0, N, seed=0, noise_radps=0.1)
    np.testing.assert_array_equal(again, noisy[0])
    correlations = np.corrcoef([*noisy, other_seed])
    assert np.abs(correlations - np.eye(7)).max() < SURE


def test_bias_is_constant_in_a_run_and_spread_over_seeds_as_asked():
    runs = [said_of("ay", 1.0, 5, seed=seed, bias_mps2=0.2) - 1.0 for seed in range(400)]
    assert all(np.ptp(run) == 0.0 for run in runs)
    biases = np.array(runs)[:, 0]
    assert math.sqrt(np.mean(biases**2)) == pytest.approx(0.2, rel=4.0 / math.sqrt(2 * 400))
    assert abs(biases.mean()) < 0.2 * 4.0 / math.sqrt(400)


def test_drift_changes_the_offset_by_its_rms_in_a_minute_and_by_half_of_it_in_a_quarter():
    runs = np.array(
        [said_of("yaw_rate", 0.0, 601, 0.1, seed=seed, drift_radps=0.03, sample_time_s=0.1) for seed in range(300)]
    )
    for steps, expected in ((600, 0.03), (150, 0.015)):
        change = runs[:, steps] - runs[:, 0]
        assert math.sqrt(np.mean(change**2)) == pytest.approx(expected, rel=4.0 / math.sqrt(2 * 300))


def test_bandwidth_takes_three_decibels_at_its_corner_and_a_tenth_of_the_amplitude_a_decade_above():
    timestep_s, corner_Hz = 1e-4, 20.0
    time_s = np.arange(40_000) * timestep_s
    for factor, gain in ((0.1, 0.995), (1.0, 1.0 / math.sqrt(2.0)), (10.0, 0.0995)):
        wave = np.sin(2.0 * math.pi * factor * corner_Hz * time_s)
        said = said_of("ay", wave, timestep_s=timestep_s, bandwidth_Hz=corner_Hz)
        settled = said[20_000:]
        assert math.sqrt(2.0) * settled.std() == pytest.approx(gain, rel=0.01)


def test_delay_is_where_truth_and_output_correlate(rng):
    truth = rng.standard_normal(4000)
    said = said_of("yaw_rate", truth, delay_s=0.012)
    correlation = [np.corrcoef(truth[: 4000 - lag], said[lag:])[0, 1] for lag in range(30)]
    assert int(np.argmax(correlation)) == 12
    np.testing.assert_array_equal(said[12:], truth[:-12])


def test_output_is_held_between_samples(rng):
    truth = rng.standard_normal(1000)
    said = said_of("ax", truth, sample_time_s=0.01)
    np.testing.assert_array_equal(said, np.repeat(truth[::10], 10))


def test_quantisation_gives_whole_steps_and_errs_by_half_of_one(rng):
    truth = rng.uniform(-1.0, 1.0, 2000)
    said = said_of("steering_wheel", truth, quantum_rad=0.05)
    steps = said / 0.05
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)
    assert np.abs(said - truth).max() <= 0.025 + 1e-12
    assert np.unique(np.rint(steps)).size == 41
    np.testing.assert_array_equal(said_of("steering_wheel", -truth, quantum_rad=0.05), -said)


def test_limit_holds_to_both_sides_and_noise_does_not_pass_it():
    truth = np.linspace(-2.0, 2.0, 2000)
    said = said_of("yaw_rate", truth, limit_radps=1.5, noise_radps=0.1)
    assert (said.min(), said.max()) == (-1.5, 1.5)


def test_sensors_without_any_error_pass_on_the_truth_bit_for_bit(rng):
    truth = rng.standard_normal((500, 15))
    # One of them is not ideal, so that the block is used at all.
    said = shown(block(yaw_rate={"noise_radps": 1.0}), truth)
    others = [column for column in range(15) if column != PLACES["yaw_rate"]]
    np.testing.assert_array_equal(said[:, others], truth[:, others])


@pytest.mark.parametrize("speed_radps", [3.0, 71.7, -71.7, 300.0])
def test_pulse_wheel_tells_a_constant_speed_exactly(speed_radps):
    said = said_of("wheel_speed", speed_radps, 3000, teeth=48, sample_time_s=0.01)
    np.testing.assert_allclose(said[1000:], speed_radps, rtol=1e-9)


def test_pulse_wheel_that_swings_over_an_edge_never_says_more_than_it_swings():
    truth = 6.0 * np.cos(2.0 * math.pi * 10.0 * np.arange(2000) * 0.001)
    said = said_of("wheel_speed", truth, teeth=48, sample_time_s=0.01)
    assert np.isfinite(said).all()
    assert 0.0 < np.abs(said[500:]).max() <= 6.0


@pytest.mark.parametrize("frequency_Hz", [7.0, 13.0, 31.0])
def test_locked_wheel_that_swings_on_its_tyre_stands_for_the_pulse_wheel(frequency_Hz):
    """It passes one edge to and fro. In a run, this was read as up to 20 rad/s when each passage counted as a tooth."""
    to_an_edge = np.full(10, 0.5 * 2.0 * math.pi / 48 / 0.010)
    truth = np.concatenate([to_an_edge, 1.3 * np.cos(2.0 * math.pi * frequency_Hz * np.arange(2000) * 0.001)])
    said = said_of("wheel_speed", truth, teeth=48, sample_time_s=0.005)
    assert np.abs(said[1000:]).max() < 0.2


def test_pulse_wheel_answers_with_the_mean_speed_since_the_sample_before():
    """Under constant acceleration the signal lags by half a sample and the age of the edges."""
    time_s = np.arange(3000) * 0.001
    said = said_of("wheel_speed", 60.0 + 20.0 * time_s, teeth=48, sample_time_s=0.01)
    at_samples = np.arange(500, 3000, 10)
    lag_s = (60.0 + 20.0 * time_s[at_samples] - said[at_samples]) / 20.0
    # Half of 10 ms, half a tooth's time (1 to 2 ms at most) and half a step, in which the speed is taken as constant.
    assert 0.004 < lag_s.mean() < 0.007
    assert lag_s.max() < 0.009


def test_stopped_pulse_wheel_says_no_more_than_the_time_since_its_last_edge_allows():
    truth = np.concatenate([np.full(1000, 20.0), np.zeros(4000)])
    said = said_of("wheel_speed", truth, teeth=48, sample_time_s=0.01)
    waited_s = np.arange(100, 4000) * 0.001
    assert (said[1100:] <= 2.0 * math.pi / 48 / (waited_s - 0.02)).all()
    assert said[-1] < 0.04
    assert (np.diff(said[1020:]) <= 0.0).all()


def test_what_is_remembered_goes_on_bit_for_bit(rng):
    truth = rng.standard_normal((800, 15)) + 20.0
    sensors = block(preset="production", seed=5)
    shown(sensors, truth[:400])
    kept = sensors.memory.copy()
    first = shown(sensors, truth[400:])
    sensors.memory[:] = kept
    np.testing.assert_array_equal(shown(sensors, truth[400:]), first)


def test_speed_is_that_of_the_wheels_that_count():
    truth = np.zeros((100, 15))
    truth[:, 0], truth[:, 7:11] = 25.0, (70.0, 70.0, 80.0, 82.0)
    sensors = block(yaw_rate={"noise_radps": 1.0})
    assert shown(sensors, truth)[-1, 0] == 25.0
    said = shown(sensors, truth, radii_m=np.array([0.0, 0.0, 0.15, 0.15]))
    assert said[-1, 0] == pytest.approx(0.3 * 81.0)

"""Frequency responses to a sweep and to random steering."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import signal

from activesteer.analysis.frequency_response import (
    frequency_response,
    frequency_response_metrics,
    random_response,
)
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import SyntheticRun

STEP_S, LAG_S, GAIN = 0.001, 0.15, 0.3
OUTPUTS = ("yaw_rate_radps", "ay_mps2", "roll_rad", "sideslip_rad")


def sweep(rng: np.random.Generator | None = None, last_Hz: float = 6.0) -> SyntheticRun:
    time_s = np.arange(40000) * STEP_S
    t = np.clip(time_s - 0.5, 0.0, 36.0)
    growth = math.log(last_Hz / 0.1) / 36.0
    window = np.clip(np.minimum(t, 36.0 - t) / 2.0, 0.0, 1.0)
    wheel = 0.15 * np.sin(2 * math.pi * 0.1 * np.expm1(growth * t) / growth) * window
    answer = np.zeros_like(wheel)
    decay = math.exp(-STEP_S / LAG_S)
    for row in range(1, len(wheel)):
        # The lag's exact answer to an input that is linear between samples, to second order of the step.
        answer[row] = decay * answer[row - 1] + (1 - decay) * GAIN * 0.5 * (wheel[row] + wheel[row - 1])
    noise = 0.0 if rng is None else rng.normal(0.0, 0.02, len(answer))
    channels = dict.fromkeys(OUTPUTS, answer + noise)
    return SyntheticRun(
        time_s, {**channels, "steering_wheel_demand_rad": wheel, "speed_mps": np.full_like(wheel, 22.0)}
    )


def test_lag_is_found_in_gain_and_phase():
    found = frequency_response(sweep(), "yaw_rate_radps", np.geomspace(0.2, 4.0, 20))
    expected = GAIN / (1 + 2j * math.pi * found.frequency_Hz * LAG_S)
    assert np.abs(found.response / expected) == pytest.approx(1.0, abs=5e-3)
    assert np.degrees(np.angle(found.response / expected)) == pytest.approx(0.0, abs=1.0)
    assert found.coherence.min() > 0.99


def test_coherence_falls_with_noise(rng):
    found = frequency_response(sweep(rng), "yaw_rate_radps", np.geomspace(0.2, 4.0, 20))
    assert found.coherence.min() < 0.98
    assert found.coherence.max() <= 1.0 + 1e-12


def test_metrics_of_a_lag():
    values = frequency_response_metrics(sweep())
    assert values["yaw_rate_gain_1ps"] == pytest.approx(GAIN / abs(1 + 2j * math.pi * 0.2 * LAG_S), rel=0.01)
    assert values["yaw_rate_45deg_Hz"] == pytest.approx(1.0 / (2 * math.pi * LAG_S), rel=0.02)
    assert math.isnan(values["yaw_rate_peak_gain_Hz"])
    assert values["coherence_min"] > 0.99


def test_frequency_that_was_not_driven_is_an_error():
    with raises(RecordingError, value=40.0):
        frequency_response(sweep(last_Hz=2.0), "yaw_rate_radps", np.array([1.0, 40.0]))


def test_frequency_that_the_run_is_too_short_for_is_an_error():
    with raises(RecordingError, value=(0.01, 0.01)):
        frequency_response(sweep(), "yaw_rate_radps", np.array([0.01]))


RANDOM_STEP_S, KEPT = 0.001, 20
NATURAL_RADPS, DAMPING, RANDOM_GAIN = 2.0 * math.pi * 1.5, 0.5, 0.3
FINITE = 5e-3
"""Error of the finite segments, the docstring's some per mille."""


def run(rng: np.random.Generator, noise: float = 0.0, length_s: float = 61.0) -> SyntheticRun:
    """Return steering from 0 to 6 Hz and the response: computed every 1 ms, kept every 20 ms, as in a study."""
    time_s = np.arange(round(length_s / RANDOM_STEP_S)) * RANDOM_STEP_S
    low = signal.butter(6, 6.0, fs=1.0 / RANDOM_STEP_S, output="sos")
    wheel, other = (np.asarray(signal.sosfilt(low, rng.normal(0.0, 1.0, len(time_s)))) for _ in range(2))
    system = ([RANDOM_GAIN * NATURAL_RADPS**2], [1.0, 2.0 * DAMPING * NATURAL_RADPS, NATURAL_RADPS**2])
    discrete: Any = signal.cont2discrete(system, RANDOM_STEP_S, "foh")
    clean = np.asarray(signal.lfilter(np.ravel(discrete[0]), discrete[1], wheel))
    answer = clean + noise * np.std(clean) * other
    return SyntheticRun(time_s[::KEPT], {"steering_wheel_demand_rad": wheel[::KEPT], "yaw_rate_radps": answer[::KEPT]})


def exact(frequency_Hz: np.ndarray) -> np.ndarray:
    s = 2j * math.pi * frequency_Hz
    return RANDOM_GAIN * NATURAL_RADPS**2 / (s**2 + 2.0 * DAMPING * NATURAL_RADPS * s + NATURAL_RADPS**2)


def test_known_system_is_found_in_gain_and_phase(rng):
    found = random_response([run(rng) for _ in range(6)], "yaw_rate_radps", 0.2, 4.0)
    frequency_Hz, response, coherence, gain_error, _ = found
    assert frequency_Hz == pytest.approx(np.arange(4, 81) * 0.05)
    assert response / exact(frequency_Hz) == pytest.approx(1.0, abs=FINITE + 4.0 * gain_error.max())
    assert gain_error.max() < 0.01
    assert coherence.min() > 0.99


def test_errors_with_noise_are_as_large_as_stated(rng):
    found = random_response([run(rng, noise=2.0) for _ in range(6)], "yaw_rate_radps", 0.2, 4.0)
    frequency_Hz, response, coherence, gain_error, _ = found
    assert 0.3 < coherence.min() < 0.6
    gain = np.abs(response / exact(frequency_Hz)) - 1.0
    phase_rad = np.angle(response / exact(frequency_Hz))
    for error in (gain, phase_rad):
        relative = error / gain_error
        assert np.sqrt(np.mean(relative**2)) == pytest.approx(1.0, abs=0.3)  # some 50 independent lines: 0.1
        assert np.abs(relative).max() < 4.5


def test_more_runs_leave_less_error(rng):
    runs = [run(rng, noise=2.0) for _ in range(8)]
    one, all_ = (random_response(some, "yaw_rate_radps", 1.0, 3.0) for some in (runs[:1], runs))
    assert all_.averages == pytest.approx(8.0 * one.averages)
    assert all_.gain_error.mean() < 0.6 * one.gain_error.mean()


def test_what_cannot_be_averaged_is_an_error(rng):
    with raises(RecordingError):
        random_response([], "yaw_rate_radps", 0.2, 4.0)
    with raises(RecordingError, value=15.0):
        random_response([run(rng, length_s=15.0)], "yaw_rate_radps", 0.2, 4.0)
    with raises(RecordingError) as refused:
        random_response([run(rng)], "yaw_rate_radps", 0.2, 24.0)
    assert 4.0 < refused.value.value <= 24.0

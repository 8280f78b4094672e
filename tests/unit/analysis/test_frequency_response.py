"""Frequency response of a synthetic run: a first-order lag behind a sine sweep."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.frequency_response import OUTPUTS, frequency_response, frequency_response_metrics
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import SyntheticRun

STEP_S, LAG_S, GAIN = 0.001, 0.15, 0.3


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

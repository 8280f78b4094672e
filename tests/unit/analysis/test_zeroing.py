"""The second before a steering wheel turns fast, by FMVSS 126."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.series import offset, zeroing_range

TIME_S = np.arange(4000) * 1e-3
RATE_RADPS = math.radians(150.0)


def ramp(begin_s: float, length_s: float) -> np.ndarray:
    return RATE_RADPS * np.clip(TIME_S - begin_s, 0.0, length_s)


def test_range_is_the_second_before_the_average_rate_passes_75_deg_per_second():
    samples = zeroing_range(TIME_S, ramp(2.0, 0.5))
    # Half of a window of 0.1 s turns at 150 deg/s when its middle is where the ramp begins.
    assert samples.stop == pytest.approx(2000, abs=2)
    assert samples.stop - samples.start == 1000


def test_a_jerk_of_less_than_200_ms_is_passed_over():
    assert zeroing_range(TIME_S, ramp(1.2, 0.02) + ramp(2.5, 0.5)).stop == pytest.approx(2500, abs=2)


def test_range_is_as_long_as_the_run_allows():
    samples = zeroing_range(TIME_S, ramp(0.4, 0.5))
    assert samples.start == 0
    assert samples.stop == pytest.approx(400, abs=2)


@pytest.mark.parametrize("slow", [ramp(1.0, 0.1), 0.2 * ramp(1.0, 2.0)])
def test_a_wheel_that_never_turns_fast_leaves_signals_as_they_are(slow):
    samples = zeroing_range(TIME_S, slow)
    assert samples.start == samples.stop
    assert offset(TIME_S, samples) == 0.0


def test_offset_is_the_mean_over_the_range():
    assert offset(np.where(TIME_S < 2.0, 0.3, 1.0), slice(1500, 2500)) == pytest.approx(0.65)

"""The filter of the test standards."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.analysis.series import low_pass
from activesteer.errors import RecordingError
from tests.raising import raises

TIME_S = np.arange(10001) * 0.001
MIDDLE = slice(3000, 7000)


@pytest.mark.parametrize(
    ("frequency_Hz", "gain", "tolerance"),
    # |H|^2 of a Butterworth filter of order 6: 1/(1 + (f/fc)^12), which is half at the cut-off.
    [(1.0, 1.0, 1e-6), (6.0, 0.5, 1e-3), (12.0, 1.0 / (1.0 + 2.0**12), 1e-4)],
)
def test_gain_is_that_of_twelve_poles_and_there_is_no_phase(frequency_Hz, gain, tolerance):
    sine = np.sin(2.0 * np.pi * frequency_Hz * TIME_S)
    np.testing.assert_allclose(low_pass(sine, 0.001, 6.0)[MIDDLE], gain * sine[MIDDLE], atol=tolerance)


def test_a_ramp_keeps_its_ends():
    np.testing.assert_allclose(low_pass(TIME_S, 0.001, 6.0), TIME_S, atol=1e-3)


def test_slow_sampling_is_refused():
    with raises(RecordingError, value=0.1, allowed=0.05):
        low_pass(np.zeros(1000), 0.1, 10.0)


def test_a_few_samples_are_refused():
    with raises(RecordingError, value=5):
        low_pass(np.zeros(5), 0.001, 6.0)

"""Steering wheel angle at 0.3 g by the line through a slow ramp."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.step_response import REFERENCE_MPS2, angle_at
from activesteer.conventions import GRAVITY_MPS2

STEERING_RAD = np.radians(13.5) * np.arange(10_000) * 1e-3


def test_a_line_is_read_where_it_is():
    # 0.3 g at 28 deg, with the offset by which the car lags behind the ramp.
    ay = REFERENCE_MPS2 * (STEERING_RAD - math.radians(1.35)) / (math.radians(28.0) - math.radians(1.35))
    assert math.degrees(angle_at(STEERING_RAD, ay, REFERENCE_MPS2)) == pytest.approx(28.0, abs=1e-9)


def test_only_0_1_to_0_375_g_count():
    gain = REFERENCE_MPS2 / math.radians(28.0)
    ay = gain * STEERING_RAD
    outside = np.where((ay < 0.1 * GRAVITY_MPS2) | (ay > 0.375 * GRAVITY_MPS2), ay**2 / ay.max(), ay)
    bent = np.maximum.accumulate(np.where(ay > 0.375 * GRAVITY_MPS2, ay**2, outside))
    assert math.degrees(angle_at(STEERING_RAD, bent, REFERENCE_MPS2)) == pytest.approx(28.0, abs=0.05)

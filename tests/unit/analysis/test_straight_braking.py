"""Metrics of braking for a synthetic stop with known values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.braking import straight_braking_metrics
from activesteer.conventions import CORNERS
from activesteer.errors import RecordingError
from tests.unit.analysis.synthetic import SyntheticRun

SPEED_MPS, DECELERATION_MPS2, PEAK = 25.0, 6.0, 0.8
RADIUS_M = 0.3


def stopping(*, slip: float = 0.1, until_s: float = 6.0, pedal: float = 1.0) -> SyntheticRun:
    """Return a stop: coasting for a second, then constant deceleration to rest, with another slip at one wheel."""
    time_s = np.arange(0.0, until_s, 0.001)
    braked_s = np.maximum(time_s - 1.0, 0.0)
    speed = np.maximum(SPEED_MPS - DECELERATION_MPS2 * braked_s, 0.0)
    x = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * 0.001)])
    braking = braked_s > 0.0
    channels = {
        "brake_pedal": np.where(braking, pedal, 0.0), "speed_mps": speed, "x_m": x, "y_m": 0.01 * braked_s,
        "yaw_rad": np.zeros_like(time_s), "yaw_rate_radps": -0.02 * braking, "steering_wheel_rad": 0.1 * braking,
    }  # fmt: skip
    for corner in CORNERS:
        own = slip if corner == "rl" else 0.05
        channels |= {
            f"{corner}_tyre_fx_N": -3000.0 * braking, f"{corner}_tyre_fy_N": np.zeros_like(time_s),
            f"{corner}_tyre_fz_N": np.full_like(time_s, 5000.0),
            f"{corner}_friction_utilisation": np.where(braking, 3000.0 / (PEAK * 5000.0), 0.0),
            f"{corner}_wheel_speed_radps": speed / RADIUS_M * (1.0 - own * braking),
            f"{corner}_brake_pressure_Pa": 50e5 * braking,
        }  # fmt: skip
    return SyntheticRun(time_s, channels, "straight_braking")


def test_a_constant_deceleration_is_found_with_its_distance_and_efficiency() -> None:
    found = straight_braking_metrics(stopping())
    assert found["stopping_distance_m"] == pytest.approx(SPEED_MPS**2 / (2.0 * DECELERATION_MPS2), rel=1e-3)
    assert found["mean_deceleration_mps2"] == pytest.approx(DECELERATION_MPS2, rel=1e-4)
    assert found["braking_efficiency"] == pytest.approx(DECELERATION_MPS2 / (PEAK * 9.80665), rel=1e-3)
    assert found["speed_begin_mps"] == pytest.approx(SPEED_MPS, rel=1e-3)
    assert found["yaw_rate_peak_abs_radps"] == 0.02
    assert found["brake_pressure_peak_Pa"] == 50e5


@pytest.mark.parametrize("slip", [0.1, 0.4, 1.0])
def test_the_largest_slip_is_that_of_the_wheel_that_has_it(slip: float) -> None:
    assert straight_braking_metrics(stopping(slip=slip))["wheel_slip_max"] == pytest.approx(slip, abs=1e-9)


def test_what_a_run_that_ends_on_the_way_does_not_have_is_not_defined() -> None:
    found = straight_braking_metrics(stopping(until_s=3.0))
    assert math.isnan(found["stopping_distance_m"])
    assert math.isnan(found["braking_efficiency"])
    assert found["wheel_slip_max"] == pytest.approx(0.1)


def test_a_run_without_a_brake_is_none() -> None:
    with pytest.raises(RecordingError):
        straight_braking_metrics(stopping(pedal=0.0))

"""ISO 7975 with a car that follows a formula."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.braking import BEFORE_S, MIN_YAW_RATE_RADPS
from activesteer.analysis.metrics import metrics
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import SyntheticRun

RADIUS_M, SPEED_MPS, BRAKE_S, DECELERATION_MPS2 = 100.0, 25.0, 1.0, 5.0


def braking(side: float = 1.0, turn_in: float = 0.0, duration_s: float = 4.0, outside_m: float = 0.0) -> SyntheticRun:
    """Return a car on a circle that brakes at 1 s; then its yaw rate exceeds that of the circle by `turn_in` rad/s."""
    time_s = np.arange(round(duration_s * 1000.0) + 1) * 0.001
    since_s = np.maximum(time_s - BRAKE_S, 0.0)
    speed = np.maximum(SPEED_MPS - DECELERATION_MPS2 * since_s, 0.0)
    travelled = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * 0.001)])
    angle = travelled / RADIUS_M
    radius = RADIUS_M + outside_m * np.minimum(since_s, 1.0)
    yaw_rate = speed / RADIUS_M + np.where(since_s > 0.0, turn_in, 0.0)
    channels = {
        "yaw_rate_radps": side * yaw_rate,
        "ay_mps2": side * speed**2 / RADIUS_M,
        "yaw_rad": side * (angle + np.where(since_s > 0.0, 0.03, 0.0)),
        "sideslip_rad": np.where(since_s > 0.0, -side * 0.03, 0.0),
        "y_m": side * (RADIUS_M - radius * np.cos(angle)),
        "x_m": radius * np.sin(angle),
        "speed_mps": speed,
        "brake_pedal": np.where(since_s > 0.0, 0.5, 0.0),
    }
    return SyntheticRun(time_s, channels, "brake_in_turn")


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_car_that_keeps_to_its_circle_deviates_by_nothing(side):
    values = metrics(braking(side))
    assert values["radius_begin_m"] == pytest.approx(RADIUS_M, rel=1e-6)
    assert values["mean_deceleration_mps2"] == pytest.approx(DECELERATION_MPS2, rel=1e-3)
    assert values["yaw_rate_begin_radps"] == pytest.approx(side * 0.25)
    assert values["yaw_rate_deviation_after_1000ms_radps"] == pytest.approx(0.0, abs=1e-4)
    assert values["path_deviation_after_1000ms_m"] == pytest.approx(0.0, abs=1e-3)
    assert values["sideslip_peak_abs_rad"] == pytest.approx(0.03)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("turn_in", [0.1, -0.1])
def test_turning_in_is_positive_on_both_sides(side, turn_in):
    values = metrics(braking(side, turn_in=turn_in))
    assert values["yaw_rate_deviation_after_1000ms_radps"] == pytest.approx(turn_in, abs=1e-4)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_leaving_the_circle_to_the_outside_is_positive(side):
    assert metrics(braking(side, outside_m=2.0))["path_deviation_after_1000ms_m"] == pytest.approx(2.0, abs=5e-3)


def test_a_run_that_ends_within_the_second_has_no_deviation():
    values = metrics(braking(duration_s=1.8))
    assert math.isnan(values["yaw_rate_deviation_after_1000ms_radps"])
    assert math.isnan(values["path_deviation_after_1000ms_m"])
    assert values["mean_deceleration_mps2"] == pytest.approx(DECELERATION_MPS2, rel=1e-3)


def test_deceleration_ends_at_standstill():
    assert metrics(braking(duration_s=9.0))["mean_deceleration_mps2"] == pytest.approx(DECELERATION_MPS2, rel=1e-3)


def test_what_is_no_braking_in_a_turn_is_refused():
    run = braking()
    run.channels["yaw_rate_radps"] = np.zeros_like(run.time_s)
    with raises(RecordingError, value=0.0, allowed=MIN_YAW_RATE_RADPS):
        metrics(run)
    run = braking()
    run.channels["brake_pedal"] = np.zeros_like(run.time_s)
    with raises(RecordingError, allowed=BEFORE_S):
        metrics(run)
    run.channels["brake_pedal"] = np.ones_like(run.time_s)
    with raises(RecordingError, allowed=BEFORE_S):
        metrics(run)

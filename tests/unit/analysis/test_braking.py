"""Metrics of braking straight ahead and in a turn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.braking import BEFORE_S, MIN_YAW_RATE_RADPS, straight_braking_metrics
from activesteer.analysis.metrics import metrics
from activesteer.core.conventions import CORNERS
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import SyntheticRun, elsewhere

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
    # The car drifts by 10 mm/s until it stands, and no further.
    assert found["lateral_deviation_max_m"] == pytest.approx(0.01 * SPEED_MPS / DECELERATION_MPS2, rel=0.01)
    assert found["braking_begin_time_s"] == pytest.approx(1.0, abs=2e-3)


def test_a_stop_is_the_same_in_every_direction() -> None:
    run = stopping()
    run.channels["yaw_rad"] = 0.05 * np.maximum(run.time_s - 1.0, 0.0)
    expected = straight_braking_metrics(run)
    assert expected["heading_end_rad"] == pytest.approx(0.05 * SPEED_MPS / DECELERATION_MPS2, rel=0.01)
    # The heading passes half a turn, where its angle may jump.
    for turn_rad in (0.7, math.pi - 0.1):
        found = straight_braking_metrics(elsewhere(run, turn_rad))
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_the_efficiency_counts_the_peak_friction_by_distance() -> None:
    run = stopping()
    # Beyond the first half of the distance the friction is half as large, and the tyres use twice as much of it.
    worse = run["x_m"] > 25.0 + 0.5 * SPEED_MPS**2 / (2.0 * DECELERATION_MPS2)
    for corner in CORNERS:
        run.channels[f"{corner}_friction_utilisation"] = run[f"{corner}_friction_utilisation"] * np.where(
            worse, 2.0, 1.0
        )
    whole = SPEED_MPS**2 / (2.0 * DECELERATION_MPS2)
    begin, end = (1.0 - 0.8**2) * whole, (1.0 - 0.1**2) * whole
    share = (end - 0.5 * whole) / (end - begin)
    allowed = 9.80665 * PEAK * (1.0 - 0.5 * share)
    found = straight_braking_metrics(run)["braking_efficiency"]
    assert found == pytest.approx(DECELERATION_MPS2 / allowed, rel=2e-3)


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


TURN_M, TURN_MPS, BRAKE_S, TURN_MPS2 = 100.0, 25.0, 1.0, 5.0


def braking(side: float = 1.0, turn_in: float = 0.0, duration_s: float = 4.0, outside_m: float = 0.0) -> SyntheticRun:
    """Return a car on a circle that brakes at 1 s; then its yaw rate exceeds that of the circle by `turn_in` rad/s."""
    time_s = np.arange(round(duration_s * 1000.0) + 1) * 0.001
    since_s = np.maximum(time_s - BRAKE_S, 0.0)
    speed = np.maximum(TURN_MPS - TURN_MPS2 * since_s, 0.0)
    travelled = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * 0.001)])
    angle = travelled / TURN_M
    radius = TURN_M + outside_m * np.minimum(since_s, 1.0)
    yaw_rate = speed / TURN_M + np.where(since_s > 0.0, turn_in, 0.0)
    channels = {
        "yaw_rate_radps": side * yaw_rate,
        "ay_mps2": side * speed**2 / TURN_M,
        "yaw_rad": side * (angle + np.where(since_s > 0.0, 0.03, 0.0)),
        "sideslip_rad": np.where(since_s > 0.0, -side * 0.03, 0.0),
        "y_m": side * (TURN_M - radius * np.cos(angle)),
        "x_m": radius * np.sin(angle),
        "speed_mps": speed,
        "brake_pedal": np.where(since_s > 0.0, 0.5, 0.0),
    }
    return SyntheticRun(time_s, channels, "brake_in_turn")


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_car_that_keeps_to_its_circle_deviates_by_nothing(side):
    values = metrics(braking(side))
    assert values["radius_begin_m"] == pytest.approx(TURN_M, rel=1e-6)
    assert values["mean_deceleration_mps2"] == pytest.approx(TURN_MPS2, rel=1e-3)
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
    assert values["mean_deceleration_mps2"] == pytest.approx(TURN_MPS2, rel=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_turn_is_the_same_in_every_direction_and_from_the_course_of_a_car_that_slides(side):
    run = braking(side, turn_in=0.1, outside_m=2.0)
    expected = metrics(run)
    assert metrics(elsewhere(run, 0.7)) == pytest.approx(expected, rel=1e-6, abs=1e-9)
    # The circle lies beside the direction of motion, not beside the heading.
    run.channels["yaw_rad"] = run["yaw_rad"] + 0.2
    run.channels["sideslip_rad"] = run["sideslip_rad"] - 0.2
    found = metrics(run)
    assert found["path_deviation_after_1000ms_m"] == pytest.approx(expected["path_deviation_after_1000ms_m"], abs=1e-9)


def test_deceleration_ends_when_the_pedal_is_released():
    run = braking()
    released = run.time_s >= BRAKE_S + 1.0
    run.channels["brake_pedal"] = np.where(released, 0.0, run["brake_pedal"])
    run.channels["speed_mps"] = np.where(released, TURN_MPS - TURN_MPS2, run["speed_mps"])
    assert metrics(run)["mean_deceleration_mps2"] == pytest.approx(TURN_MPS2, rel=2e-3)
    assert metrics(run)["speed_end_mps"] == pytest.approx(TURN_MPS - TURN_MPS2)


def test_deceleration_ends_at_standstill():
    assert metrics(braking(duration_s=9.0))["mean_deceleration_mps2"] == pytest.approx(TURN_MPS2, rel=1e-3)


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

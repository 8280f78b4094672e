"""Steady-state handling of synthetic runs, whose gradients are known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from activesteer.analysis.handling import CarGeometry, car_of, evaluate, handling_metrics
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import SyntheticRun

CAR = CarGeometry(1.1, 1.5, 16.0)
EG, ROLL, REAR = 0.0045, 0.009, 0.004
"""Gradients of the synthetic car [rad/(m/s2)]."""


def run(
    kind: str = "slowly_increasing_steer",
    side: float = 1.0,
    knee_mps2: float = 4.0,
    top_mps2: float = 8.0,
    lag_rad: float = 0.0,
) -> SyntheticRun:
    """Lateral acceleration rises to its limit; above the knee, the steer angle rises faster than the line."""
    time_s = np.arange(40001) * 0.001
    ay = np.minimum(time_s / 35.0, 1.0) * top_mps2
    speed = np.full_like(ay, 22.0) if kind == "slowly_increasing_steer" else np.sqrt(np.maximum(ay, 0.01) * 100.0)
    curvature = ay / speed**2
    steer = lag_rad + CAR.wheelbase_m * curvature + EG * ay + 0.02 * np.maximum(ay - knee_mps2, 0.0)
    sideslip = CAR.cg_to_rear_m * curvature - REAR * ay
    channels = {
        "ay_mps2": ay, "steering_wheel_rad": CAR.steering_ratio * steer, "yaw_rate_radps": curvature * speed,
        "roll_rad": ROLL * ay, "sideslip_rad": sideslip,
    }  # fmt: skip
    recording = SyntheticRun(time_s, {name: side * values for name, values in channels.items()}, kind)
    recording.channels |= {"vx_mps": speed, "speed_mps": speed}
    recording.metadata["vehicle"] = {
        "single_track": {"cg_to_front_m": 1.1, "cg_to_rear_m": 1.5}, "steering": {"ratio": 16.0},
    }  # fmt: skip
    return recording


@pytest.mark.parametrize("kind", ["slowly_increasing_steer", "constant_radius"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_gradients_come_out_of_either_test_and_to_either_side(kind, side):
    found = evaluate(run(kind, side))
    assert found["understeer_gradient_radpmps2"] == pytest.approx(EG, rel=1e-6)
    assert found["characteristic_speed_mps"] == pytest.approx(math.sqrt(2.6 / EG), rel=1e-6)
    assert found["roll_gradient_radpmps2"] == pytest.approx(ROLL, rel=1e-6)
    assert found["rear_slip_gradient_radpmps2"] == pytest.approx(REAR, rel=1e-6)
    assert found["front_slip_gradient_radpmps2"] == pytest.approx(REAR + EG, rel=1e-6)


def test_understeer_gradient_is_steer_gradient_less_ackermann_gradient():
    found = evaluate(run())
    assert found["ackermann_gradient_radpmps2"] == pytest.approx(2.6 / 22.0**2, rel=1e-6)
    assert found["steer_gradient_radpmps2"] == pytest.approx(EG + 2.6 / 22.0**2, rel=1e-6)
    assert found["steering_wheel_gain_mps2prad"] == pytest.approx(1.0 / 16.0 / (EG + 2.6 / 22.0**2), rel=1e-6)


def test_gains_belong_to_constant_speed():
    found = evaluate(run("constant_radius"))
    assert math.isnan(found["yaw_rate_gain_1ps"])
    assert math.isnan(found["steering_wheel_gain_mps2prad"])


@pytest.mark.parametrize("lag_rad", [0.0, 0.02])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_linear_range_ends_where_the_steer_angle_is_five_percent_off(lag_rad, side):
    line = EG + 2.6 / 22.0**2
    expected = (0.02 * 4.0 + 0.05 * lag_rad) / (0.02 - 0.05 * line)
    found = evaluate(run(side=side, lag_rad=lag_rad))
    assert found["linear_range_mps2"] == pytest.approx(expected, abs=0.02)
    assert found["understeer_gradient_radpmps2"] == pytest.approx(EG, rel=1e-6)
    assert math.isnan(evaluate(run(knee_mps2=9.0, lag_rad=lag_rad))["linear_range_mps2"])


def test_limit_is_the_largest_acceleration():
    assert evaluate(run(top_mps2=7.5))["limit_acceleration_mps2"] == pytest.approx(7.5, rel=1e-6)


def test_run_that_stays_slow_is_an_error():
    with raises(RecordingError, value=pytest.approx(1.5)):
        evaluate(run(top_mps2=1.5))


def test_car_comes_from_the_metadata_or_the_caller():
    recording = run()
    assert car_of(recording) == CAR
    recording.metadata["vehicle"] = {}
    with raises(RecordingError, cause=KeyError):
        evaluate(recording)
    assert evaluate(recording, CAR)["understeer_gradient_radpmps2"] == pytest.approx(EG, rel=1e-6)


def test_metrics_are_all_numbers():
    values: dict[str, Any] = handling_metrics(run())
    assert all(isinstance(value, float) for value in values.values())
    assert values["speed_end_mps"] == 22.0

"""Metrics of a step steer and of a slow ramp."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis import step_response
from activesteer.analysis.step_response import (
    REFERENCE_MPS2,
    angle_at,
    follows_steering,
    step_response_metrics,
    without_response,
)
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import RAMP_S, STEP_S, SyntheticRun, first_order, second_order, step_steer

SIGNED = ("_steady_state_", "_peak_rad", "_peak_mps2")


def test_time_counts_from_half_of_the_steering_angle():
    assert step_response_metrics(step_steer())["step_time_s"] == pytest.approx(STEP_S, abs=1e-6)


def test_step_time_is_interpolated_in_a_coarse_recording():
    coarse = step_steer(timestep_s=0.03)
    assert step_response_metrics(coarse)["step_time_s"] == pytest.approx(STEP_S, abs=1e-6)


def test_every_signal_has_its_metrics():
    values = step_response_metrics(step_steer())
    for name, unit in (("yaw_rate", "radps"), ("ay", "mps2"), ("roll", "rad"), ("sideslip", "rad")):
        for metric in (f"steady_state_{unit}", "response_time_s", f"peak_{unit}", "peak_time_s", "overshoot"):
            assert f"{name}_{metric}" in values


def test_values_are_those_of_the_formulas():
    values = step_response_metrics(step_steer(sideslip_rad=-0.02, rear_rad=-0.015, superposition_rad=0.01))
    root = math.sqrt(0.75)
    peak_time_s = math.pi / (9.0 * root)
    assert values["yaw_rate_steady_state_radps"] == pytest.approx(0.2, rel=1e-6)
    assert values["yaw_rate_overshoot"] == pytest.approx(math.exp(-math.pi * 0.5 / root), abs=2e-4)
    assert values["yaw_rate_peak_time_s"] == pytest.approx(peak_time_s, abs=6e-4)
    assert values["ay_response_time_s"] == pytest.approx(0.2 * math.log(10.0), abs=1e-5)
    assert values["sideslip_response_time_s"] == pytest.approx(0.3 * math.log(10.0), abs=1e-5)
    assert values["tb_srad"] == pytest.approx(peak_time_s * 0.02, abs=2e-5)
    assert values["steering_wheel_max_rate_radps"] == pytest.approx(1.0 / RAMP_S, rel=1e-6)
    assert values["steering_wheel_steady_state_rad"] == pytest.approx(1.0)
    assert values["rear_steer_steady_state_rad"] == pytest.approx(-0.015, rel=1e-6)
    assert values["superposition_steady_state_rad"] == pytest.approx(0.01, rel=1e-6)
    assert values["speed_end_mps"] == pytest.approx(22.0)


def test_the_peak_of_the_sideslip_angle_is_found_on_either_side():
    run = step_steer(sideslip_rad=0.001)
    run.channels["sideslip_rad"] -= 0.003 * np.exp(-(((run.time_s - STEP_S - 0.3) / 0.05) ** 2))
    values = step_response_metrics(run)
    assert values["sideslip_peak_abs_rad"] == pytest.approx(0.0024, abs=5e-4)
    assert values["sideslip_peak_rad"] == pytest.approx(0.001, abs=1e-4)


def test_a_turn_to_the_right_is_the_mirror_image():
    left, right = (step_response_metrics(step_steer(side=side, rear_rad=-0.01)) for side in (1.0, -1.0))
    for name, value in left.items():
        sign = -1.0 if any(part in name for part in SIGNED) else 1.0
        assert right[name] == pytest.approx(sign * value, rel=1e-12, nan_ok=True), name


def test_a_yaw_rate_without_a_peak_has_no_time_of_it():
    values = step_response_metrics(step_steer(yaw=first_order))
    assert math.isnan(values["yaw_rate_peak_time_s"])
    assert math.isnan(values["tb_srad"])


def test_overshoot_grows_when_damping_falls():
    loose, tight = (
        step_response_metrics(step_steer(yaw=lambda t, d=damping: second_order(t, damping=d)))["yaw_rate_overshoot"]
        for damping in (0.4, 0.8)
    )
    assert loose > tight > 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("share", "follows"), [(0.11, True), (0.09, False), (-0.5, False)])
def test_a_car_follows_the_steering_from_a_tenth_of_the_desired_yaw_rate(side, share, follows):
    run = step_steer(side=side)
    run.channels["yaw_rate_radps"] = share * run["yaw_rate_radps"]
    assert follows_steering(run) is follows
    shown = without_response(run, values := step_response_metrics(run))
    hidden = {name for name in values if not math.isnan(values[name]) and math.isnan(shown[name])}
    assert hidden == (
        set()
        if follows
        else {
            name
            for name in values
            if name.endswith(("_time_s", "_overshoot", "tb_srad"))
            and name != "step_time_s"
            and not math.isnan(values[name])
        }
    )
    run.metadata["maneuver"]["kind"] = "open_loop"
    assert follows_steering(run)


def with_steering(values: np.ndarray, run: SyntheticRun) -> SyntheticRun:
    return SyntheticRun(run.time_s, {**run.channels, "steering_wheel_rad": values})


def test_straight_driving_is_no_step():
    run = step_steer()
    with raises(RecordingError, value=0.0, allowed=step_response.MIN_STEP_RAD):
        step_response_metrics(with_steering(np.zeros_like(run.time_s), run))


def test_a_wheel_that_is_turned_from_the_start_is_no_step():
    run = step_steer()
    with raises(RecordingError, value=0.5):
        step_response_metrics(with_steering(np.full_like(run.time_s, 0.5), run))


def test_a_run_that_ends_early_is_refused():
    with raises(RecordingError, value=pytest.approx(1.5), allowed=2.0):
        step_response_metrics(step_steer(duration_s=2.5))


def test_a_steering_angle_that_is_not_a_number_is_no_step():
    run = step_steer()
    with raises(RecordingError, allowed=step_response.MIN_STEP_RAD):
        step_response_metrics(with_steering(np.full_like(run.time_s, np.nan), run))


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

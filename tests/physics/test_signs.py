"""Signs by ISO 8855 and ISO-W, from a left and a right turn."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from activesteer.recording import Recording
from tests.physics.runs import corners, last, run, step_steer

Turn = tuple[float, Callable[[str], float], Recording]


@pytest.fixture(scope="module", params=[1.0, -1.0], ids=["left", "right"])
def turn(request: pytest.FixtureRequest) -> Turn:
    """Return the sign of the turn and the mean of each channel over the settled end of it."""
    side = request.param
    recording = step_steer(side=side)
    end = last(recording, 0.5)
    return side, lambda name: float(recording[name][end].mean()), recording


def test_steering_left_turns_the_wheels_left(turn: Turn) -> None:
    side, mean, _ = turn
    assert side * mean("steering_wheel_rad") > 0.5
    assert side * mean("front_steer_rad") > 0.02
    assert side * mean("fl_steer_rad") > 0.02
    assert side * mean("fr_steer_rad") > 0.02
    assert side * mean("rack_m") > 0.0


def test_the_car_turns_to_the_side_it_is_steered_to(turn: Turn) -> None:
    side, mean, recording = turn
    assert side * mean("yaw_rate_radps") > 0.1
    assert side * mean("ay_mps2") > 3.0
    assert side * recording["yaw_rad"][-1] > 0.5
    assert side * recording["y_m"][-1] > 10.0
    assert recording["x_m"][-1] > 50.0


def test_the_body_rolls_out_of_the_turn(turn: Turn) -> None:
    """ISO 8855: roll to the right is positive, in a left turn."""
    side, mean, _ = turn
    assert 0.01 < side * mean("roll_rad") < 0.1


def test_front_tyres_push_into_the_turn_at_negative_slip_angle(turn: Turn) -> None:
    side, mean, _ = turn
    for corner in ("fl", "fr"):
        assert side * mean(f"{corner}_tyre_fy_N") > 500.0
        assert side * mean(f"{corner}_slip_angle_rad") < -0.005


def test_rear_tyres_push_into_the_turn_too(turn: Turn) -> None:
    side, mean, _ = turn
    assert side * (mean("rl_tyre_fy_N") + mean("rr_tyre_fy_N")) > 1000.0


def test_aligning_moment_turns_the_front_wheels_back(turn: Turn) -> None:
    side, mean, _ = turn
    assert side * (mean("fl_tyre_mz_Nm") + mean("fr_tyre_mz_Nm")) < -20.0


def test_the_outer_wheels_are_loaded(turn: Turn) -> None:
    side, mean, _ = turn
    for left, right in (("fl", "fr"), ("rl", "rr")):
        assert side * (mean(f"{right}_tyre_fz_N") - mean(f"{left}_tyre_fz_N")) > 500.0
        assert side * (mean(f"{right}_travel_m") - mean(f"{left}_travel_m")) > 0.01


def test_the_outer_wheels_turn_faster(turn: Turn) -> None:
    side, mean, _ = turn
    for left, right in (("fl", "fr"), ("rl", "rr")):
        assert side * (mean(f"{right}_wheel_speed_radps") - mean(f"{left}_wheel_speed_radps")) > 0.3


def test_sideslip_is_positive_just_after_a_left_step() -> None:
    """The car moves sideways before it yaws: the centre of gravity follows the front axle at once."""
    recording = step_steer()
    onset = (recording.time_s > 0.52) & (recording.time_s < 0.62)
    assert recording["sideslip_rad"][onset].max() > 1e-4
    assert recording["vy_mps"][onset].max() > 2e-3


def test_acceleration_and_braking_pitch_the_car() -> None:
    recording = run("drive_off_and_stop")
    driving = (recording.time_s > 2.0) & (recording.time_s < 4.0)
    braking = (recording.time_s > 7.5) & (recording.time_s < 8.5)
    level_rad = recording["pitch_rad"][0]
    assert recording["ax_mps2"][driving].mean() > 1.0
    assert recording["pitch_rad"][driving].mean() < level_rad - 1e-3
    assert corners(recording, "slip_ratio")[driving][:, :2].mean() > 0.0
    assert recording["ax_mps2"][braking].mean() < -1.0
    assert recording["pitch_rad"][braking].mean() > level_rad + 1e-3
    assert corners(recording, "slip_ratio")[braking].max() < 0.0
    assert np.all(corners(recording, "tyre_fx_N")[braking].sum(axis=1) < 0.0)

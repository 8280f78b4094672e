"""The desired yaw rate: steady state, limit, lag (Dorsch 2012, eqs. 3 and 6)."""

from __future__ import annotations

import math

import pytest

from activesteer.controllers import SingleTrack
from activesteer.controllers.corrector import DesiredYawRate
from activesteer.controllers.parameters import DesiredYawRateParameters
from tests.unit.controllers.cars import CAR

MODEL = SingleTrack(CAR)
SETTLED = 2000


def desired(timestep_s: float = 0.001, **parameters: float) -> DesiredYawRate:
    return DesiredYawRate(MODEL, DesiredYawRateParameters(**parameters), timestep_s)


def settled(block: DesiredYawRate, front_steer_rad: float, speed_mps: float) -> float:
    return [block.step(front_steer_rad, speed_mps) for _ in range(SETTLED)][-1]


@pytest.mark.parametrize("speed_mps", [0.5, 5.0, 22.2, 40.0])
def test_small_angles_settle_at_the_single_track_gain(speed_mps):
    assert settled(desired(), 0.001, speed_mps) == pytest.approx(0.001 * MODEL.yaw_rate_gain(speed_mps), rel=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("speed_mps", [10.0, 22.2, 40.0])
def test_large_angles_settle_at_the_lateral_acceleration_that_is_assumed(speed_mps, side):
    block = desired(max_lateral_acceleration_mps2=4.0)
    assert settled(block, side * 0.5, speed_mps) == pytest.approx(side * 4.0 / speed_mps, rel=1e-9)


def test_step_reaches_63_percent_after_the_delay():
    block = desired(delay_s=0.08)
    values = [block.step(0.001, 20.0) for _ in range(81)]
    final = 0.001 * MODEL.yaw_rate_gain(20.0)
    # Exact for an input held between steps, at every step; the first answer is that of the instant of the step.
    for count, value in enumerate(values):
        assert value == pytest.approx(final * (1.0 - math.exp(-count * 0.001 / 0.08)), rel=1e-12)
    assert values[-1] / final == pytest.approx(0.632, abs=1e-3)


def test_limit_acts_before_the_lag_so_that_leaving_it_is_not_delayed():
    block = desired(delay_s=0.06)
    settled(block, 0.5, 20.0)
    first, second = block.step(0.0, 20.0), block.step(0.0, 20.0)
    assert second == pytest.approx(first * math.exp(-0.001 / 0.06), rel=1e-9)


def test_step_size_does_not_change_the_answer():
    coarse, fine = desired(timestep_s=0.001), desired(timestep_s=0.00025)
    slow = [coarse.step(0.01, 20.0) for _ in range(100)]
    quick = [fine.step(0.01, 20.0) for _ in range(400)]
    assert quick[::4] == pytest.approx(slow, rel=1e-12)


def test_left_and_right_are_mirrored_to_the_bit():
    left, right = desired(), desired()
    for count in range(300):
        angle_rad = 0.02 * math.sin(0.05 * count)
        assert left.step(angle_rad, 25.0) == -right.step(-angle_rad, 25.0)


def test_standing_car_is_not_asked_to_yaw_and_a_reversing_one_yaws_the_other_way():
    assert settled(desired(), 0.3, 0.0) == 0.0
    assert settled(desired(), 0.3, -2.0) == pytest.approx(0.3 * MODEL.yaw_rate_gain(-2.0), rel=1e-9)
    assert settled(desired(), 0.3, -2.0) < 0.0

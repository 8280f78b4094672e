"""The foot of a driver whose wheels spin: start, return and reset."""

from __future__ import annotations

import pytest

from tests.unit.driver.drives import DRIVE, parameters
from tests.unit.driver.test_driver import RADIUS_M, at, speed_hold

SPEED_MPS, SPINNING_MPS = 10.0, 8.0


def full_torque_Nm(faster_mps: float) -> float:
    """Torque of the engine at full throttle."""
    return DRIVE.limits_Nm((SPEED_MPS + faster_mps) / RADIUS_M, 1)[1]


@pytest.mark.parametrize("part", [0.3, 0.6])
def test_foot_is_taken_back_from_where_it_stands(part):
    known = parameters()
    # A speed error that asks for a part of what the engine gives.
    error_mps = part * full_torque_Nm(SPINNING_MPS) / (known.speed_gain_1ps * 1400.0 * RADIUS_M)
    torque_Nm = speed_hold().step(SPEED_MPS + error_mps, at(SPEED_MPS, SPINNING_MPS))
    kept = 1.0 - 0.001 / known.foot_lag_s
    assert torque_Nm == pytest.approx(kept * part * full_torque_Nm(SPINNING_MPS), rel=1e-6)


def test_foot_returns_to_the_floor_and_the_engine_gives_all_again():
    block, known = speed_hold(), parameters()
    for _ in range(200):
        block.step(40.0, at(SPEED_MPS, SPINNING_MPS))
    steps = round(1e3 / known.foot_return_per_s)
    torques_Nm = [block.step(40.0, at(SPEED_MPS)) for _ in range(steps)]
    assert torques_Nm[0] < 0.5 * full_torque_Nm(0.0)
    assert torques_Nm[-1] == pytest.approx(full_torque_Nm(0.0))
    assert block.step(40.0, at(SPEED_MPS)) == pytest.approx(full_torque_Nm(0.0))


def test_reset_forgets_the_foot_and_the_limit():
    block = speed_hold()
    for _ in range(200):
        block.step(40.0, at(SPEED_MPS, SPINNING_MPS))
    assert block.saturated
    block.reset()
    assert not block.saturated
    assert block.step(40.0, at(SPEED_MPS)) == pytest.approx(full_torque_Nm(0.0))

"""Backwards, through standstill, and forwards again: forces stay continuous and nothing creeps or jumps."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer import simulate
from activesteer.core.conventions import CORNERS

REVERSAL = {
    "kind": "open_loop",
    "name": "reversal",
    "speed_mps": 0.0,
    "duration_s": 12.0,
    "settle_s": 0.5,
    "speed": {"time_s": [1.0, 3.0, 5.0, 9.0], "speed_mps": [0.0, -3.0, -3.0, 3.0]},
    "steering": {"time_s": [0.0], "steering_wheel_deg": [60.0]},
}


@pytest.fixture(scope="module")
def reversal():
    return simulate(REVERSAL)


def test_the_car_follows_the_speed_through_standstill(reversal):
    speed_mps = reversal["vx_mps"]
    assert speed_mps[4900] == pytest.approx(-3.0, abs=0.3)
    assert speed_mps[-1] == pytest.approx(3.0, abs=0.3)
    assert np.abs(np.diff(speed_mps)).max() < 0.01


def test_the_yaw_rate_turns_with_the_direction_of_travel(reversal):
    assert reversal["yaw_rate_radps"][4900] < -0.05 < 0.05 < reversal["yaw_rate_radps"][-1]


def test_no_tyre_force_jumps_where_the_direction_changes(reversal):
    for corner in CORNERS:
        for force in ("fx", "fy", "fz"):
            assert np.abs(np.diff(reversal[f"{corner}_tyre_{force}_N"])).max() < 100.0

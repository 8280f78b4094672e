"""Full braking from 80 km/h on mu 0.8 without anti-lock system: the front wheels lock first (UN R13-H)."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer import simulate

FULL_BRAKING = {
    "kind": "open_loop",
    "name": "full_braking",
    "speed_kmh": 80,
    "duration_s": 2.5,
    "road": {"mu": 0.8},
    "brake": {"time_s": [0.5, 1.5], "pedal": [0.0, 1.0]},
}


@pytest.fixture(scope="module")
def braking():
    return simulate(FULL_BRAKING, overrides={"vehicle.brakes.abs": False})


def locked_at_s(recording, corner):
    locked = np.flatnonzero(recording[f"{corner}_slip_ratio"] < -0.5)
    return recording.time_s[locked[0]] if locked.size else np.inf


def test_the_front_wheels_lock_before_the_rear_ones(braking):
    front = max(locked_at_s(braking, "fl"), locked_at_s(braking, "fr"))
    rear = min(locked_at_s(braking, "rl"), locked_at_s(braking, "rr"))
    assert np.isfinite(front)
    assert front < rear


def test_the_car_stays_straight_and_decelerates_by_what_the_road_bears(braking):
    assert np.abs(braking["yaw_rad"]).max() < 1e-6
    assert -0.95 * 9.81 < braking["ax_mps2"].min() < -0.7 * 9.81

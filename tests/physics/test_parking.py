"""Steering from lock to lock at rest: the twisted contact patch resists, slides, and springs back."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from tests.physics.runs import run


@pytest.fixture(scope="module")
def parking():
    return run("parking")


@pytest.mark.parametrize("corner", ["fl", "fr"])
def test_the_aligning_moment_resists_the_turning_of_the_wheel(parking, corner):
    time_s, moment_Nm = parking.time_s, parking[f"{corner}_tyre_mz_Nm"]
    assert moment_Nm[np.searchsorted(time_s, 3.5)] < -50.0  # turning left
    assert moment_Nm[np.searchsorted(time_s, 10.5)] > 50.0  # turning right


@pytest.mark.parametrize("corner", ["fl", "fr"])
def test_the_moment_levels_off_below_that_of_a_sliding_patch(parking, corner):
    # A patch of radius r that slides about its middle under even pressure bears 2/3 mu Fz r.
    mu, half_length_m = 0.9, 0.085
    most_Nm = 2.0 / 3.0 * mu * parking[f"{corner}_tyre_fz_N"].max() * half_length_m
    moment_Nm = np.abs(parking[f"{corner}_tyre_mz_Nm"])
    assert 0.3 * most_Nm < moment_Nm.max() < most_Nm
    late = (parking.time_s > 9.0) & (parking.time_s < 10.9)
    assert np.ptp(moment_Nm[late]) < 0.05 * moment_Nm.max()


@pytest.mark.parametrize("corner", ["fl", "fr"])
def test_the_twist_stays_when_the_steering_wheel_is_held(parking, corner):
    held = (parking.time_s > 13.0) & (parking.time_s < 14.0)
    assert np.ptp(parking[f"{corner}_tyre_mz_Nm"][held]) < 1.0
    assert np.abs(parking[f"{corner}_tyre_mz_Nm"][held]).min() > 50.0


def test_no_force_jumps_and_the_car_stays_where_it_is(parking):
    for corner in CORNERS:
        for force in ("fx", "fy", "fz"):
            assert np.abs(np.diff(parking[f"{corner}_tyre_{force}_N"])).max() < 100.0
    assert np.ptp(parking["x_m"]) < 0.05
    assert np.ptp(parking["y_m"]) < 0.05

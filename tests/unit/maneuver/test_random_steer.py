"""Random steering: its band, its size and its seed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import signal

from activesteer.errors import ManeuverError
from activesteer.maneuver.steering_tests import RandomSteer
from tests.raising import raises
from tests.unit.maneuver.made import made

TIME_S = np.arange(0.0, 60.0, 0.01)


def steering(**keys: Any) -> RandomSteer:
    table = {"kind": "random_steer", "speed_kmh": 80, "duration_s": 60.0}
    asked = {"rms_deg": 8.0, "lowest_Hz": 0.2, "highest_Hz": 4.0, "fade_s": 1.0}
    return made(RandomSteer, {**table, "random": asked | keys})


def angles_deg(maneuver: RandomSteer) -> np.ndarray:
    return np.degrees([maneuver.setpoint(time_s).steering_wheel_demand_rad for time_s in TIME_S])


def test_begins_straight_ahead_and_has_its_root_mean_square():
    angles = angles_deg(steering())
    assert angles[0] == 0.0
    assert np.abs(angles[:10]).max() < 0.5
    assert np.sqrt(np.mean(angles[100:] ** 2)) == pytest.approx(8.0, rel=0.03)
    assert 2.5 < np.abs(angles).max() / 8.0 < 5.0


def test_power_is_the_same_throughout_the_band_and_nowhere_else():
    frequency_Hz, power = signal.welch(angles_deg(steering(fade_s=0.0)), fs=100.0, nperseg=1000)
    inside = (frequency_Hz > 0.4) & (frequency_Hz < 3.8)
    assert power[inside].mean() == pytest.approx(8.0**2 / 3.8, rel=0.1)
    assert power[inside & (frequency_Hz < 2.0)].mean() == pytest.approx(power[inside].mean(), rel=0.2)
    assert power[frequency_Hz > 4.5].max() < 1e-3 * power[inside].mean()


def test_seed_says_which_signal_it_is():
    assert (angles_deg(steering(seed=1)) == angles_deg(steering(seed=1))).all()
    assert abs(np.corrcoef(angles_deg(steering(seed=1)), angles_deg(steering(seed=2)))[0, 1]) < 0.2


@pytest.mark.parametrize("highest_Hz", [0.25, 25.0])
def test_band_that_cannot_be_driven_is_an_error(highest_Hz):
    with raises(ManeuverError, file="mine.toml", key="random.highest_Hz"):
        steering(highest_Hz=highest_Hz)

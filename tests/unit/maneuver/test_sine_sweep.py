"""Sine sweep: a small sine of rising frequency."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.steering_tests import SineSweep
from tests.raising import raises
from tests.unit.maneuver.made import made

TIME_S = np.arange(0.0, 30.0, 0.001)


def sweep(**keys: Any) -> SineSweep:
    table = {"kind": "sine_sweep", "speed_kmh": 80, "duration_s": 30.0}
    asked = {"start_s": 1.0, "length_s": 28.0, "first_Hz": 0.2, "last_Hz": 4.0, "fade_s": 0.5, "amplitude_deg": 9.0}
    return made(SineSweep, {**table, "sweep": asked | keys})


def angles_deg(maneuver: SineSweep) -> np.ndarray:
    return np.degrees([maneuver.setpoint(time_s).steering_wheel_demand_rad for time_s in TIME_S])


def test_begins_and_ends_straight_ahead_and_reaches_its_amplitude():
    angles = angles_deg(sweep())
    assert not angles[TIME_S <= 1.0].any()
    assert not angles[TIME_S >= 29.0].any()
    assert np.abs(angles).max() == pytest.approx(9.0, rel=1e-3)


def test_frequency_rises_from_the_first_to_the_last():
    angles = angles_deg(sweep())
    upward = TIME_S[1:][(angles[:-1] < 0.0) & (angles[1:] >= 0.0)]
    frequencies = 1.0 / np.diff(upward)
    assert np.diff(frequencies).min() > -0.05
    assert frequencies[0] == pytest.approx(0.3, abs=0.1)
    assert frequencies[-2] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(
    ("keys", "key"),
    [({"last_Hz": 0.1}, "sweep.last_Hz"), ({"length_s": 40.0}, "sweep.length_s"), ({"fade_s": 20.0}, "sweep.fade_s")],
)
def test_sweep_that_cannot_be_driven_is_an_error(keys, key):
    with raises(ManeuverError, file="mine.toml", key=key):
        sweep(**keys)

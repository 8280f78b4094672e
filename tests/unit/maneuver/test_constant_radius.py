"""Setpoints of the constant radius: curvature and speed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.follow_path import ConstantRadius
from tests.raising import raises
from tests.unit.maneuver.made import made


def circle(**keys: Any) -> ConstantRadius:
    table = {"kind": "constant_radius", "speed_mps": 6.0, "duration_s": 60.0, "circle": keys}
    return made(ConstantRadius, table)


@pytest.mark.parametrize("radius_m", [100.0, -40.0])
def test_curvature_rises_smoothly_to_that_of_the_circle(radius_m):
    maneuver = circle(radius_m=radius_m, entry_s=4.0)
    asked = (
        np.array([maneuver.setpoint(time_s).curvature_demand_1pm for time_s in np.linspace(0.0, 10.0, 1001)]) * radius_m
    )
    assert asked[0] == 0.0
    assert asked[400:] == pytest.approx(1.0)
    assert np.diff(asked).min() >= -1e-12
    assert np.diff(asked)[0] < 1e-3 * np.diff(asked).max() * 10


def test_speed_rises_after_the_entry_and_stops_at_its_end():
    maneuver = circle(entry_s=4.0, acceleration_mps2=0.5, end_speed_mps=16.0)
    for time_s, speed_mps in {0.0: 6.0, 4.0: 6.0, 14.0: 11.0, 24.0: 16.0, 50.0: 16.0}.items():
        assert maneuver.setpoint(time_s).speed_demand_mps == pytest.approx(speed_mps)


def test_car_settles_straight_ahead():
    assert circle().settling_setpoint().curvature_demand_1pm == 0.0


@pytest.mark.parametrize(
    ("keys", "key"), [({"radius_m": 5.0}, "circle.radius_m"), ({"end_speed_kmh": 20.0}, "circle.end_speed_kmh")]
)
def test_circle_that_cannot_be_driven_is_an_error(keys, key):
    with raises(ManeuverError, file="mine.toml", key=key):
        circle(**keys)

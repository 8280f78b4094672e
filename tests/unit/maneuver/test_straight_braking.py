"""Setpoints of braking straight ahead."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.braking import StraightBraking
from tests.raising import raises
from tests.unit.maneuver.made import made


def maneuver(**keys: Any) -> StraightBraking:
    table = {"kind": "straight_braking", "speed_kmh": 100, "duration_s": 6.0, "brake": {"start_s": 0.5, "pedal": 0.8}}
    return made(StraightBraking, table | keys)


def test_the_speed_is_held_until_the_brake_is_pressed() -> None:
    asked = maneuver(brake={"start_s": 0.5, "rise_s": 0.2, "pedal": 0.8})
    pedal = [asked.setpoint(time_s).brake_pedal for time_s in (0.0, 0.5, 0.6, 0.7, 6.0)]
    assert pedal == pytest.approx([0.0, 0.0, 0.4, 0.8, 0.8])
    assert [asked.setpoint(time_s).hold_speed for time_s in (0.0, 0.499, 0.5, 6.0)] == [True, True, False, False]


def test_the_line_is_straight_and_long_enough() -> None:
    asked = maneuver()
    assert asked.course is not None
    path = asked.course.path
    assert path is asked.setpoint(1.0).path
    assert not np.any(path.y_m)
    assert path.x_m[-1] == pytest.approx(100 / 3.6 * 6.0)


def test_without_a_line_the_steering_wheel_is_held() -> None:
    asked = maneuver(hold_line=False)
    assert asked.course is None
    assert (asked.setpoint(1.0).path, asked.setpoint(1.0).steering_wheel_demand_rad) == (None, 0.0)


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"brake": {"start_s": 5.95, "pedal": 1.0}}, "brake.start_s"),
        ({"speed_kmh": 5}, "speed_kmh"),
        ({"speed_kmh": -50}, "speed_kmh"),
        ({"brake": {"pedal": 1.5}}, "brake.pedal"),
    ],
)
def test_what_cannot_be_driven_is_an_error(keys: dict[str, Any], key: str) -> None:
    with raises(ManeuverError, key=key):
        maneuver(**keys)

"""Open-loop manoeuvres: tables over time."""

from __future__ import annotations

import math
from typing import Any

import pytest

from activesteer.config import Source
from activesteer.errors import ManeuverError
from activesteer.maneuver import build_maneuver
from activesteer.maneuver.open_loop import OpenLoop
from tests.raising import raises

SOURCE = Source("mine.toml", error=ManeuverError)


def open_loop(**keys: Any) -> OpenLoop:
    built = build_maneuver({"kind": "open_loop", "speed_kmh": 36, "duration_s": 5.0} | keys, SOURCE)
    assert isinstance(built, OpenLoop)
    return built


def test_nothing_is_asked_but_the_speed_where_no_table_is_given():
    setpoint = open_loop().setpoint(2.0)
    assert (setpoint.steering_wheel_demand_rad, setpoint.speed_demand_mps, setpoint.brake_pedal) == (0.0, 10.0, 0.0)
    assert setpoint.hold_speed


def test_tables_are_linear_between_their_times_and_constant_outside():
    maneuver = open_loop(hold_last=True, steering={"time_s": [1.0, 2.0, 4.0], "steering_wheel_deg": [0.0, 90.0, -90.0]})
    asked = {0.0: 0.0, 1.0: 0.0, 1.5: 45.0, 2.0: 90.0, 3.0: 0.0, 4.0: -90.0, 9.0: -90.0}
    for time_s, angle_deg in asked.items():
        assert math.degrees(maneuver.setpoint(time_s).steering_wheel_demand_rad) == pytest.approx(angle_deg, abs=1e-12)


SHORT = {"time_s": [0.0, 4.9], "steering_wheel_deg": [0.0, 90.0]}


@pytest.mark.parametrize(
    ("key", "table"), [("steering", SHORT), ("wheel_torques", {"time_s": [0.0, 4.9], "fl_drive_Nm": [0.0, 90.0]})]
)
def test_table_that_ends_before_the_manoeuvre_is_not_prolonged_without_a_word(key, table):
    with pytest.raises(ManeuverError) as told:
        open_loop(**{key: table})
    assert told.value.key == f"{key}.time_s"
    for words in ("4.9 s", "duration_s = 5", "hold_last = true"):
        assert words in str(told.value)
    assert open_loop(**{key: table}, hold_last=True).duration_s == 5.0
    assert open_loop(**{key: table, "duration_s": 4.9}).duration_s == 4.9


def test_table_of_one_time_is_constant():
    assert open_loop(brake={"time_s": [0.0], "pedal": [0.4]}).setpoint(3.0).brake_pedal == 0.4


def test_drive_is_off_while_the_brake_is_pressed():
    maneuver = open_loop(brake={"time_s": [1.0, 1.5, 2.0], "pedal": [0.0, 0.5, 0.0]})
    assert [maneuver.setpoint(time_s).hold_speed for time_s in (1.0, 1.25, 1.5, 2.0)] == [True, False, False, True]


def test_coasting_car_is_not_driven():
    assert not open_loop(drive="coast").setpoint(1.0).hold_speed


def test_speed_follows_its_table():
    maneuver = open_loop(speed={"time_s": [1.0, 3.0], "speed_kmh": [36.0, 72.0]})
    assert [maneuver.setpoint(time_s).speed_demand_mps for time_s in (0.0, 2.0, 4.0)] == pytest.approx(
        [10.0, 15.0, 20.0]
    )


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"drive": "cruise"}, "drive"),
        ({"steering": {"time_s": [0, 1], "steering_wheel_deg": [0]}}, "steering.steering_wheel_rad"),
        ({"brake": {"time_s": [], "pedal": []}}, "brake.time_s"),
        ({"speed": {"time_s": [0, 2, 2], "speed_kmh": [0, 1, 2]}}, "speed.time_s"),
        ({"brake": {"time_s": [0], "pedal": [1.5]}}, "brake.pedal"),
        ({"speed": {"time_s": [0]}}, "speed.speed_mps"),
    ],
)
def test_wrong_table_is_answered_with_file_and_key(keys, key):
    with raises(ManeuverError, file="mine.toml", key=key):
        open_loop(**keys)


@pytest.mark.parametrize(("table", "key"), [({"speed_kmh": 80}, "kind"), ({"kind": "step_ster"}, "kind")])
def test_unknown_kind_is_answered_with_the_known_ones(table, key):
    with raises(ManeuverError, file="mine.toml", key=key):
        build_maneuver(table, SOURCE)

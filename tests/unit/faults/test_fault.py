"""Valid descriptions of a fault, and the errors for others."""

from __future__ import annotations

import math
from typing import Any

import pytest

from activesteer.config.faults import ACTUATORS, KINDS, SENSORS, Fault, fault_table, faults_text
from activesteer.errors import ManeuverError, ParameterError
from activesteer.scenario import resolve
from tests.raising import raises


def faults_of(*tables: dict[str, Any]) -> tuple[Fault, ...]:
    return resolve("straight_line", overrides={"fault": list(tables)}).maneuver.fault


@pytest.mark.parametrize(
    ("text", "table"),
    [
        ("rear:stuck@2.0", {"part": "rear", "kind": "stuck", "start_s": 2.0}),
        (
            "rear:offset=-1.5deg@2-3.5",
            {"part": "rear", "kind": "offset", "start_s": 2.0, "end_s": 3.5, "size_deg": -1.5},
        ),
        ("rear_left:runaway=right@.5", {"part": "rear_left", "kind": "runaway", "start_s": 0.5, "side": "right"}),
        (
            "fl_brake_pressure_sensor:offset=5e5Pa@1",
            {
                "part": "fl_brake_pressure_sensor",
                "kind": "offset",
                "start_s": 1.0,
                "size_Pa": 5e5,
            },
        ),
        ("ay_sensor:delayed=0.1s@1", {"part": "ay_sensor", "kind": "delayed", "start_s": 1.0, "delay_s": 0.1}),
    ],
)
def test_the_command_line_s_form_is_a_table(text: str, table: dict[str, Any]) -> None:
    assert fault_table(text) == table


@pytest.mark.parametrize("text", ["rear", "rear:stuck", "rear:stuck@", "rear:stuck@x", "rear:offset=1@2", "a:b@1-2-3"])
def test_what_is_no_fault_is_said_with_the_form(text: str) -> None:
    with raises(ParameterError, key="--fault", value=text):
        fault_table(text)


def test_a_unit_of_the_edge_fills_the_si_field() -> None:
    (fault,) = faults_of(fault_table("yaw_rate_sensor:offset=90degps@1"))
    assert fault.size_radps == pytest.approx(1.5708, abs=1e-4)
    assert fault.name == "yaw_rate_sensor:offset=90degps"


@pytest.mark.parametrize("part", SENSORS)
def test_every_sensor_can_be_off(part: str) -> None:
    (fault,) = faults_of({"part": part, "kind": "offset", "start_s": 1.0, f"size_{SENSORS[part]}": 0.5})
    assert fault.size == 0.5


def test_every_signal_that_a_controller_gets_can_fail() -> None:
    assert {"yaw_rate_sensor", "ay_sensor", "steering_wheel_sensor", "rear_steer_sensor", "rr_wheel_speed_sensor"} <= {
        *SENSORS
    }
    assert not {*SENSORS} & {*ACTUATORS}


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ({"part": "raer", "kind": "stuck", "start_s": 1.0}, "part", "raer"),
        ({"part": "rear", "kind": "broken", "start_s": 1.0}, "kind", "broken"),
        ({"part": "rear", "kind": "stuck"}, "start_s", None),
        ({"part": "rear", "kind": "stuck", "start_s": 1.0, "size_deg": 1.0}, "size_rad", None),
        ({"part": "rear", "kind": "offset", "start_s": 1.0}, "size_rad", None),
        ({"part": "rear", "kind": "offset", "start_s": 1.0, "size_radps": 1.0}, "size_radps", None),
        ({"part": "rear", "kind": "offset", "start_s": 1.0, "size_deg": 0.0}, "size_rad", 0.0),
        ({"part": "rear", "kind": "runaway", "start_s": 1.0, "side": "up"}, "side", "up"),
        ({"part": "rear", "kind": "stuck", "start_s": 2.0, "end_s": 1.0}, "end_s", 1.0),
        ({"part": "rear", "kind": "stuck", "start_s": 99.0}, "start_s", 99.0),
        ({"part": "yaw_rate_sensor", "kind": "float", "start_s": 1.0}, "kind", "float"),
        ({"part": "fl_brake", "kind": "float", "start_s": 1.0}, "kind", "float"),
        ({"part": "fl_brake", "kind": "offset", "start_s": 1.0, "size_deg": 1.0}, "size_rad", None),
        ({"part": "rear", "kind": "stuck", "start_s": 1.0, "tiem": 2.0}, "tiem", None),
    ],
)
def test_what_cannot_be_or_has_no_effect_is_said(table: dict[str, Any], key: str, value: Any) -> None:
    with raises(ManeuverError, key=f"fault.0.{key}", value=value) as caught:
        faults_of(table)
    assert "\n" not in str(caught.value)


def test_one_part_has_one_fault_at_a_time() -> None:
    stuck = fault_table("rear:stuck@1-2")
    with raises(ManeuverError, key="fault.1"):
        faults_of(stuck, fault_table("rear_left:float@1.5"))
    assert len(faults_of(stuck, fault_table("rear_left:float@2"), fault_table("superposition:stuck@1"))) == 2 + 1


@pytest.mark.parametrize(
    ("text", "now_s", "name"),
    [
        ("rear:stuck@1", 1.0, "rear:stuck"),
        ("rear:stuck@1", 0.5, "rear:stuck@1"),
        ("rear:offset=1deg@1-2", 1.0, "rear:offset=1deg@1-2"),
        ("rear:delayed=0.1s@1.5", 2.0, "rear:delayed=0.1s"),
    ],
)
def test_a_name_has_its_time_unless_it_begins_now_and_has_no_end(text: str, now_s: float, name: str) -> None:
    [fault] = faults_of(fault_table(text))
    assert fault.name_at(now_s) == name


@pytest.mark.parametrize(
    ("faults", "text"),
    [
        ([fault_table("rear:stuck@2")], "rear:stuck@2"),
        (
            [{"part": "rear", "kind": "offset", "size_rad": math.radians(1.0), "start_s": 2.0, "end_s": 3.5}],
            "rear:offset=1deg@2-3.5",
        ),
        (
            (fault_table("rear:runaway=left@2-2.05"), "yaw_rate_sensor:delayed=0.1s@1"),
            "rear:runaway=left@2-2.05 yaw_rate_sensor:delayed=0.1s@1",
        ),
        (fault_table("yaw_rate_sensor:offset=2degps@1"), "yaw_rate_sensor:offset=2degps@1"),
        ([], "none"),
        (3, "3"),
        ([None], "[None]"),
        ([{"part": "rear", "start_s": "soon"}], "[{'part': 'rear', 'start_s': 'soon'}]"),
    ],
)
def test_faults_of_an_override_are_told_as_on_the_command_line(faults: Any, text: str) -> None:
    assert faults_text(faults) == text


def test_every_kind_says_what_it_does() -> None:
    assert all("actuator" in words or "demand" in words for words in KINDS.values())

"""Messages of the page: unknown names, other folders and wrong numbers are refused."""

from __future__ import annotations

import json
from collections import deque
from pathlib import Path
from typing import Any, cast

import pytest

from activesteer.errors import ParameterError
from activesteer.explore.choice import Folder, check_numbers
from activesteer.explore.messages import MAX_WAITING, Act, Describe, End, Message, RunRequest, Start, add, read
from activesteer.explore.runs import Runs, sliders
from activesteer.scenario import resolve

OWN = """
from activesteer import ActuatorCommand

class Mine:
    def __init__(self, setup, gain_s=0.1):
        self.gain_s = gain_s

    def step(self, command, measurement):
        return ActuatorCommand(rear_steer_demand_rad=0.0)
"""

OWN_TURN = """
kind = "open_loop"
speed_kmh = 70
duration_s = 4
hold_last = true

[steering]
time_s = [0.5, 2.5]
steering_wheel_deg = [0, 40]
"""


@pytest.mark.parametrize(
    "message",
    [
        {"maneuver": "/etc/passwd"},
        {"maneuver": "../slalom.toml"},
        {"maneuver": "slalom", "vehicle": "sub/car.toml"},
        {"maneuver": "slalom", "vehicle": "vehicles/../car.toml"},
        {"maneuver": "slalom", "controllers": ["../mine.py:Mine"]},
        {"maneuver": "slalom", "controllers": ["missing.py:Mine"]},
        {"maneuver": "slalom", "controllers": []},
        {"maneuver": "slalom", "controllers": ["none", "ars", "afs", "lqr", "esc"]},
        {"maneuver": "slalom", "speed_kmh": 80},
        {"maneuver": 3},
        {},
    ],
)
def test_a_message_can_name_nothing_outside_the_lists_and_the_folder(message: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(ParameterError):
        Folder(tmp_path).check(cast(RunRequest, read(json.dumps({"kind": "run", **message}))))


@pytest.mark.parametrize(
    "text",
    [
        "{", "[]", "null", '{"kind": "nothing"}', '{"kind": "act", "steer": 2.0}', '{"kind": "act", "steer": NaN}',
        '{"kind": "act", "throttle": -0.1}', '{"kind": "act", "brake": "full"}', '{"kind": "act", "steer": true}',
        '{"kind": "save", "more": 1}', '{"kind": "run", "maneuver": "slalom", "values": {"v": 1' + 400 * "0" + "}}",
        '{"kind": "run", "maneuver": "' + 300 * "a" + '.toml"}',
        '{"kind": "run", "maneuver": "slalom", "id": ' + 900 * "[" + 900 * "]" + "}",
        '{"kind": "run", "id": ' + 9000 * "[",
        '{"kind": "save"' + 20_000 * " " + "}",
    ],
)  # fmt: skip
def test_a_message_of_another_form_or_size_is_refused(text: str) -> None:
    with pytest.raises(ParameterError):
        read(text)


def test_a_full_queue_holds_the_newest_choice_and_the_newest_hands() -> None:
    waiting: deque[Message] = deque()
    for number in range(1500):
        assert add(waiting, RunRequest(maneuver="slalom", id=number))
        assert add(waiting, Act(steer=0.5, number=number))
    assert [getattr(message, "id", None) for message in waiting if isinstance(message, RunRequest)] == [1499]
    assert isinstance(waiting[-1], Act)
    assert waiting[-1].number == 1499
    assert len(waiting) <= MAX_WAITING
    assert [add(waiting, Act(mu=0.5)) for _ in range(200)].count(False) > 0
    assert len(waiting) == MAX_WAITING
    assert add(waiting, End())
    assert not any(isinstance(message, Act) for message in waiting)
    assert [add(waiting, message) for message in (End(), Start(maneuver="plane"), End())] == [True] * 3
    assert [type(message) for message in waiting if isinstance(message, (Start, End))] == [Start, End]


def test_files_of_the_folder_are_in_the_lists_and_are_not_executed(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(f"open({str(tmp_path / 'executed')!r}, 'w').close()\n{OWN}")
    (tmp_path / "turn.toml").write_text(OWN_TURN)
    (tmp_path / "broken.toml").write_text("kind = ")
    (tmp_path / "study.toml").write_text('maneuvers = ["slalom"]')
    car = tmp_path / "vehicles" / "mine"
    car.mkdir(parents=True)
    (car / "mine.toml").write_text('mjcf = "mine.xml"')
    names = Folder(tmp_path).names()
    assert {kind: [name for name in found if "." in name] for kind, found in names.items()} == {
        "maneuvers": ["turn.toml"],
        "vehicles": ["vehicles/mine/mine.toml"],
        "drivers": [],
        "controllers": ["mine.py:Mine"],
    }
    assert not (tmp_path / "executed").exists()
    Folder(tmp_path).check(RunRequest(maneuver="turn.toml", vehicle="vehicles/mine/mine.toml"))


def test_the_slider_of_the_speed_begins_where_a_search_for_the_amplitude_can(tmp_path: Path) -> None:
    for maneuver, low in (("sine_with_dwell", 30.0), ("slalom", 20.0)):
        found = Runs(Folder(tmp_path)).describe(Describe(maneuver=maneuver)).header["sliders"]
        assert [slider["low"] for slider in found if slider["key"] == "speed_kmh"] == [low]


def test_the_numbers_of_an_own_manoeuvre_have_sliders(tmp_path: Path) -> None:
    (tmp_path / "turn.toml").write_text(OWN_TURN)
    choice = Describe(maneuver="turn.toml")
    found = {slider["key"]: slider for slider in Runs(Folder(tmp_path)).describe(choice).header["sliders"]}
    assert (found["speed_kmh"]["low"], found["speed_kmh"]["high"]) == (20.0, 160.0)
    duration = found["duration_s"]
    assert (duration["low"], duration["value"], duration["high"]) == (2.0, 4.0, 8.0)
    assert duration["group"] == "manoeuvre"


def test_an_own_controller_in_the_folder_is_found_and_its_parameter_has_a_slider(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(OWN)
    folder = Folder(tmp_path)
    folder.check_name("controller", "mine.py:Mine")
    own = folder.located("mine.py:Mine")
    found = {slider.key: slider for slider in sliders(resolve("slalom", controllers=[own]), [own])}
    assert found["controllers.Mine.gain_s"].value == 0.1
    assert found["controllers.Mine.gain_s"].unit == "s"


def test_sliders_have_the_values_and_units_of_the_files() -> None:
    found = {slider.key: slider for slider in sliders(resolve("step_steer"), ["ars"])}
    assert (found["speed_kmh"].value, found["speed_kmh"].unit) == (80.0, "km/h")
    assert found["controllers.ars.limit_deg"].value == pytest.approx(3.0)
    assert all(slider.low <= slider.value <= slider.high for slider in found.values())
    assert "cones.spacing_m" not in found


@pytest.mark.parametrize("values", [{"mass": 1.0}, {"speed": 1e9}, {"speed": 19.0}])
def test_only_numbers_within_the_range_of_a_slider_are_taken(values: dict[str, float]) -> None:
    with pytest.raises(ParameterError):
        check_numbers(values, {"speed": (20.0, 160.0)})

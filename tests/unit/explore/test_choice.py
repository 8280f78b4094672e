"""Messages of the page: unknown names, other folders and wrong numbers are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from activesteer.errors import ParameterError
from activesteer.explore.choice import Folder, numbers
from activesteer.explore.sliders import sliders
from activesteer.scenario import resolve

OWN = """
from activesteer import ActuatorCommand

class Mine:
    def __init__(self, setup, gain_s=0.1):
        self.gain_s = gain_s

    def step(self, command, measurement):
        return ActuatorCommand(rear_steer_demand_rad=0.0)
"""


@pytest.mark.parametrize(
    "message",
    [
        {"maneuver": "/etc/passwd"},
        {"maneuver": "../slalom.toml"},
        {"maneuver": "slalom", "vehicle": "sub/car.toml"},
        {"maneuver": "slalom", "controllers": ["../mine.py:Mine"]},
        {"maneuver": "slalom", "controllers": ["missing.py:Mine"]},
        {"maneuver": "slalom", "controllers": []},
        {"maneuver": "slalom", "controllers": ["none", "ars", "afs", "lqr"]},
        {"maneuver": "slalom", "speed_kmh": 80},
        {"maneuver": 3},
        {},
    ],
)
def test_a_message_can_name_nothing_outside_the_lists_and_the_folder(message: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(ParameterError):
        Folder(tmp_path).choice(message)


def test_an_own_controller_in_the_folder_is_found_and_its_parameter_has_a_slider(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(OWN)
    folder = Folder(tmp_path)
    chosen = folder.choice({"maneuver": "slalom", "controllers": ["mine.py:Mine"]})
    own = folder.located(chosen.controllers[0])
    found = {slider.key: slider for slider in sliders(resolve("slalom", controllers=[own]), [own])}
    assert found["controllers.Mine.gain_s"].value == 0.1
    assert found["controllers.Mine.gain_s"].unit == "s"


def test_sliders_have_the_values_and_units_of_the_files() -> None:
    found = {slider.key: slider for slider in sliders(resolve("step_steer"), ["ars"])}
    assert (found["speed_kmh"].value, found["speed_kmh"].unit) == (80.0, "km/h")
    assert found["controllers.ars.limit_deg"].value == pytest.approx(3.0)
    assert all(slider.low <= slider.value <= slider.high for slider in found.values())
    assert "cones.spacing_m" not in found


@pytest.mark.parametrize(
    "values", [{"mass": 1.0}, {"speed": "80"}, {"speed": 1e9}, {"speed": True}, {"speed": None}, []]
)
def test_only_numbers_within_the_range_of_a_slider_are_taken(values: Any) -> None:
    with pytest.raises(ParameterError):
        numbers(values, {"speed": (20.0, 160.0)})

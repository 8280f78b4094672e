"""Build your own car in two ways: change keys of the compact, and start from a table of hardpoints.

    python examples/own_car.py

Guides: docs/own_car.md and docs/suspension.md. On the command line the second way is `activesteer vehicle new`.
"""

import math
import tempfile
from pathlib import Path

import activesteer
from activesteer.resources import models_dir
from activesteer.vehicle_builder import check_vehicle, new_vehicle

LOADED = {"load.payload_kg": 300.0, "load.payload_position_m": [-2.4, 0.0, 0.7]}
"""Load of 300 kg in the boot; you can override every key of the vehicle file like this."""


def stiffer_front(folder):
    """Build a car with stiffer front springs and anti-roll bar from the compact's table."""
    table = (models_dir() / "tables" / "compact.toml").read_text(encoding="utf-8")
    for compact, mine in (
        ("spring_rate_Npm = 24730", "spring_rate_Npm = 30000"),
        ("anti_roll_bar_Npm = 11750", "anti_roll_bar_Npm = 16000"),
    ):
        assert compact in table
        table = table.replace(compact, mine)
    file = Path(folder) / "stiffer_front.toml"
    file.write_text(table, encoding="utf-8")
    # The builder preloads the springs so that the car stands at its hardpoints; the README lists every assumption.
    made = new_vehicle("stiffer_front", file, Path(folder) / "stiffer_front")
    report = check_vehicle(made.vehicle_file)
    assert not report.count("error"), report.table()
    return made.vehicle_file


def compare(folder):
    """Drive a step steer with the three cars, all to the same lateral acceleration."""
    return {
        "compact": activesteer.simulate("step_steer"),
        "300 kg in the boot": activesteer.simulate("step_steer", overrides=LOADED),
        "stiffer front": activesteer.simulate("step_steer", vehicle=stiffer_front(folder)),
    }


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        for name, recording in compare(folder).items():
            steering_deg = math.degrees(recording.metrics["steering_wheel_steady_state_rad"])
            roll_deg = math.degrees(recording.metrics["roll_steady_state_rad"])
            print(f"{name:20}  steering wheel {steering_deg:.1f} deg, roll {roll_deg:.2f} deg")

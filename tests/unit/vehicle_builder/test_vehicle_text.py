"""A written vehicle file contains all given values, with all tables and keys."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path
from typing import Any

import pytest

from activesteer.config import Source, build, read_toml, to_table, toml_text
from activesteer.errors import ParameterError
from activesteer.scenario import load_car
from activesteer.scenario.car import VehicleConfig
from activesteer.sensors.parameters import Sensors
from activesteer.vehicle.brakes import Brakes
from activesteer.vehicle.electric_actuators import Motors, RearActuator
from activesteer.vehicle.parameters import Aerodynamics, Powertrain
from activesteer.vehicle_builder import new_vehicle
from activesteer.vehicle_builder.completion import pedal_of
from tests.raising import raises
from tests.unit.vehicle_builder.other_values import all_changed, other_values
from tests.unit.vehicle_builder.tables import COMPACT


@pytest.fixture(scope="module")
def changed() -> dict[str, Any]:
    return other_values(VehicleConfig, load_car("compact").config)


@pytest.mark.parametrize("table", [field.name for field in dataclasses.fields(VehicleConfig)])
def test_every_table_that_is_written_is_read_back_equal(changed: dict[str, Any], table: str) -> None:
    # A battery is one of motors.
    others = {"motors": changed["motors"]} if table == "battery" else {}
    config = dataclasses.replace(load_car("compact").config, **{table: changed[table]}, **others)
    text = toml_text(to_table(config, defaults=False))
    assert build(VehicleConfig, tomllib.loads(text), Source("written")) == config


def test_what_has_its_default_is_not_written() -> None:
    brakes = Brakes(front_torque_Nm=2000.0, rear_torque_Nm=600.0, tcs=True)
    assert to_table(brakes, defaults=False) == {"front_torque_Nm": 2000.0, "rear_torque_Nm": 600.0, "tcs": True}


def test_a_new_car_has_all_that_its_table_says_as_a_vehicle_file_does(tmp_path: Path) -> None:
    table, _ = read_toml(COMPACT)
    given = {
        name: all_changed(cls, build(cls, table[name], Source(COMPACT.name)))
        for name, cls in (("brakes", Brakes), ("powertrain", Powertrain), ("aerodynamics", Aerodynamics))
    }
    own = tmp_path / "own.toml"
    own.write_text(toml_text(table | to_table(given)), encoding="utf-8")
    config = load_car(new_vehicle("own", own, tmp_path / "own").vehicle_file).config
    assert {name: getattr(config, name) for name in given} == given


HARDWARE = """
[rear_actuator]
preset = "screw_3deg"
limit_deg = 2.5
backlash_m = 5e-5

[superposition_actuator]
preset = "strain_wave"

[sensors]
preset = "production"
seed = 7

[sensors.yaw_rate]
noise_degps = 0.2

[motors.rear]
speed_radps = [0.0, 400.0, 1500.0]
torque_Nm = [300.0, 300.0, 90.0]
gear_ratio = 9.0
differential = "splitting"
split_torque_Nm = 1200.0

[battery]
discharge_power_W = 100e3
"""


def test_actuators_and_sensors_of_a_table_are_those_of_the_new_car(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(COMPACT.read_text(encoding="utf-8") + HARDWARE, encoding="utf-8")
    made = new_vehicle("own", own, tmp_path / "own").vehicle_file
    config, asked = load_car(made).config, tomllib.loads(HARDWARE)
    assert config.rear_actuator == build(RearActuator, asked["rear_actuator"], Source("asked"))
    assert config.superposition_actuator.has_motor
    wanted = build(Sensors, asked["sensors"], Source("asked"))
    assert config.sensors.yaw_rate.amount("noise") == pytest.approx(wanted.yaw_rate.amount("noise"), rel=1e-6)
    assert dataclasses.replace(config.sensors, yaw_rate=wanted.yaw_rate) == wanted
    assert config.motors == build(Motors, asked["motors"], Source("asked"))
    assert config.battery.discharge_power_W == 100e3
    # What the presets say is left to them.
    written = tomllib.loads(made.read_text(encoding="utf-8"))
    assert set(written["rear_actuator"]) == {"preset", "limit_deg", "backlash_m"}
    assert set(written["sensors"]) == {"preset", "seed", "yaw_rate"}


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("screw_3deg", "screw_4deg", "rear_actuator.preset"),
        ("screw_3deg", "hinge", "rear_actuator.limit_rad"),
        ("seed = 7", "sed = 7", "sensors.sed"),
    ],
)
def test_a_wrong_actuator_or_sensor_is_refused_before_the_car_is_made(
    tmp_path: Path, old: str, new: str, key: str
) -> None:
    own = tmp_path / "own.toml"
    own.write_text(COMPACT.read_text(encoding="utf-8") + HARDWARE.replace(old, new), encoding="utf-8")
    with raises(ParameterError, file="own.toml", key=key):
        new_vehicle("own", own, tmp_path / "own")
    assert not (tmp_path / "own").exists()


def test_a_car_of_motors_alone_has_a_pedal_that_demands_all_of_them() -> None:
    pedal = pedal_of(build(Motors, tomllib.loads(HARDWARE)["motors"], Source("asked")))
    assert (pedal.front_fraction, pedal.max_torque_Nm, pedal.max_wheel_speed_radps) == (0.0, 2700.0, 166.67)
    # The map's greatest power: 300 N m less 0.1909 N m per rad/s beyond 400 rad/s, at 985.7 rad/s.
    assert pedal.max_power_W == pytest.approx(985.714 * (300.0 - 210.0 / 1100.0 * 585.714), rel=1e-5)

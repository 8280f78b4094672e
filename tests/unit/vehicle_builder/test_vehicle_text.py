"""A vehicle file that is written says all that was given: no table, no key is left behind."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path

import pytest

from activesteer.brakes import Brakes
from activesteer.config import Source, build, read_toml, to_table, toml_text
from activesteer.scenario import load_car
from activesteer.scenario.car import VehicleConfig
from activesteer.vehicle.parameters import Aerodynamics, Powertrain
from activesteer.vehicle_builder import new_vehicle
from tests.unit.vehicle_builder.other_values import all_changed
from tests.unit.vehicle_builder.tables import COMPACT


@pytest.fixture(scope="module")
def changed() -> VehicleConfig:
    return all_changed(VehicleConfig, load_car("compact").config)


@pytest.mark.parametrize("table", [field.name for field in dataclasses.fields(VehicleConfig)])
def test_every_table_that_is_written_is_read_back_equal(changed: VehicleConfig, table: str) -> None:
    config = dataclasses.replace(load_car("compact").config, **{table: getattr(changed, table)})
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

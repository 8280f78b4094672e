"""Values that a table does not give: the compact's own table, without them, gives nearly the compact again."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.config import read_toml, toml_text
from activesteer.scenario import load_car
from activesteer.theory.single_track import characteristic_speed
from activesteer.vehicle_builder.build import _tyre
from activesteer.vehicle_builder.completion import complete
from activesteer.vehicle_builder.design import CarDesign, Log
from activesteer.vehicle_builder.table import chosen_kinds, in_vehicle_axes, read_table
from activesteer.vehicle_builder.texts import _single_track, car_table
from tests.bench import on_the_bench
from tests.unit.vehicle_builder.tables import COMPACT

GIVEN = {"units", "mass", "front.points", "rear.points", "front.type", "rear.type", "rear.spring_on"}


def design(path: Path) -> CarDesign:
    """Return the complete car of a table, which does not stand yet."""
    log, (raw, _) = Log(), read_table(path)
    tyres = {axle: _tyre(axle, raw, path.parent, log)[:2] for axle in ("front", "rear")}
    return complete("car", in_vehicle_axes(raw), chosen_kinds(raw), tyres, log)


@pytest.fixture(scope="module")
def full() -> CarDesign:
    return design(COMPACT)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> CarDesign:
    """Return the compact without all that may be left out."""
    table, _ = read_toml(COMPACT)
    kept: dict[str, Any] = {}
    for name, value in table.items():
        if name in GIVEN:
            kept[name] = value
        elif isinstance(value, dict) and (part := {key: one for key, one in value.items() if f"{name}.{key}" in GIVEN}):
            kept[name] = part
    path = tmp_path_factory.mktemp("bare") / "bare.toml"
    path.write_text(toml_text(kept), encoding="utf-8")
    return design(path)


@pytest.mark.parametrize(
    "name", ["width_m", "rack_mass_kg", "rack_friction_N", "column_stiffness_Npm", "rear_stiffness_Nmprad", "rack_sign"]
)
def test_a_number_of_the_car_that_is_assumed_is_the_compacts(full: CarDesign, bare: CarDesign, name: str) -> None:
    assert getattr(bare, name) == pytest.approx(getattr(full, name), rel=0.01)


def test_the_rear_steering_that_is_assumed_is_the_compacts(full: CarDesign, bare: CarDesign) -> None:
    assert bare.rear_limit_rad == pytest.approx(math.radians(3.0))
    np.testing.assert_allclose(bare.kingpin_m, full.kingpin_m, atol=1e-3)


def test_brakes_engine_and_drag_that_are_assumed_are_the_compacts(full: CarDesign, bare: CarDesign) -> None:
    assert bare.brakes == full.brakes
    # The lag of the engine and its largest speed are defaults of the vehicle file, not assumptions of the builder.
    same = {"lag_s": full.powertrain.lag_s, "max_wheel_speed_radps": full.powertrain.max_wheel_speed_radps}
    assert dataclasses.replace(bare.powertrain, **same) == full.powertrain
    assert bare.aerodynamics.drag_area_m2 == full.aerodynamics.drag_area_m2
    # Between the axles, which are 2.637 m apart.
    assert bare.aerodynamics.pressure_point_m == pytest.approx((-1.3185, 0.0, 0.6), abs=1e-3)


@pytest.mark.parametrize(
    ("axle", "part"), [("front", "knuckle"), ("front", "strut"), ("rear", "knuckle"), ("rear", "carrier")]
)
def test_mass_and_inertia_of_a_part_that_are_assumed_are_the_compacts(
    full: CarDesign, bare: CarDesign, axle: str, part: str
) -> None:
    """The rule scales the front knuckle to the rear, which is 0.6 times as heavy. Its place is between the joints."""
    known, assumed = (getattr(getattr(car, axle), part) for car in (full, bare))
    assert assumed.mass_kg == known.mass_kg
    np.testing.assert_allclose(assumed.inertia_kgm2, known.inertia_kgm2, rtol=0.2)
    assert np.linalg.norm(assumed.cg_m - known.cg_m) < 0.06


@pytest.mark.parametrize("axle", ["front", "rear"])
def test_a_wheel_that_is_assumed_is_the_compacts(full: CarDesign, bare: CarDesign, axle: str) -> None:
    known, assumed = getattr(full, axle), getattr(bare, axle)
    for name in ("wheel_mass_kg", "wheel_spin_inertia_kgm2", "wheel_inertia_kgm2"):
        assert getattr(assumed, name) == pytest.approx(getattr(known, name), rel=0.01), name
    assert np.degrees(assumed.toe_rad) == pytest.approx(np.degrees(known.toe_rad), abs=0.05)
    assert np.degrees(assumed.camber_rad) == pytest.approx(np.degrees(known.camber_rad), abs=0.3)
    assert (known.ride_frequency_Hz, known.damping_ratio) == (None, None)
    assert assumed.ride_frequency_Hz == {"front": 1.2, "rear": 1.4}[axle]
    assert assumed.damping_ratio == 0.28


def test_links_that_are_assumed_are_as_stiff_as_the_compacts(full: CarDesign, bare: CarDesign) -> None:
    for axle in ("front", "rear"):
        for known, assumed in zip(getattr(full, axle).links, getattr(bare, axle).links, strict=True):
            assert known.name == assumed.name
            assert assumed.stiffness_Npm == pytest.approx(known.stiffness_Npm, rel=0.3), known.name
            assert assumed.hardening_Npm3 == pytest.approx(known.hardening_Npm3, rel=0.3), known.name
            assert assumed.damping_Nspm == known.damping_Nspm, known.name


def test_the_single_track_model_of_a_new_car_is_nearly_the_compacts_identified_one(full: CarDesign) -> None:
    """The tyres under static load give a quarter more or less than the driven car: no more is stated."""
    car = load_car("compact")
    model = car.on().model
    found, known = _single_track(full, model), car.config.single_track
    assert found["mass_kg"] == pytest.approx(known.mass_kg, rel=0.02)
    assert found["yaw_inertia_kgm2"] == pytest.approx(known.yaw_inertia_kgm2, rel=0.02)
    assert found["cg_to_front_m"] == pytest.approx(known.cg_to_front_m, rel=0.02)
    assert found["cg_to_rear_m"] == pytest.approx(known.cg_to_rear_m, rel=0.02)
    assert found["front_stiffness_Nprad"] == pytest.approx(known.front_stiffness_Nprad, rel=0.25)
    assert found["rear_stiffness_Nprad"] == pytest.approx(known.rear_stiffness_Nprad, rel=0.25)
    # EG = m (l_r c_r - l_f c_f) / (l c_f c_r) [rad s2/m], as for the identified car.
    front, rear = found["front_stiffness_Nprad"], found["rear_stiffness_Nprad"]
    moment = found["cg_to_rear_m"] * rear - found["cg_to_front_m"] * front
    gradient = found["mass_kg"] * moment / (2.637 * front * rear)
    assert found["characteristic_speed_kmh"] / 3.6 == pytest.approx(characteristic_speed(2.637, gradient), rel=1e-3)


def test_the_table_of_a_measured_car_is_that_of_its_hardpoints(full: CarDesign) -> None:
    """`kc --tables` writes the mass, steering, wheels and rear axis of the compact, which stands 1.7 mm lower."""
    table = tomllib.loads(car_table(load_car("compact"), on_the_bench()))
    given, _ = read_toml(COMPACT)
    mass = given["mass"]
    assert table["mass"]["total_kg"] == pytest.approx(mass["total_kg"], abs=0.01)
    assert table["mass"]["front_fraction"] == pytest.approx(mass["front_fraction"], abs=1e-3)
    assert table["mass"]["cg_height_m"] == pytest.approx(mass["cg_height_m"] - 0.0017, abs=1e-4)
    assert table["mass"]["inertia_kgm2"] == pytest.approx(mass["inertia_kgm2"], rel=2e-3)
    assert table["steering"]["rack_limit_m"] == given["steering"]["rack_limit_m"]
    assert table["steering"]["rack_mass_kg"] == given["steering"]["rack_mass_kg"]
    assert table["steering"]["column_stiffness_Npm"] == given["steering"]["column_stiffness_Npm"]
    steering = table["rear_steering"]
    assert steering["limit_deg"] == pytest.approx(3.0)
    assert steering["stiffness_Nmprad"] == full.rear_stiffness_Nmprad
    for axle in ("front", "rear"):
        known, found = getattr(full, axle), table[axle]
        assert found["wheel_mass_kg"] == pytest.approx(known.wheel_mass_kg, abs=1e-3)
        assert found["wheel_spin_inertia_kgm2"] == pytest.approx(known.wheel_spin_inertia_kgm2, abs=1e-3)
        assert found["wheel_inertia_kgm2"] == pytest.approx(known.wheel_inertia_kgm2, abs=1e-3)
        assert found["knuckle_mass_kg"] == pytest.approx(known.knuckle.mass_kg, abs=1e-3)
        np.testing.assert_allclose(found["knuckle_inertia_kgm2"], known.knuckle.inertia_kgm2, rtol=0.02)
        np.testing.assert_allclose(found["points"]["wheel_centre"], known.wheel_centre_m, atol=2e-3)
        np.testing.assert_allclose(found["knuckle_cg"], known.knuckle.cg_m, atol=2e-3)
    # Two points of the hinge, 0.11 m below and 0.12 m above the wheel centre.
    lower, upper = (np.array(steering[f"axis_{end}"]) for end in ("lower", "upper"))
    height_m = table["rear"]["points"]["wheel_centre"][2]
    assert (lower[2], upper[2]) == pytest.approx((height_m - 0.11, height_m + 0.12), abs=1e-4)
    along = full.kingpin_m[1] - full.kingpin_m[0]
    for point in (lower, upper):
        off = np.cross(point - full.kingpin_m[0], along / np.linalg.norm(along))
        assert np.linalg.norm(off) < 2e-3

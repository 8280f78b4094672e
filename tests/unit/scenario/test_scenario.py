"""Combination of manoeuvre, vehicle and overrides, and repetition of a run from its own recording."""

from __future__ import annotations

import json
import math
import re
import shutil
import tomllib
from collections.abc import Iterator
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest

import activesteer
from activesteer.config import key_paths
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.driver import DriverParameters
from activesteer.errors import ActiveSteerError, ManeuverError, ModelError, ParameterError, TyreFileError
from activesteer.maneuver import KINDS
from activesteer.maneuver.steering_tests import StepSteer
from activesteer.resources import find_vehicle, list_maneuvers, list_vehicles, models_dir
from activesteer.scenario import VehicleConfig, describe, load_car, resolve
from activesteer.scenario.run_context import slip_limit_rad
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.tyre.evaluation import MagicFormula
from tests.raising import raises

SHORT = {"duration_s": 0.2, "settle_s": 0.0, "steer.start_s": 0.05, "steer.steering_wheel_deg": 20}


@pytest.fixture
def vehicle(tmp_path):
    """Return a vehicle file like the shipped one, with changes."""

    def write(*changes: tuple[str, str]) -> Path:
        text = find_vehicle("compact").read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize(
    ("maneuver", "car"),
    [*((maneuver, "compact") for maneuver in list_maneuvers()), *(("step_steer", car) for car in list_vehicles())],
)
def test_everything_that_is_shipped_resolves(maneuver, car):
    scenario = resolve(maneuver, car)
    assert scenario.maneuver.name == maneuver
    assert scenario.maneuver.title
    assert scenario.car.name == car


def test_step_steer_is_the_one_of_the_paper():
    maneuver = resolve("step_steer").maneuver
    assert isinstance(maneuver, StepSteer)
    assert maneuver.speed_mps == pytest.approx(80.0 / 3.6)
    assert maneuver.road.mu == 0.9
    assert maneuver.steer.lateral_acceleration_mps2 == pytest.approx(0.4 * 9.81)
    assert maneuver.steer.rate_radps > math.radians(200.0)


def test_overrides_reach_manoeuvre_and_vehicle_in_any_unit():
    scenario = resolve(
        "step_steer",
        overrides={
            "speed_kmh": 72,
            "road.mu": 0.4,
            "maneuver.title": "slow",
            "controllers.ars.limit_deg": 2,
            "driver.speed_gain_1ps": 3.0,
            "factors.mass": 1.1,
        },
    )
    assert scenario.maneuver.speed_mps == pytest.approx(20.0)
    assert scenario.maneuver.road.mu == 0.4
    assert scenario.maneuver.title == "slow"
    assert scenario.car.config.controllers.ars.limit_rad == pytest.approx(math.radians(2.0))
    assert scenario.driver.parameters.speed_gain_1ps == 3.0
    assert scenario.car.config.factors.mass == 1.1


@pytest.mark.parametrize(
    ("maneuver", "key", "value", "title"),
    [
        ("sine_with_dwell", "steer.amplitude_factor", 2, "Sine with dwell, 80 km/h, 2 A, dry"),
        ("sine_with_dwell", "steer.steering_wheel_deg", 120, "Sine with dwell, 80 km/h, 120 deg, dry"),
        ("step_steer", "steer.steering_wheel_deg", 40, "Step steer, 80 km/h, 40 deg, dry"),
        ("step_steer", "steer.lateral_acceleration_mps2", 5.886, "Step steer, 80 km/h, 0.6 g, dry"),
        ("brake_in_turn", "turn.lateral_acceleration_g", 0.4, "Braking in a turn, 80 km/h, 3.92 m/s², dry"),
        ("slalom", "cones.spacing_m", 36, "Slalom 36 m, 100 km/h, dry"),
        ("double_lane_change_low_mu", "road.mu", 0.3, "Double lane change ISO 3888-1, 80 km/h, friction 0.3"),
        ("parking", "road.mu", 0.3, "Parking: lock to lock at rest"),
    ],
)
def test_title_says_the_values_that_are_driven(maneuver: str, key: str, value: float, title: str):
    assert resolve(maneuver, overrides={key: value}).maneuver.title == title


def test_title_says_the_speed_that_is_driven():
    assert resolve("slalom").maneuver.title == "Slalom 45 m, 100 km/h, dry"
    assert resolve("slalom", overrides={"speed_kmh": 131}).maneuver.title == "Slalom 45 m, 131 km/h, dry"
    own = {"speed_kmh": 131, "title": "as at 100 km/h"}
    assert resolve("slalom", overrides=own).maneuver.title == "as at 100 km/h"
    assert resolve("drive_off_and_stop", overrides={"speed_kmh": 10}).maneuver.title.count("30 km/h") == 1


def test_controllers_are_told_nothing_of_the_road():
    dry, slippery = (resolve("step_steer", overrides={"road.mu": mu}).controller_setup(0.001) for mu in (0.9, 0.3))
    assert dry == slippery


def test_overrides_may_come_from_numpy():
    overrides = {"speed_kmh": np.int64(72), "road.mu": np.float32(0.5)}
    scenario = resolve("step_steer", overrides=overrides)
    assert scenario.maneuver.speed_mps == pytest.approx(20.0)
    assert json.loads(json.dumps(describe(scenario)))["overrides"] == {"speed_kmh": 72, "road.mu": 0.5}


def test_override_replaces_a_whole_table():
    scenario = resolve("standstill", overrides={"brake": {"time_s": [0.0], "pedal": [0.5]}})
    assert scenario.maneuver.setpoint(0.0).brake_pedal == 0.5


@pytest.mark.parametrize(
    ("given", "key", "help_"),
    [
        ("road.mue", "road.mue", "did you mean 'road.mu'"),
        ("sped_kmh", "sped_kmh", "'speed_kmh'"),
        ("controllers.asr.limit_deg", "controllers.asr.limit_deg", "'controllers.ars.limit_deg'"),
        ("maneuver.sped_kmh", "sped_kmh", "did you mean 'speed_kmh'"),
        ("vehicle.tyres.frnt", "tyres.frnt", "did you mean 'front'"),
        ("name", "name", "use maneuver.name or vehicle.name"),
        ("speed_kmh.x", "speed_kmh.x", "speed_kmh is a value, not a table"),
    ],
)
def test_override_of_a_key_that_does_not_exist_is_answered(given, key, help_):
    with pytest.raises(ParameterError) as told:
        resolve("step_steer", overrides={given: 1})
    assert (told.value.overridden, told.value.key) == (True, key)
    assert help_ in told.value.problem
    assert str(told.value).startswith(f"override {key}: ")


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("road.mu", "road"),
        ("road", "road.mu"),
        ("speed_kmh", "speed_mps"),
        ("speed_kmh", "maneuver.speed_kmh"),
        ("controllers.ars.limit_deg", "vehicle.controllers.ars.limit_rad"),
        ("brake.time_s", "brake"),
    ],
)
def test_override_that_replaces_what_another_gives_is_answered(one, other):
    values = {"road": {"mu": 0.5}, "brake": {"time_s": [0.0], "pedal": [0.1]}}
    with pytest.raises(ParameterError) as told:
        resolve("standstill", overrides={one: values.get(one, 1.0), other: values.get(other, 1.0)})
    assert (told.value.overridden, told.value.key) == (True, other)
    assert one in told.value.problem


def test_table_that_an_override_made_a_value_is_answered():
    with raises(ParameterError, key="road", value=5):
        resolve({"kind": "open_loop", "speed_kmh": 50, "duration_s": 1, "road": 5}, overrides={"road.mu": 0.5})


@pytest.mark.parametrize(
    ("key", "value"),
    [("road.mu", "wet"), ("speed_kmh", 500), ("controllers.ars.limit_deg", 20), ("tyres.front", "none.tir")],
)
def test_wrong_value_of_an_override_is_not_blamed_on_the_file(key, value):
    with raises(ActiveSteerError, key=key, value=value, overridden=True):
        resolve("step_steer", overrides={key: value})


def test_missing_tyre_file_is_answered_with_file_key_and_neighbours(vehicle):
    path = vehicle(('front = "compact_205_55R16.tir"', 'front = "compact_205_55R17.tir"'))
    with raises(TyreFileError, file="mine.toml", key="tyres.front", value="compact_205_55R17.tir"):
        resolve("standstill", path)


def test_broken_tyre_file_is_answered_with_its_name(vehicle, tmp_path):
    tyre = tmp_path / "broken.tir"
    tyre.write_text("[MODEL]\nFITTYP = round\n")
    with raises(TyreFileError, key="FITTYP", value="round"):
        resolve("standstill", vehicle(('rear = "compact_205_55R16.tir"', f'rear = "{tyre}"')))


def test_missing_model_is_answered_with_file_and_key(vehicle):
    with raises(ModelError, file="mine.toml", key="mjcf", value="compact/compct.xml"):
        resolve("standstill", vehicle(("compact/compact.xml", "compact/compct.xml")))


@pytest.mark.parametrize(
    ("old", "new", "name"),
    [
        ("</mujoco>", "<no_such_thing/></mujoco>", None),
        ("</mujoco>", "", None),
        ('name="chassis"', 'name="hull"', "chassis"),
        ('name="cg_gyro"', 'name="cg_gyros"', "cg_gyro"),
    ],
)
def test_bad_model_is_answered_with_its_file(vehicle, tmp_path, old, new, name):
    folder = tmp_path / "car"
    shutil.copytree(models_dir() / "mjcf" / "compact", folder)
    model = folder / "compact.xml"
    text = model.read_text()
    assert old in text
    model.write_text(text.replace(old, new))
    with raises(ModelError, value=name) as refused:
        activesteer.simulate("standstill", vehicle=vehicle(("compact/compact.xml", str(model))))
    assert refused.value.file.endswith("compact.xml")


def test_bad_vehicle_file_is_answered_with_file_key_and_line(vehicle):
    with raises(ParameterError, file="mine.toml", key="steering.ratoi"):
        resolve("standstill", vehicle(("ratio =", "ratoi =")))
    with raises(ParameterError, cause=tomllib.TOMLDecodeError, file="mine.toml"):
        resolve("standstill", vehicle(("[tyres]", "[tyres")))


def test_bad_maneuver_file_is_answered_with_file_key_and_line(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('kind = "open_loop"\nspeed_kmh = "fast"\nduration_s = 1.0\n')
    with raises(ManeuverError, file="mine.toml", line=2, key="speed_kmh", value="fast"):
        resolve(path)


def test_file_name_names_the_maneuver(tmp_path):
    path = tmp_path / "roll_out.toml"
    path.write_text('kind = "open_loop"\nspeed_kmh = 30\nduration_s = 1.0\n')
    assert resolve(path).maneuver.name == "roll_out"


def test_files_are_kept_for_the_recording():
    files = resolve("step_steer").files
    for name in ("maneuver.toml", "vehicle.toml", "mjcf/compact/compact.xml", "tyres/compact_205_55R16.tir"):
        assert files[name]


@pytest.mark.parametrize("maneuver", list_maneuvers())
def test_described_scenario_resolves_to_itself(maneuver):
    scenario = resolve(maneuver, overrides={"road.grade": 0.05})
    table = json.loads(json.dumps(describe(scenario)))
    again = resolve(table["maneuver"], table["vehicle"])
    assert (again.maneuver, again.car.config, again.car.mjcf) == (
        scenario.maneuver,
        scenario.car.config,
        scenario.car.mjcf,
    )
    assert [tyre.record.tolist() for tyre in again.car.tyres] == [tyre.record.tolist() for tyre in scenario.car.tyres]


@pytest.mark.parametrize("controller", ["none", "ars", "afs"])
def test_run_made_again_from_its_recording_is_bit_identical(controller, tmp_path):
    first = activesteer.simulate("step_steer", controller, overrides=SHORT | {"controllers.ars.limit_deg": 1.5})
    first.save(tmp_path / "run.mcap")
    known = activesteer.Recording.open(tmp_path / "run.mcap").metadata
    again = activesteer.simulate(
        known["maneuver"],
        known["controller"],
        known["vehicle"],
        driver=known["driver"],
        timestep_s=known["timestep_s"],
    )
    assert len(again) == 200
    assert np.array_equal(again.values, first.values)
    assert np.array_equal(again.poses.positions_m, first.poses.positions_m)


def tables_with_hints(cls: type, above: str = "") -> Iterator[tuple[str, str]]:
    yield from ((above + key, hint) for key, hint in getattr(cls, "KEY_HINTS", {}).items())
    for field, hint in get_type_hints(cls).items():
        if is_dataclass(hint):
            yield from tables_with_hints(hint, f"{above}{field}.")  # type: ignore[reportArgumentType] - a class


HINTS = dict(tables_with_hints(VehicleConfig))


def test_hints_name_keys_that_exist():
    known = {*key_paths(VehicleConfig), *key_paths(KINDS["open_loop"]), *key_paths(DriverParameters, "driver.")}
    for key, hint in HINTS.items():
        named = re.findall(r"[a-z_]+(?:\.\w+)+", hint)
        assert named
        assert set(named) <= known
        assert key not in known


@pytest.mark.parametrize("key", sorted(HINTS))
@pytest.mark.parametrize("part", ["", "vehicle."])
def test_mass_of_the_car_and_the_like_lead_to_the_keys_that_change_it(key, part):
    for call in (resolve, lambda _, overrides: load_car(overrides=overrides)):
        if part + key == "driver" and call is resolve:
            continue  # the key that chooses the driver
        with pytest.raises(ParameterError) as told:
            call("standstill", overrides={part + key: 1800})
        assert HINTS[key] in str(told.value)


def test_mass_in_a_vehicle_file_leads_to_the_keys_that_change_it(vehicle):
    with raises(ParameterError, file="mine.toml", key="mass_kg"):
        resolve("standstill", vehicle(("[tyres]", "mass_kg = 1800\n[tyres]")))


def search(**overrides: Any) -> float:
    keys = {"settle_s": 0.5} | {key.replace("__", "."): value for key, value in overrides.items()}
    maneuver = with_amplitude_found(resolve("step_steer", overrides=keys)).maneuver
    assert isinstance(maneuver, StepSteer)
    assert maneuver.steer.steering_wheel_rad is not None
    return maneuver.steer.steering_wheel_rad


def test_amplitude_does_not_depend_on_how_long_the_maneuver_is():
    assert search(duration_s=1.0) == search(duration_s=5.0)


def test_amplitude_to_the_right_is_that_to_the_left():
    left, right = search(steer__lateral_acceleration_g=0.2), search(steer__lateral_acceleration_g=-0.2)
    assert left > 0.1
    assert right == pytest.approx(-left, rel=1e-6)


def test_aim_that_the_road_does_not_allow_is_answered():
    with raises(ManeuverError, value=pytest.approx(0.8 * GRAVITY_MPS2)):
        search(road__mu=0.3, steer__lateral_acceleration_g=0.8)


def test_model_and_tyre_beside_the_vehicle_file_come_before_the_shipped_ones(vehicle, monkeypatch, tmp_path):
    file = vehicle()
    own_model = file.parent / "compact"
    shutil.copytree(models_dir() / "mjcf" / "compact", own_model)
    own_tyre = Path(shutil.copy(models_dir() / "tyres" / "compact_205_55R16.tir", file.parent))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    scenario = resolve("standstill", file)
    assert scenario.car.mjcf == own_model / "compact.xml"
    assert scenario.car.tyres[0].source == own_tyre


def test_less_friction_gives_a_smaller_slip_angle_of_the_largest_side_force() -> None:
    scenario = resolve("step_steer")
    dry, snow = (slip_limit_rad(resolve("step_steer", overrides={"road.mu": mu})) for mu in (0.9, 0.3))
    assert dry is not None
    assert dry == pytest.approx(math.radians(7.5), abs=math.radians(0.5))
    assert snow == pytest.approx(math.radians(2.5), abs=math.radians(0.5))
    rear, load_N = MagicFormula(scenario.car.tyres[1]), scenario.car.config.single_track.wheel_loads_N[1]
    before, at, after = (abs(rear.evaluate(load_N, 0.0, dry + math.radians(more)).fy_N) for more in (-3.0, 0.0, 3.0))
    assert max(before, after) < at
    assert slip_limit_rad(resolve("step_steer", "bmw_m8", {"road.mu": 0.9})) is None  # its curve is flat
    for name in ("split_mu_braking", "mu_jump"):  # they have several frictions
        assert slip_limit_rad(resolve(name)) is None

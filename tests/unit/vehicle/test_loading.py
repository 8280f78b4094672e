"""Errors in a model file: each gives a ModelError with the file and the missing name."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import mujoco
import numpy as np
import pytest

from activesteer.errors import ModelError
from activesteer.road.road import Road
from activesteer.scenario import load_car
from activesteer.vehicle import loading
from tests.raising import raises
from tests.unit.vehicle.cars import changed_model


@pytest.mark.parametrize(
    ("file", "old", "new", "name"),
    [
        ("compact.xml", '<body name="chassis">', '<body name="hull">', "chassis"),
        ("compact.xml", '<gyro name="cg_gyro"', '<gyro name="cg_gyroscope"', "cg_gyro"),
        ("compact.xml", 'name="chassis_orientation"', 'name="attitude"', "chassis_orientation"),
        ("compact.xml", 'name="rl_wheel_speed"', 'name="rl_wheel_spin"', "rl_wheel_speed"),
        ("compact.xml", 'name="steering_wheel_angle"', 'name="handwheel"', "steering_wheel_angle"),
        ("compact.xml", '"fr_damper"', '"fr_shock"', "fr_damper"),
        ("compact.xml", '<position name="steering_wheel"', '<position name="wheel"', "steering_wheel"),
        ("compact.xml", '<general name="rr_steer"', '<general name="rr_hinge"', "rr_steer"),
        ("compact.xml", '<general name="fl_slip_x"', '<general name="fl_kappa"', "fl_slip_x"),
        ("compact.xml", '<motor name="fl_drive"', '<motor name="fl_shaft"', "fl_drive"),
        ("compact.xml", 'dynprm="0.025 0.5"', 'dynprm="0 0.5"', "rl_steer"),
        ("compact.xml", 'dynprm="0.025 8"', 'dynprm="0.025 0"', "superposition"),
        ("compact.xml", '<freejoint name="root"/>', "", "root"),
    ],
)
def test_a_wrong_model_is_an_error_with_file_and_name(tmp_path: Path, file: str, old: str, new: str, name: str) -> None:
    model = changed_model(tmp_path, file, old, new)
    with raises(ModelError, file=str(model), value=name):
        dataclasses.replace(load_car(), mjcf=model).on()


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("front_axle.xml", 'name="fl_spin"', 'name="fl_turn"', "fl_spin"),
        ("compact.xml", "</mujoco>", "", "XML"),
        ("rear_axle.xml", 'mass="12.5"', 'mass="heavy"', "mass"),
    ],
)
def test_what_the_engine_says_of_a_model_is_passed_on(
    tmp_path: Path, file: str, old: str, new: str, words: str
) -> None:
    model = changed_model(tmp_path, file, old, new)
    with raises(ModelError, file=str(model)) as refused:
        dataclasses.replace(load_car(), mjcf=model).on()
    assert words in refused.value.problem


def test_a_renamed_wheel_body_is_named(tmp_path: Path) -> None:
    path = changed_model(tmp_path, "rear_axle.xml", "rl_wheel", "rl_tire")
    main = path.read_text(encoding="utf-8").replace('objname="rl_wheel"', 'objname="rl_tire"')
    path.write_text(main.replace('site="rl_wheel_centre"', 'site="rl_tire_centre"'), encoding="utf-8")
    with raises(ModelError, file=str(path), value="rl_wheel"):
        dataclasses.replace(load_car(), mjcf=path).on()


def test_a_missing_file_is_an_error_that_names_it(tmp_path: Path) -> None:
    path = tmp_path / "absent.xml"
    with raises(ModelError, file=str(path)):
        dataclasses.replace(load_car(), mjcf=path).on()


def test_an_unchanged_copy_loads(tmp_path: Path) -> None:
    """Without the change above the model loads, so the change causes the failure."""
    path = changed_model(tmp_path, "compact.xml", 'model="compact"', 'model="copy"')
    vehicle = dataclasses.replace(load_car(), mjcf=path).on()
    assert vehicle.model.nv > 30


def _bytes_of(model: mujoco.MjModel) -> bytes:
    found = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, found)
    return found.tobytes()


def test_a_car_that_was_compiled_lately_is_copied_and_the_copy_is_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    car = load_car(overrides={"factors.mass": 1.05})
    first = car.on()
    fresh = _bytes_of(first.model)
    first.model.body_mass[:] = 0.0  # whatever becomes of a car, the next one is not touched
    monkeypatch.setattr(loading, "_compile", lambda *_: pytest.fail("it is compiled again"))
    again = load_car(overrides={"factors.mass": 1.05, "controllers.ars.prediction_gain": 0.5}).on()
    assert _bytes_of(again.model) == fresh


@pytest.mark.parametrize("key", ["factors.mass", "factors.tyre_friction", "tyres.front_pressure_Pa"])
def test_another_car_is_compiled(key: str) -> None:
    given = load_car().on().model
    other = load_car(overrides={key: 1.05 if key.startswith("factors") else 2e5}).on().model
    assert _bytes_of(other) != _bytes_of(given)
    assert _bytes_of(load_car().on(Road(mu=0.5)).model) != _bytes_of(given)


def test_a_model_file_that_has_changed_is_compiled_anew(tmp_path: Path) -> None:
    path = changed_model(tmp_path, "compact.xml", 'model="compact"', 'model="copy"')
    masses = []
    for mass in ("12.5", "13.5"):
        rear = path.parent / "rear_axle.xml"
        rear.write_text(rear.read_text(encoding="utf-8").replace('mass="12.5"', f'mass="{mass}"'), encoding="utf-8")
        masses.append(float(load_car(overrides={"mjcf": str(path)}).on().model.body_mass.sum()))
    assert masses[1] == pytest.approx(masses[0] + 2.0)

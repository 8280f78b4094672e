"""The files in `models/controllers`: default gains of controllers, and variants with other gains."""

from __future__ import annotations

import dataclasses
import math

import pytest

from activesteer.config import Source, build
from activesteer.controllers import CONTROLLERS, ControllerParameters, load_controller, read_variant
from activesteer.controllers.parameters import LqrParameters
from activesteer.errors import ControllerError
from activesteer.resources import find_controller_variant
from activesteer.scenario import resolve
from tests.raising import raises
from tests.unit.controllers.cars import measured, setup, steering

WITH_FILE = [name for name, kind in CONTROLLERS.items() if hasattr(kind, "gains")]
SCALE = {"controllers.lqr.rear_scale_deg": 1.0}


@pytest.fixture
def copy_of(tmp_path):
    """A user's copy of a shipped file, with a text in it replaced."""

    def copy_of(name: str, old: str = "", new: str = ""):
        path = tmp_path / "mine.toml"
        path.write_text(find_controller_variant(name).read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
        return path

    return copy_of


@pytest.mark.parametrize("name", WITH_FILE)
def test_gains_of_a_controller_have_their_values_in_its_file_alone(name):
    kind = CONTROLLERS[name].gains
    assert all(field.default is field.default_factory is dataclasses.MISSING for field in dataclasses.fields(kind))
    assert isinstance(getattr(ControllerParameters(), name), kind)
    assert read_variant(name).system == name


def test_missing_gain_is_an_error():
    with raises(ControllerError, key="lqr.sideslip_scale_rad"):
        build(LqrParameters, {"yaw_rate_scale_degps": 1.0}, Source("lqr.toml", "", ControllerError), ("lqr",))


def test_vehicle_file_may_change_single_gains_of_the_file():
    gains = build(ControllerParameters, {"lqr": {"rear_scale_deg": 1.0}}, Source(""))
    assert gains.lqr == dataclasses.replace(ControllerParameters().lqr, rear_scale_rad=math.radians(1.0))


def test_override_of_a_default_gain_reaches_the_controller():
    known = resolve("straight_line", overrides=SCALE).controller_setup(0.005)
    assert load_controller("lqr", known)._parameters.rear_scale_rad == math.radians(1.0)  # pyright: ignore[reportAttributeAccessIssue]


def test_override_of_a_gain_that_a_variant_gives_itself_is_refused(copy_of):
    known = resolve("straight_line", overrides=SCALE).controller_setup(0.005)
    with raises(ControllerError, key="lqr.rear_scale_deg"):
        load_controller(copy_of("lqr"), known)


def test_copy_of_a_file_has_its_own_gains(copy_of):
    path = copy_of("lqr", "rear_scale_deg = 2.0", "rear_scale_deg = 1.5")
    assert read_variant(path).gains_in(setup()).lqr.rear_scale_rad == math.radians(1.5)


def test_unknown_system_is_answered_with_the_known_ones(copy_of):
    with raises(ControllerError, key="system", value="lqg"):
        read_variant(copy_of("lqr", 'system = "lqr"', 'system = "lqg"'))


def test_observer_can_be_the_system_of_a_variant(tmp_path):
    path = tmp_path / "snow.toml"
    path.write_text('system = "observer"\n[estimator]\nfriction = 0.3\n', encoding="utf-8")
    known = resolve("straight_line").controller_setup(0.005)
    observer = load_controller(path, known)
    assert type(observer) is CONTROLLERS["observer"]
    estimate = observer.step(steering(0.0), measured(0.0)).estimate
    assert estimate is not None
    assert estimate.friction == pytest.approx(0.3, abs=0.01)


def test_a_gain_that_the_system_does_not_read_is_an_error(tmp_path):
    path = tmp_path / "mine.toml"
    for system, table in (("ars", "afs"), ("integrated", "esc"), ("integrated", "tv")):
        key = "limit_deg" if table == "afs" else "sideslip_deviations" if table == "esc" else "full_speed_mps"
        path.write_text(f'system = "{system}"\n[{table}]\n{key} = 2.0\n')
        with raises(ControllerError, file="mine.toml", line=3, key=f"{table}.{key}", value=2.0):
            read_variant(path)
    path.write_text('system = "integrated"\ninterval_s = 0.01\n[esc]\ntorque_limit_Nm = 900.0\n')
    assert read_variant(path).gains == {"interval_s": 0.01, "esc": {"torque_limit_Nm": 900.0}}

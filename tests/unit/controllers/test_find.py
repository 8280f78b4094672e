"""Controllers by name and from a user's file, and the messages for wrong ones."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path

import pytest

from activesteer.config import Range
from activesteer.controllers import (
    CONTROLLER,
    CONTROLLERS,
    FrontSuperposition,
    NoControl,
    RearSteer,
    declared_parameters,
    load_controller,
)
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement
from activesteer.errors import ControllerError
from activesteer.scenario import resolve
from tests.raising import raises
from tests.unit.controllers.cars import measured, setup, steering

ANGLE = Range(-1.0, 1.0)
HEAD = "import math\nimport numpy as np\nfrom activesteer import ActuatorCommand\n\n"


@pytest.fixture
def write(tmp_path):
    def write(body: str, name: str = "mine.py") -> Path:
        path = tmp_path / name
        path.write_text(HEAD + textwrap.dedent(body))
        return path

    return write


@pytest.fixture
def returning(write):
    """A controller whose step returns an expression."""

    def returning(expression: str):
        path = write(f"class Mine:\n    def step(self, command, measurement):\n        return {expression}\n")
        return load_controller(f"{path}:Mine", setup())

    return returning


@pytest.mark.parametrize(("name", "kind"), [("none", NoControl), ("ars", RearSteer), ("afs", FrontSuperposition)])
def test_built_in_controllers_are_found_by_name(name, kind):
    assert type(load_controller(name, setup())) is kind
    assert CONTROLLERS[name] is kind


@pytest.mark.parametrize(
    ("name", "names"),
    [(name, tuple(CONTROLLER.names())) for name in ("asr", "mine.py", "mine.py:", ":Mine")]
    + [("nowhere/mine.py:Mine", None)],
)
def test_wrong_name_is_answered(name, names):
    with raises(ControllerError, value=name, allowed=names):
        load_controller(name, setup())


def test_missing_class_is_answered_with_the_ones_in_the_file(write):
    path = write("from pathlib import Path\nclass MyController: ...\nclass Other: ...\n")
    with raises(ControllerError, value="MyControler", allowed=["MyController", "Other"]):
        load_controller(f"{path}:MyControler", setup())


def test_file_that_is_no_python_is_answered(write):
    path = write("class Mine: ...", "mine.txt")
    with raises(ControllerError, value=f"{path}:Mine"):
        load_controller(f"{path}:Mine", setup())


def test_constructor_that_wants_more_is_answered(write):
    path = write("class Mine:\n    def __init__(self, gains):\n        self.gains = gains\n")
    with raises(ControllerError, cause=TypeError, key=f"controller {path}:Mine"):
        load_controller(f"{path}:Mine", setup())


def test_class_without_step_is_answered(write):
    path = write("class Mine:\n    def stepp(self): ...\n")
    with raises(ControllerError, key=f"controller {path}:Mine"):
        load_controller(f"{path}:Mine", setup())


@pytest.mark.parametrize(
    ("expression", "value", "allowed"),
    [
        ("None", "None", ActuatorCommand),
        ("0.1", "0.1", ActuatorCommand),
        ("(0.1, 0.0, 0.0, 0.0, 0.0, False)", "(0.1, 0.0, 0.0, 0.0, 0.0, False)", ActuatorCommand),
        ("ActuatorCommand(math.nan)", "nan", ANGLE),
        ("ActuatorCommand(math.inf)", "inf", ANGLE),
        ("ActuatorCommand(superposition_demand_rad=-2.5)", "-2.5", ANGLE),
        ("ActuatorCommand('left')", "'left'", ANGLE),
        ("ActuatorCommand(None)", "None", ANGLE),
        ("ActuatorCommand(np.zeros(2))", "array([0., 0.])", ANGLE),
        ("ActuatorCommand(0.0, 0.0, None)", "None", None),
        ("ActuatorCommand(brake_torque_demand_Nm=100.0)", "100.0", None),
        ("ActuatorCommand(brake_torque_demand_Nm=(1.0, 2.0))", "(1.0, 2.0)", None),
        ("ActuatorCommand(brake_torque_demand_Nm=(0.0, math.nan, 0.0, 0.0))", "(0.0, nan, 0.0, 0.0)", None),
        ("ActuatorCommand(drive_torque_change_Nm=math.inf)", "inf", Range(-1e5, 1e5)),
        ("ActuatorCommand(side_difference_Pa=-1.0)", "-1.0", Range(0.0, 1e8)),
        ("ActuatorCommand(saturated='no')", "'no'", None),
    ],
)
def test_nonsense_is_answered_with_file_and_class(returning, expression, value, allowed):
    controller = returning(expression)
    with raises(ControllerError, allowed=allowed) as refused:
        controller.step(steering(0.0), measured(0.0))
    assert refused.value.key.endswith("mine.py:Mine")
    assert repr(refused.value.value) == value


def test_angle_in_degrees_is_answered_with_field_and_unit(returning):
    with raises(ControllerError, value=3.0, allowed=CONTROLLER.ranges["rear_steer_demand_rad"]) as refused:
        returning("ActuatorCommand(3.0)").step(steering(0.0), measured(0.0))
    assert "rear_steer_demand_rad" in refused.value.problem


@pytest.mark.parametrize(
    "expression",
    [
        "ActuatorCommand(np.float32(0.1))",
        "ActuatorCommand(0)",
        "ActuatorCommand(-1.0, 1.0)",
        "ActuatorCommand(brake_torque_demand_Nm=np.array([10.0, 0.0, 0.0, 0.0]))",
        "ActuatorCommand(brake_torque_demand_Nm=[10, 0, -5, 0])",
    ],
)
def test_numbers_of_all_kinds_are_taken(returning, expression):
    command = returning(expression).step(steering(0.0), measured(0.0))
    assert isinstance(command, ActuatorCommand)
    assert isinstance(command.brake_torque_demand_Nm, tuple), "which is what the native step takes"


def test_good_command_passes_the_check():
    steer = ActuatorCommand(0.05, -0.02, 0.3, 0.01, 0.04, True)
    assert CONTROLLER.checked(steer, "mine.py:Mine", setup()) is steer


def test_controllers_are_told_what_sensors_measure_and_nothing_else():
    allowed = {
        "time_s",
        "speed_mps",
        "yaw_rate_radps",
        "ay_mps2",
        "ax_mps2",
        "steering_wheel_rad",
        "rear_steer_rad",
        "superposition_rad",
        "wheel_speed_radps",
        "brake_pressure_Pa",
    }
    assert set(Measurement._fields) == allowed
    assert set(DriverCommand._fields) == {
        "steering_wheel_demand_rad",
        "front_steer_demand_rad",
        "drive_torque_demand_Nm",
        "brake_pedal",
        "saturated",
        "gear",
        "wheel_torques",
        "parking_brake",
    }


def test_parameters_of_every_controller_are_declared_alike():
    for name in CONTROLLER.names():
        declared = declared_parameters(name).items()
        resolve("straight_line", overrides={key: each.default for key, each in declared if each.default is not None})
    ars, tuned = declared_parameters("ars"), declared_parameters("ars_tuned")
    limit = ars["controllers.ars.limit_rad"]
    assert limit[:3] == (pytest.approx(math.radians(3.0)), "rad", Range(0.0, math.radians(10.0)))
    assert ars.keys() - tuned.keys() == {
        "controllers.ars.prediction_gain", "controllers.ars.corrector.deadband_start_radps",
        "controllers.ars.corrector.deadband_end_radps",
    }  # fmt: skip

"""User controllers and drivers: files with parameters, classes, objects and factories."""

from __future__ import annotations

import functools
import math
import os
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer import ActuatorCommand, DriverCommand, simulate
from activesteer.config import Range
from activesteer.controllers import controller_spec
from activesteer.core.signals import WheelTorques, new_message
from activesteer.driver import driver_spec
from activesteer.errors import ControllerError, DriverError, ParameterError
from activesteer.scenario import resolve, value_of
from tests.raising import raises
from tests.unit.controllers.cars import measured, setup, steering

SHORT = {"settle_s": 0.05, "duration_s": 0.3, "steer.start_s": 0.05, "steer.steering_wheel_deg": 30}


class Counting:
    """A controller whose angle grows with each step, so a carried-over state would be visible."""

    def __init__(self, gain: float = 1.0, offset_rad: float = 0.0) -> None:
        self.gain, self.offset_rad, self.count = gain, offset_rad, 0

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        self.count += 1
        return ActuatorCommand(self.offset_rad + 1e-5 * self.gain * self.count)


class FromSetup(Counting):
    @classmethod
    def from_vehicle(cls, setup: Any, gain: float = 1.0) -> FromSetup:
        return cls(gain, setup.timestep_s)


def factory(setup: Any, gain: float = 3.0) -> Counting:
    return Counting(gain, setup.timestep_s)


def first_angle(given: Any) -> float:
    return controller_spec(given).make(setup()).step(steering(0.0), measured(0.0)).rear_steer_demand_rad


@pytest.fixture
def write(tmp_path):
    def write(body: str, name: str = "mine.py") -> str:
        path = tmp_path / name
        path.write_text("from activesteer import DriverCommand, ActuatorCommand\n\n" + textwrap.dedent(body))
        return str(path)

    return write


@pytest.fixture
def gains(write):
    return write(
        """
        class Mine:
            def __init__(self, gain=1.0, side="left", *, limits=(1.0,)):
                self.gain, self.side, self.limits = gain, side, limits

            def step(self, command, measurement):
                return ActuatorCommand(0.001 * self.gain)
        """
    )


@pytest.mark.parametrize(
    ("given", "angle_rad"),
    [
        (Counting, 1e-5),
        (Counting(gain=2.0), 2e-5),
        (functools.partial(Counting, gain=4.0), 4e-5),
        (lambda: Counting(5.0), 5e-5),
        (FromSetup, 0.001 + 1e-5),
        (FromSetup(2.0), 2e-5),
        (factory, 0.001 + 3e-5),
        (functools.partial(factory, gain=1.0), 0.001 + 1e-5),
        (f"{__file__}:Counting?gain=2", 2e-5),
        (f"{__file__}:FromSetup?gain=2", 0.001 + 2e-5),
        (f"{__file__}:factory?gain=2", 0.001 + 2e-5),
        (Path(f"{__file__}:Counting"), 1e-5),
    ],
)
def test_class_object_factory_and_file_all_make_a_controller(given, angle_rad):
    assert first_angle(given) == pytest.approx(angle_rad, rel=1e-12)
    # Again from the beginning, whatever was done before.
    assert first_angle(given) == pytest.approx(angle_rad, rel=1e-12)


def test_object_used_twice_carries_nothing_over():
    mine = Counting()
    one, other = (simulate("step_steer", mine, overrides=SHORT) for _ in range(2))
    assert mine.count == 0
    assert np.array_equal(one["rear_steer_demand_rad"], other["rear_steer_demand_rad"])


@pytest.mark.parametrize(
    ("query", "parameters"),
    [
        ("", {}),
        ("?", {}),
        ("?gain=2", {"gain": 2}),
        ("?gain=-0.5&side=right", {"gain": -0.5, "side": "right"}),
        ('?side="a&b"', {"side": "a&b"}),
        ("?side=a:b&gain=1e-3", {"side": "a:b", "gain": 1e-3}),
        ("?limits=[1, 2]&gain=3", {"limits": [1, 2], "gain": 3}),
    ],
)
def test_parameters_of_a_file_are_typed_as_in_toml(gains, query, parameters):
    found = controller_spec(f"{gains}:Mine{query}")
    assert found.parameters == parameters
    inner = found.make(setup()).inner
    assert {key: getattr(inner, key) for key in parameters} == parameters


@pytest.mark.parametrize(
    ("query", "value", "allowed"),
    [
        ("?gian=2", "gian", ("gain", "side", "limits")),
        ("?zzzz=2", "zzzz", ("gain", "side", "limits")),
        ("?gain", "gain", None),
        ("?gain=1&gain=2", "gain", None),
    ],
)
def test_wrong_parameter_is_answered(gains, query, value, allowed):
    with raises(ControllerError, value=value, allowed=allowed):
        controller_spec(f"{gains}:Mine{query}")


def test_parameters_of_two_runs_tell_their_labels_apart(gains):
    labels = [controller_spec(f"{gains}:Mine{query}").label for query in ("", "?gain=1", "?gain=2", "?side=a/b")]
    assert labels == ["Mine", "Mine-gain=1", "Mine-gain=2", "Mine-side=a_b"]


def test_label_says_once_that_a_controller_of_a_file_uses_the_truth(write):
    file = write("""
        class Mine:
            uses_truth = True

            def __init__(self, gain: float = 1.0) -> None: ...

            def step(self, command, measurement, motion): ...
        """)
    assert controller_spec(f"{file}:Mine?gain=2").label == "Mine-gain=2+truth"


@pytest.mark.parametrize("given", [5, None, ["ars"], np.zeros(3), object()])
def test_wrong_object_is_answered(given):
    with raises(ControllerError, key="controller"):
        simulate("step_steer", given)
    with raises(DriverError, key="driver"):
        simulate("step_steer", driver=given)


@pytest.mark.parametrize("given", [int, dict, Path])
def test_class_that_is_no_controller_is_answered(given):
    with raises(ControllerError, value=given):
        controller_spec(given)


def test_factory_that_makes_something_else_is_answered():
    with raises(ControllerError, key="controller test_plugins.py:_lambda", value=5):
        controller_spec(lambda: 5).make(setup())


def test_object_that_cannot_be_copied_is_answered(tmp_path):
    class Logging(Counting):
        def __init__(self, path: Path) -> None:
            super().__init__()
            self.file = path.open("w")

    mine = Logging(tmp_path / "log")
    with mine.file, raises(ControllerError, key="controller test_plugins.py:Logging"):
        controller_spec(mine).make(setup())


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo, lambda path: path.symlink_to("/dev/zero"), lambda path: None])
def test_what_is_no_file_is_answered(tmp_path, make):
    make(tmp_path / "mine.py")
    with raises(ControllerError, value=f"{tmp_path}/mine.py:Mine"):
        controller_spec(f"{tmp_path}/mine.py:Mine")


def test_a_file_without_its_class_is_answered_with_the_form():
    with raises(ControllerError, value="mine.py") as told:
        controller_spec("mine.py")
    assert str(told.value) == "'mine.py' needs the name of its class, as in my_file.py:MyController"


@pytest.mark.parametrize(
    "name", ["~nobody_of_this_name/mine.py:Mine", "x" * 300 + ".py:Mine", "\udcff\0.py:Mine", "x:" + "y" * 9999, "x:\n"]
)
def test_name_that_no_file_can_have_is_answered(name):
    with pytest.raises(ControllerError) as told:
        controller_spec(name)
    assert len(told.value.problem) < 700


@pytest.mark.parametrize("text", ["exit(3)", "raise KeyboardInterrupted", "x" * 3_000_000, "(" * 500, "\0", "1/0"])
def test_file_that_does_not_run_is_answered(tmp_path, text):
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(ControllerError) as refused:
        controller_spec(f"{path}:Mine")
    assert refused.value.value in (path, f"{path}:Mine")


@pytest.mark.parametrize(
    "text", ["exit()", "import sys; sys.exit(0)", "raise GeneratorExit", "raise BaseException('no')"]
)
@pytest.mark.parametrize("place", ["file", "__init__", "step"])
def test_any_exception_of_the_user_s_code_is_answered_with_its_line(write, text, place):
    step = text if place == "step" else "return ActuatorCommand()"
    body = f"{text if place == 'file' else ''}\nclass Mine:\n    def __init__(self):\n        "
    body += f"{text if place == '__init__' else 'pass'}\n    def step(self, command, measurement):\n        {step}\n"
    given = f"{write(body)}:Mine"
    with raises(ControllerError, key=f"controller {given}") as refused:
        simulate("step_steer", given, overrides=SHORT)
    line = {"file": 3, "__init__": 6, "step": 8}[place]
    assert f"(mine.py, line {line})" in refused.value.problem
    assert place == "file" or "Mine" in refused.value.problem


@pytest.mark.parametrize("place", ["__init__", "step"])
def test_ctrl_c_in_the_user_s_code_stays_ctrl_c(place):
    class Interrupted(Counting):
        pass

    def interrupt(self: Any, *_: Any) -> None:
        raise KeyboardInterrupt

    setattr(Interrupted, place, interrupt)
    with pytest.raises(KeyboardInterrupt):
        simulate("step_steer", Interrupted, overrides=SHORT)


def test_line_of_an_error_is_the_user_s_own(write):
    given = write(
        """
        import json

        class Mine:
            def step(self, command, measurement):
                return json.loads("{")
        """
    )
    with raises(ControllerError) as refused:
        simulate("step_steer", f"{given}:Mine", overrides=SHORT)
    assert "Mine.step raised JSONDecodeError" in refused.value.problem
    assert "(mine.py, line 8)" in refused.value.problem


IMPORTS = {
    "module": "from beside import GAIN",
    "package": "from group.part import GAIN",
    "within a function": "",
}


@pytest.mark.parametrize("how", IMPORTS)
def test_a_module_beside_the_file_can_be_imported(write, tmp_path, how):
    (tmp_path / "beside.py").write_text("GAIN = 2.0\n")
    (tmp_path / "group").mkdir()
    (tmp_path / "group" / "__init__.py").write_text("")
    (tmp_path / "group" / "part.py").write_text("from beside import GAIN\n")
    body = (
        f"{IMPORTS[how]}\nclass Mine:\n    def step(self, command, measurement):\n"
        f"        {IMPORTS[how] or 'from beside import GAIN'}\n        return ActuatorCommand(0.001 * GAIN)\n"
    )
    given = f"{write(body)}:Mine"
    run = simulate("step_steer", given, overrides=SHORT)
    assert (run["rear_steer_demand_rad"] == 0.002).all()
    assert {"mine.py", "beside.py"} <= set(run.attachments)
    # A change counts, even within the same second, and a module of the same name elsewhere does not.
    (tmp_path / "beside.py").write_text("GAIN = 3.0\n")
    assert (simulate("step_steer", given, overrides=SHORT)["rear_steer_demand_rad"] == 0.003).all()
    other = tmp_path / "other"
    other.mkdir()
    (other / "beside.py").write_text("GAIN = 4.0\n")
    (other / "mine.py").write_text((tmp_path / "mine.py").read_text())
    if how != "package":
        elsewhere = simulate("step_steer", f"{other / 'mine.py'}:Mine", overrides=SHORT)
        assert (elsewhere["rear_steer_demand_rad"] == 0.004).all()
    assert str(tmp_path) not in sys.path


def test_a_file_beside_our_own_package_uses_the_package_that_runs(write, tmp_path):
    """As in the root of a checkout: a second copy of the package would have other classes of commands."""
    (tmp_path / "activesteer").mkdir()
    (tmp_path / "activesteer" / "__init__.py").write_text("ActuatorCommand = dict\n")
    given = write(
        "from activesteer import ActuatorCommand\nclass Mine:\n    def step(self, command, measurement):\n"
        "        return ActuatorCommand(rear_steer_demand_rad=0.002)\n"
    )
    run = simulate("step_steer", f"{given}:Mine", overrides=SHORT)
    assert (run["rear_steer_demand_rad"] == 0.002).all()
    assert not any(name.startswith("activesteer/") for name in run.attachments)


def test_a_module_that_the_program_imported_itself_stays_as_it_is(write, tmp_path, monkeypatch):
    (tmp_path / "apart.py").write_text("GAIN = 2.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    import apart  # type: ignore[import-not-found]  # noqa: PLC0415

    try:
        apart.GAIN = 5.0
        given = write(
            """
            from apart import GAIN

            class Mine:
                def step(self, command, measurement):
                    return ActuatorCommand(0.001 * GAIN)
            """
        )
        run = simulate("step_steer", f"{given}:Mine", overrides=SHORT)
        assert (run["rear_steer_demand_rad"] == 0.002).all()
        assert sys.modules["apart"] is apart
    finally:
        del sys.modules["apart"]


def test_source_and_parameters_are_recorded():
    run = simulate("step_steer", Counting(gain=2.0), overrides=SHORT)
    assert run.metadata["controller"] == "test_plugins.py:Counting"
    assert run.metadata["controller_parameters"] == {"gain": 2.0, "offset_rad": 0.0, "count": 0}
    assert run.attachments["test_plugins.py"] == Path(__file__).read_bytes()
    assert run.metadata["driver"]["name"] == "typical"


# Drivers


class Robot:
    """A driver that steers over the time of the sensors, and brakes."""

    def __init__(self, angle_rad: float = 0.5) -> None:
        self.angle_rad = angle_rad

    def step(self, setpoint: Any, measurement: Any, motion: Any) -> DriverCommand:
        assert math.hypot(motion.x_m, motion.y_m) < 10.0
        return DriverCommand(self.angle_rad if measurement.time_s > 0.1 else 0.0, brake_pedal=0.1)


@pytest.mark.parametrize("given", [Robot, Robot(), lambda: Robot(0.5), f"{__file__}:Robot?angle_rad=0.5"])
def test_users_driver_drives(given):
    run = simulate("step_steer", driver=given, overrides=SHORT)
    time_s = run.time_s
    # It counts from the beginning of the recording: nothing happens while the car settles.
    demand = run["front_steer_demand_rad"] * resolve("step_steer").car.config.steering.ratio
    assert demand[time_s > 0.1011] == pytest.approx(0.5)
    assert not demand[time_s < 0.0999].any()
    assert run["brake_pedal"] == pytest.approx(0.1)
    assert run["yaw_rate_radps"][-1] > 0.01
    assert run.metadata["driver"]["name"].endswith(("Robot", "lambda", "Robot?angle_rad=0.5"))


def test_driver_on_a_path_is_given_the_path():
    class Follower:
        def __init__(self) -> None:
            self.paths: set[int] = set()

        def step(self, setpoint: Any, measurement: Any, motion: Any) -> DriverCommand:
            assert (setpoint.path is None) == (measurement.time_s < -1e-9)
            return DriverCommand()

    simulate("double_lane_change", driver=Follower, overrides={"settle_s": 0.05})


@pytest.mark.parametrize(
    ("expression", "value", "allowed"),
    [
        ("None", "None", DriverCommand),
        ("ActuatorCommand()", repr(ActuatorCommand()), DriverCommand),
        ("DriverCommand(float('nan'))", "nan", Range(-50.0, 50.0)),
        ("DriverCommand(90.0)", "90.0", Range(-50.0, 50.0)),
        ("DriverCommand(brake_pedal=1.5)", "1.5", Range(0.0, 1.0)),
        ("DriverCommand(drive_torque_demand_Nm=float('inf'))", "inf", Range(-1e6, 1e6)),
        ("DriverCommand(saturated=None)", "None", None),
        ("DriverCommand(wheel_torques=(1, 2, 3, 4))", "(1, 2, 3, 4)", None),
        ("DriverCommand(0.5, front_steer_demand_rad=0.5)", "0.5", None),
    ],
)
def test_nonsense_of_a_driver_is_answered(write, expression, value, allowed):
    path = write(f"class Mine:\n    def step(self, setpoint, measurement, motion):\n        return {expression}\n")
    with raises(DriverError, key=f"driver {path}:Mine", allowed=allowed) as refused:
        simulate("step_steer", driver=f"{path}:Mine", overrides=SHORT)
    assert repr(refused.value.value) == value


def test_error_in_the_step_of_a_driver_is_answered_with_its_line(write):
    path = write("class Mine:\n    def step(self, setpoint, measurement, motion):\n        return 1 / 0\n")
    with raises(DriverError, cause=ZeroDivisionError, key=f"driver {path}:Mine") as refused:
        simulate("step_steer", driver=f"{path}:Mine", overrides=SHORT)
    assert "mine.py, line 5" in refused.value.problem


def test_a_subclass_of_a_command_is_accepted():
    class Own(ActuatorCommand):
        pass

    class Steers:
        def step(self, *_: Any) -> ActuatorCommand:
            return Own(0.01, 0.0)

    assert (simulate("step_steer", Steers, overrides=SHORT)["rear_steer_demand_rad"] == 0.01).all()


@pytest.mark.parametrize("length", [0, 9, 11])
def test_a_command_of_another_length_is_answered(length):
    class Short:
        def step(self, *_: Any) -> ActuatorCommand:
            return new_message(ActuatorCommand, (0.0,) * length)

    with raises(ControllerError):
        simulate("step_steer", Short, overrides=SHORT)


def test_torques_of_the_wheels_are_checked():
    class Torquey:
        def __init__(self, *torques: Any) -> None:
            self.torques = WheelTorques(*torques)

        def step(self, *_: Any) -> DriverCommand:
            return DriverCommand(wheel_torques=self.torques)

    simulate("step_steer", driver=Torquey((10.0,) * 4, (0.0,) * 4), overrides=SHORT)
    for wrong in (((math.nan,) * 4, (0.0,) * 4), ((1.0,) * 3, (0.0,) * 4), (5.0, 5.0)):
        with raises(DriverError, key="driver test_plugins.py:Torquey"):
            simulate("step_steer", driver=Torquey(*wrong), overrides=SHORT)


def test_unknown_driver_is_answered():
    with raises(DriverError, value="typicle", allowed=("expert", "novice", "typical")):
        driver_spec("typicle")


YAW_BETA = """
    from typing import Annotated
    from activesteer.config import Range


    class YawBeta:
        PARAMETERS = {"k_beta": {"unit": "rad/rad", "range": (0.0, 3.0)}}

        def __init__(self, setup, k_beta=0.4, k_yaw: float = 0.1, limit_rad: Annotated[float, Range(0.0, 0.1)] = 0.05):
            self.values = k_beta, k_yaw, limit_rad

        def step(self, command, measurement):
            return ActuatorCommand(0.001 * self.values[0])
    """


def test_declared_parameters_have_name_default_unit_and_range(write):
    declared = controller_spec(f"{write(YAW_BETA)}:YawBeta").declared
    assert [(name, each.default, each.unit) for name, each in declared.items()] == [
        ("k_beta", 0.4, "rad/rad"), ("k_yaw", 0.1, ""), ("limit_rad", 0.05, "rad"),
    ]  # fmt: skip
    assert [each.limits for each in declared.values()] == [Range(0.0, 3.0), Range(), Range(0.0, 0.1)]


def test_key_of_a_parameter_means_the_same_as_the_question_mark(write):
    given, changed = f"{write(YAW_BETA)}:YawBeta", {"controllers.YawBeta.k_beta": 2, "controllers.YawBeta.limit_deg": 3}
    scenario = resolve("straight_line", overrides=changed, controllers=["none", given])
    made = controller_spec(given).make(scenario.controller_setup(0.001)).inner
    asked = controller_spec(f"{given}?k_beta=2&limit_deg=3").make(setup()).inner
    assert made.values == asked.values == (2.0, 0.1, pytest.approx(math.radians(3.0)))
    assert value_of(scenario, "controllers.YawBeta.limit_deg", [given]) == pytest.approx(3.0)
    assert value_of(scenario, "controllers.YawBeta.k_yaw", [given]) == 0.1
    recording = simulate("step_steer", given, overrides={**SHORT, **changed})
    assert recording.metadata["controller_parameters"]["k_beta"] == 2
    assert recording["rear_steer_demand_rad"][-1] == pytest.approx(0.002)


@pytest.mark.parametrize(
    ("query", "key", "value"),
    [
        ("", "controllers.YawBeta.k_bta", 1.0),
        ("", "controllers.YawBeta.k_beta", 5.0),
        ("", "controllers.YawBeta.k_yaw", "fast"),
        ("?k_beta=1", "controllers.YawBeta.k_beta", 2.0),
        ("", "controllers.YawBta.k_beta", None),
        ("", "controllers.arz.limit_deg", None),
    ],
)
def test_wrong_key_of_an_own_parameter_is_answered(write, query, key, value):
    with raises(ParameterError, key=key):
        simulate("step_steer", f"{write(YAW_BETA)}:YawBeta{query}", overrides={key: value})


def test_own_parameter_needs_its_controller(write):
    changed = {"controllers.YawBeta.k_beta": 1.0}
    with raises(ParameterError, key="controllers.YawBeta.k_beta"):
        simulate("step_steer", "ars", overrides=changed)
    with raises(ParameterError, key="controllers.Counting"):
        simulate("step_steer", Counting(), overrides={"controllers.Counting.gain": 2.0})


@pytest.mark.parametrize("name", ["lqr", "estimator", "ars_tuned"])
def test_class_with_the_name_of_a_built_in_controller_is_refused(write, name):
    with raises(ControllerError, value=name):
        controller_spec(f"{write(YAW_BETA.replace('YawBeta', name))}:{name}")


def test_wrong_declaration_is_answered(write):
    path = write(YAW_BETA.replace('"k_beta": {', '"k_bta": {'))
    with raises(ControllerError):
        controller_spec(f"{path}:YawBeta")


def test_parameter_of_an_own_driver_is_a_key_too(write):
    path = write(
        """
        class Holds:
            def __init__(self, angle_rad=0.1):
                self.angle_rad = angle_rad

            def step(self, setpoint, measurement, motion):
                return DriverCommand(steering_wheel_demand_rad=self.angle_rad, gear=0)
        """
    )
    changed = {"driver.Holds.angle_deg": 20, "driver.preview_s": 1.1}
    scenario = resolve("straight_line", overrides=changed, driver=f"{path}:Holds")
    assert value_of(scenario, "driver.Holds.angle_deg") == pytest.approx(20.0)
    assert scenario.driver.parameters.preview_s == 1.1
    run = simulate("straight_line", driver=f"{path}:Holds", overrides={**changed, "duration_s": 0.2})
    assert run["steering_wheel_demand_rad"][-1] == pytest.approx(math.radians(20.0))
    with raises(ParameterError):
        resolve("straight_line", overrides={"driver.Holds.angl_deg": 20}, driver=f"{path}:Holds")


@pytest.mark.parametrize(
    ("body", "attribute"),
    [
        ("def __init__(self, setup): self.length_m = setup.wheelbase_m", "single_track.wheelbase_m"),
        ("def __init__(self, setup): self.gains = setup.gains.lqr.rear_scale", "rear_scale_rad"),
        ("def step(self, command, measurement): return measurement.yawrate_radps", "yaw_rate_radps"),
    ],
)
def test_misspelt_attribute_is_answered_with_the_nearest(write, body, attribute):
    step = "" if "step" in body else "\n            def step(self, command, measurement): return ActuatorCommand()"
    path = write(f"class Mine:\n    {body}{step}".replace("            def", "    def"))
    with pytest.raises(ControllerError, match=f"did you mean .*{attribute}"):
        controller_spec(f"{path}:Mine").make(setup()).step(steering(0.0), measured(0.0))


def test_a_syntax_error_names_only_the_users_file_and_line(write: Any) -> None:
    with pytest.raises(ControllerError) as caught:
        controller_spec(write("class Mine:\n    def step(self, command, measurement)\n        return None\n") + ":Mine")
    assert "mine.py, line 4" in str(caught.value)
    assert "frozen" not in str(caught.value)

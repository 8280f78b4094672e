"""FMUs as controllers and drivers: bit equality, units, parameters, states, faults, hostile archives."""

import importlib.util
import math
import pickle
import re
import shutil
import stat
import zipfile
from pathlib import Path

import numpy as np
import pytest

import activesteer
from activesteer.controllers import controller_spec
from activesteer.core.signals import DriverCommand, Measurement
from activesteer.driver import driver_spec
from activesteer.errors import ControllerError, DriverError
from activesteer.scenario import resolve

HERE = Path(__file__).parent
EXAMPLES = Path(__file__).resolve().parents[4] / "examples" / "fmu"
MEASUREMENT = Measurement(0.0, 20.0, math.radians(5.0), 0.0, 0.0, 0.0, 0.0, 0.0, (60.0, 60.0, 60.0, 60.0))
SHORT = {"settle_s": 0.5, "duration_s": 1.0}
needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
pytestmark = [needs_compiler, pytest.mark.skipif(importlib.util.find_spec("fmpy") is None, reason="needs fmpy")]


def compiled(source, version, folder):
    spec = importlib.util.spec_from_file_location("build_fmus", EXAMPLES / "build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.build(source, version, folder)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    sources = [EXAMPLES / "paper_afs.c", EXAMPLES / "yaw_damper.c", HERE / "faulty.c"]
    for source in sources:
        for version in (2, 3):
            compiled(source, version, folder)
    return folder


def changed(fmu, target, edits=(), left_out="", added=()):
    """Copy an FMU with replacements in its description, without some members, and with others."""
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                for before, after in edits:
                    assert re.search(before, content.decode())
                    content = re.sub(before, after, content.decode()).encode()
            if not left_out or left_out not in name:
                new.writestr(name, content)
        for info, content in added:
            new.writestr(info, content)
    return str(target)


def made(given, **setup):
    return controller_spec(given).make(resolve("straight_line").controller_setup(setup.get("timestep_s", 1e-3)))


@pytest.mark.parametrize("version", [2, 3])
def test_the_papers_afs_in_c_equals_the_built_in_controller_to_the_last_bit(fmus, version):
    angle = {"settle_s": 0.5, "steer.steering_wheel_deg": 140.0}
    ours = activesteer.simulate("sine_with_dwell", "afs", overrides=angle)
    theirs = activesteer.simulate("sine_with_dwell", fmus / f"paper_afs_fmi{version}.fmu", overrides=angle)
    assert np.ptp(ours["superposition_demand_rad"]) > 0.01
    for channel in ours.channels:
        assert np.array_equal(ours[channel.name], theirs[channel.name]), channel.name


@pytest.mark.parametrize("version", [2, 3])
def test_units_are_converted_as_declared_and_names_need_no_unit(fmus, version):
    command = made(fmus / f"faulty_fmi{version}.fmu").step(DriverCommand(), MEASUREMENT)
    assert command.rear_steer_demand_rad == pytest.approx(math.radians(0.002 * 5.0), rel=1e-12)


def test_a_map_names_signal_and_unit(fmus, tmp_path):
    shutil.copy(fmus / "faulty_fmi2.fmu", fmu := tmp_path / "mine.fmu")
    toml = tmp_path / "mine.toml"
    toml.write_text(
        'yaw_rate = { signal = "steering_wheel_rad", unit = "rad" }\nrear_steer_demand = { unit = "rad" }\n'
    )
    command = made(fmu).step(DriverCommand(), MEASUREMENT._replace(steering_wheel_rad=3.0))
    assert command.rear_steer_demand_rad == pytest.approx(0.006)
    for text, said in (
        ('yaw_rate = { signal = "yawrate" }', "line 1: yaw_rate.signal: .* did you mean 'yaw_rate_radps'"),
        ('yaw_rate = { unit = "deg/h" }', "'deg/h' is not a known unit"),
        ('yaw_rate = { unit = "m" }', "is in m, but yaw_rate_radps is in rad/s"),
        ('yaw = { unit = "deg" }', "has no input or output 'yaw'; did you mean 'yaw_rate'"),
        ('yaw_rate = { signal = "wheel_torques" }', "wheel_torques is not a number"),
        ("yaw_rate = 3", "write yaw_rate = "),
    ):
        toml.write_text(text)
        with pytest.raises(ControllerError, match=said):
            controller_spec(fmu)


def test_a_path_is_no_signal_of_an_fmu(fmus, tmp_path):
    fmu = changed(
        fmus / "yaw_damper_fmi2.fmu", tmp_path / "d.fmu", [("rear_steer_demand_rad", "steering_wheel_demand_rad")]
    )
    (tmp_path / "d.toml").write_text('yaw_rate_radps = { signal = "path" }')
    with pytest.raises(DriverError, match="path is not a number"):
        driver_spec(fmu)


def test_an_fmu_drives(fmus, tmp_path):
    edits = [("rear_steer_demand_rad", "steering_wheel_demand_rad"), ("yaw_rate_radps", "curvature_demand_1pm"),
             ("unit='rad/s'", "")]  # fmt: skip
    fmu = changed(fmus / "yaw_damper_fmi3.fmu", tmp_path / "d.fmu", edits)
    with pytest.raises(DriverError, match="this manoeuvre gives no curvature_demand_1pm"):
        activesteer.simulate("straight_line", driver=fmu, overrides=SHORT)
    fmu = changed(
        fmus / "yaw_damper_fmi3.fmu", tmp_path / "e.fmu", [*edits[:1], ("yaw_rate_radps", "motion.yaw_rate_radps")]
    )
    run = activesteer.simulate("straight_line", driver=f"{fmu}?gain_s=-1.0", overrides=SHORT)
    assert run["steering_wheel_demand_rad"].any()


def test_variables_without_a_signal_are_listed_in_one_message(fmus, tmp_path):
    fmu = changed(fmus / "paper_afs_fmi2.fmu", tmp_path / "x.fmu", [("speed_mps'", "v'"), ("correction_rad", "c")])
    with pytest.raises(ControllerError, match=r"inputs v and outputs c; .* write x.toml"):
        controller_spec(fmu)


def test_parameters_are_keys_and_set_before_the_initialisation(fmus, tmp_path):
    base = made(fmus / "yaw_damper_fmi2.fmu").step(DriverCommand(), MEASUREMENT).rear_steer_demand_rad
    double = made(f"{fmus}/yaw_damper_fmi2.fmu?gain_s=0.1").step(DriverCommand(), MEASUREMENT).rear_steer_demand_rad
    assert double == 2.0 * base
    with pytest.raises(ControllerError, match="gain_s"):
        made(f"{fmus}/yaw_damper_fmi2.fmu?gain=0.1")
    changes = {"controllers.yaw_damper_fmi2.limit_deg": 2.0, "controllers.yaw_damper_fmi2.gain_s": 0.1}
    fmu = fmus / "yaw_damper_fmi2.fmu"
    setup = resolve("straight_line", overrides=changes, controllers=[fmu]).controller_setup(1e-3)
    assert controller_spec(fmu).make(setup).step(DriverCommand(), MEASUREMENT).rear_steer_demand_rad == double
    shutil.copy(fmu, taken := tmp_path / "lqr.fmu")
    with pytest.raises(ControllerError, match="cannot have the name 'lqr'"):
        controller_spec(taken)


@pytest.mark.parametrize("text", ["yaw_damper_fmi2.fmu", "yaw_damper_fmi3.fmu?isolate=20"])
def test_a_run_continues_from_a_saved_state_bit_by_bit(fmus, text):
    simulation = activesteer.Simulation("straight_line", f"{fmus}/{text}", overrides=SHORT)
    simulation.advance(600)
    state = simulation.save_state()
    copies = [simulation.copy(), pickle.loads(pickle.dumps(simulation))]
    simulation.advance(200)
    after = simulation.truth
    simulation.restore_state(state)
    for other in (*copies, simulation):
        other.advance(100)
    for other in (*copies, simulation):
        other.advance(100)
        assert other.truth == after


def test_an_fmu_that_cannot_save_its_state_says_so(fmus, tmp_path):
    able = "canGetAndSetFMUstate='true'"
    fmu = changed(fmus / "yaw_damper_fmi2.fmu", tmp_path / "x.fmu", [(able, able.replace("true", "false"))])
    simulation = activesteer.Simulation("straight_line", fmu, overrides=SHORT)
    simulation.advance(5)
    with pytest.raises(ControllerError, match="cannot save its state"):
        simulation.save_state()
    simulation.advance(5)


@pytest.mark.parametrize(
    ("fault", "said"),
    [(1, "rear_steer_demand = nan.* finite"), (2, "DoStep returned discard"), (3, "returned error"),
     (4, "returned fatal"), (7, r"rear_steer_demand_rad = 1.7.*radians, not degrees")],
)  # fmt: skip
def test_a_failure_is_one_typed_error_and_the_recording_is_kept(fmus, fault, said):
    controller = f"{fmus}/faulty_fmi{2 + fault % 2}.fmu?fault={fault}"
    with pytest.raises(ControllerError, match=said) as caught:
        activesteer.simulate("straight_line", controller, overrides=SHORT)
    assert 490 <= len(caught.value.recording) <= 500


@pytest.mark.parametrize(
    ("fault", "said"), [(5, "crashed during the step at .*SIGSEGV"), (6, "hangs: the step at .* 1 s")]
)
def test_an_isolated_fmu_may_crash_or_hang(fmus, fault, said):
    with pytest.raises(ControllerError, match=said) as caught:
        activesteer.simulate("straight_line", f"{fmus}/faulty_fmi2.fmu?isolate=1&fault={fault}", overrides=SHORT)
    assert 490 <= len(caught.value.recording) <= 500


@pytest.mark.parametrize(
    ("edits", "left_out", "said"),
    [
        ([("guid='[^']*'", "guid='other'")], "", "cannot be instantiated .*token other"),
        ([], "binaries", "has no binary for Linux on x86-64 .*; it has none"),
        ([("<CoSimulation", "<ModelExchange")], "", "modelDescription.xml is invalid"),
        ([("fmiVersion='2.0'", "fmiVersion='1.5'")], "", "is invalid|has FMI"),
        ([("<CoSimulation ", "<CoSimulation needsExecutionTool='true' ")], "", "needs the tool that made it"),
        ([("modelIdentifier='yaw_damper'", "modelIdentifier='../x'")], "", "is not the name of a library|invalid"),
        ([("^", "<!DOCTYPE a [<!ENTITY b 'c'>]>")], "", "without a document type"),
        ([("Real start", "Real nonsense='1' start")], "", "modelDescription.xml is invalid.*nonsense"),
        ([("Real start='[^']*'", "Real start='INF'")], "", "starts at inf; a finite number is needed"),
        ([("Real start='[^']*'", "Real start='-1e400'")], "", "starts at -inf; a finite number is needed"),
    ],
)
def test_a_wrong_fmu_is_refused(fmus, tmp_path, edits, left_out, said):
    fmu = changed(fmus / "yaw_damper_fmi2.fmu", tmp_path / "x.fmu", edits, left_out)
    with pytest.raises(ControllerError, match=said):
        made(fmu)


def test_an_archive_cannot_write_outside_of_its_folder_or_fill_the_disk(fmus, tmp_path, monkeypatch):
    link = zipfile.ZipInfo("resources/link")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    for info in ("../evil", "/evil", "resources/../../evil", "a\\evil", link):
        fmu = changed(fmus / "yaw_damper_fmi2.fmu", tmp_path / "x.fmu", added=[(info, "/etc")])
        with pytest.raises(ControllerError, match="outside of the FMU"):
            controller_spec(fmu)
    monkeypatch.setattr("activesteer.core.limits.MAX_FMU_UNPACKED_BYTES", 10_000)
    fmu = changed(fmus / "yaw_damper_fmi2.fmu", tmp_path / "x.fmu", added=[("resources/zeros", bytes(100_000))])
    with pytest.raises(ControllerError, match="unpacked bytes; at most 10000"):
        controller_spec(fmu)
    (tmp_path / "x.fmu").write_bytes((fmus / "yaw_damper_fmi2.fmu").read_bytes()[:-100])
    with pytest.raises(ControllerError, match="is not an FMU"):
        controller_spec(tmp_path / "x.fmu")


def test_an_fmu_steps_at_its_own_multiple_and_its_output_is_held(fmus, tmp_path):
    experiment = [("<ModelVariables>", "<DefaultExperiment stepSize='0.01'/><ModelVariables>")]
    fixed = [("canHandleVariableCommunicationStepSize='true'", "canHandleVariableCommunicationStepSize='false'")]
    fmu = changed(fmus / "yaw_damper_fmi2.fmu", tmp_path / "x.fmu", experiment + fixed)
    angle = activesteer.simulate("straight_line", fmu, overrides=SHORT)["rear_steer_demand_rad"]
    changes = np.flatnonzero(np.diff(angle))
    assert 10 < changes.size <= 100
    # It steps with the first step of the car, 2 s before the recording, and with every tenth one after.
    assert np.unique((changes + 1) % 10).tolist() == [0]
    with pytest.raises(ControllerError, match=r"makes steps of 0\.01 s"):
        made(fmu, timestep_s=0.015)

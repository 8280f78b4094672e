"""The direct solution gives the engine's step for every model, or leaves the step to the engine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import pytest

from activesteer.core.signals import ActuatorCommand, DriverCommand
from activesteer.errors import ModelError, SimulationDiverged
from activesteer.scenario import load_car
from activesteer.vehicle.implicit_plan import ARRAYS, OPTIONS, handed_over
from tests.unit.vehicle.cars import standing, tilted_and_moving
from tests.unit.vehicle.random_models import RandomModel, Stepper, differences, thrown

TOLERANCE = 1e-9
INERTIA = int(mujoco.mjtWarning.mjWARN_INERTIA)


def _compare(model: mujoco.MjModel, ours: mujoco.MjData, rng: np.random.Generator, steps: int = 1) -> bool:
    """Step a state by the plan and by the engine; return True if the direct solution stepped."""
    engine = mujoco.MjData(model)
    mujoco.mj_copyData(engine, model, ours)
    inputs = rng.normal(size=(steps, model.nu))
    stepper = Stepper(model, ours)
    stepper.step(inputs)
    for row in inputs:
        engine.ctrl[:] = row
        mujoco.mj_step(model, engine)
    found = differences(ours, engine)
    assert max(found.values()) < TOLERANCE, (found, handed_over(model))
    return stepper.direct


@pytest.mark.parametrize("batch", [0, *(pytest.param(batch, marks=pytest.mark.slow) for batch in range(1, 10))])
def test_random_models_step_as_in_the_engine(batch: int) -> None:
    """30 models each, see `RandomModel`; two steps, so that what the first leaves behind counts too."""
    direct = 0
    for seed in range(30 * batch, 30 * batch + 30):
        rng = np.random.default_rng(seed)
        model = mujoco.MjModel.from_xml_string(RandomModel(rng).xml)
        data = mujoco.MjData(model)
        thrown(model, data, rng)
        direct += _compare(model, data, rng, steps=2)
    assert 10 <= direct < 30, "both kinds of models occur"


@pytest.mark.parametrize("name", ["compact", "sedan", "tesla_model_s"])
def test_cars_of_other_masses_springs_and_servos_step_as_in_the_engine(name: str, rng: np.random.Generator) -> None:
    vehicle = load_car(name).on()
    model = vehicle.model
    model.opt.tolerance = 1e-14
    drawn = ("body_mass", "tendon_stiffness", "tendon_damping", "dof_damping", "actuator_gainprm", "actuator_biasprm")
    designed = {name: getattr(model, name).copy() for name in drawn}
    standing_still = vehicle.save_state()
    for _ in range(20):
        for array, values in designed.items():
            # The native forces expect one factor for the gain and the bias of a servo, and so does a servo.
            factors = rng.uniform(0.5, 2.0, values.shape[:1] + (1,) * (values.ndim - 1))
            getattr(model, array)[:] = factors * values
        vehicle.restore_state(standing_still)
        tilted_and_moving(vehicle, rng)
        assert _compare(model, vehicle.data, rng)


BODY = """<mujoco><option timestep="0.001" integrator="discrete" tolerance="1e-14">
<flag contact="disable" eulerdamp="disable"/></option><worldbody>{other}<body name="a"><freejoint/>
<inertial mass="10" pos="0.1 0 0" diaginertia="1 2 2.5"/><site name="s"/><body name="b" pos="1 0 0">
<joint name="j" axis="0 1 0" {joint}/><inertial mass="2" pos="0.1 0 0" diaginertia="0.1 0.2 0.2"/></body></body>
</worldbody><actuator><position joint="j" kp="500" kv="2"/></actuator><sensor>{sensor}</sensor></mujoco>"""


@pytest.mark.parametrize(
    "parts",
    [
        {"joint": "actuatorfrclimited='true' actuatorfrcrange='-5 5'"},
        {"joint": "damping='-3'"},
        {"other": "<body><freejoint/><inertial mass='1' pos='0 0.2 0' diaginertia='0.1 0.14 0.2'/></body>"},
        {"sensor": "<e_potential/>"},
        {"joint": "limited='true' range='-0.02 9'", "sensor": "<jointlimitpos joint='j'/><jointlimitvel joint='j'/>"},
    ],
    ids=["actuatorfrcrange", "negative damping", "free body alone", "potential energy", "sensor of a limit"],
)
def test_what_was_once_silently_wrong(parts: dict[str, str], rng: np.random.Generator) -> None:
    model = mujoco.MjModel.from_xml_string(BODY.format(**({"joint": "", "other": "", "sensor": ""} | parts)))
    data = mujoco.MjData(model)
    data.qvel[:] = 5.0 * rng.normal(size=model.nv)
    data.qpos[-1] = -0.02
    _compare(model, data, rng, steps=20)


@pytest.mark.parametrize("array", ["dof_damping", "tendon_damping"])
def test_negative_damping_of_a_car_counts_as_in_the_engine(array: str, rng: np.random.Generator) -> None:
    vehicle = standing()
    vehicle.model.opt.tolerance = 1e-14
    getattr(vehicle.model, array)[:] *= -0.5
    tilted_and_moving(vehicle, rng)
    assert _compare(vehicle.model, vehicle.data, rng)


def _ball(model: mujoco.MjModel) -> int:
    return int(np.flatnonzero(model.jnt_type == int(mujoco.mjtJoint.mjJNT_BALL))[0])


def _limit_actuators(model: mujoco.MjModel) -> None:
    joint = model.joint("rl_steer").id
    model.jnt_actfrclimited[joint], model.jnt_actfrcrange[joint] = 1, (-5.0, 5.0)


CHANGES: dict[str, Callable[[mujoco.MjModel], Any]] = {
    "spring of a joint": lambda model: model.jnt_stiffness.__setitem__(3, 1e4),
    "damping polynomial of a joint": lambda model: model.dof_dampingpoly.__setitem__(8, 10.0),
    "dry friction": lambda model: model.dof_frictionloss.__setitem__(8, 10.0),
    "limit of a ball joint": lambda model: model.jnt_limited.__setitem__(_ball(model), 1),
    "actuatorfrcrange of a joint": _limit_actuators,
    "damping polynomial of a tendon": lambda model: model.tendon_dampingpoly.__setitem__(0, 1e3),
    "limit of a tendon": lambda model: model.tendon_limited.__setitem__(0, 1),
    "armature of a tendon": lambda model: model.tendon_armature.__setitem__(0, 3.0),
    "damping of an actuator": lambda model: model.actuator_damping.__setitem__(0, 3.0),
    "disabled actuators": lambda model: setattr(model.opt, "disableactuator", 1),
    "fluid": lambda model: setattr(model.opt, "viscosity", 0.1),
    "integrator": lambda model: setattr(model.opt, "integrator", int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)),
    "solver PGS": lambda model: setattr(model.opt, "solver", int(mujoco.mjtSolver.mjSOL_PGS)),
    "enable flags": lambda model: setattr(model.opt, "enableflags", int(mujoco.mjtEnableBit.mjENBL_ENERGY)),
    "contacts or eulerdamp": lambda model: setattr(model.opt, "disableflags", int(mujoco.mjtDisableBit.mjDSBL_CONTACT)),
}


@pytest.mark.parametrize("feature", CHANGES)
def test_a_change_at_run_time_hands_the_steps_over(feature: str) -> None:
    vehicle = standing()
    engine = mujoco.MjData(vehicle.model)
    plan = vehicle._implicit.plan
    assert plan["direct"] == 1
    CHANGES[feature](vehicle.model)
    assert handed_over(vehicle.model) == [feature]
    vehicle.follow_model()
    assert plan["direct"] == 0
    mujoco.mj_copyData(engine, vehicle.model, vehicle.data)
    vehicle.step(DriverCommand(0.3, 200.0), ActuatorCommand(0.02, 0.01))
    engine.ctrl[:] = vehicle.data.ctrl
    mujoco.mj_step(vehicle.model, engine)
    assert vehicle.data.qacc.tobytes() == engine.qacc.tobytes()


def test_the_direct_solution_steps_again_when_the_change_is_undone() -> None:
    vehicle = standing()
    for stiffness, direct in ((1e4, 0), (0.0, 1)):
        vehicle.model.jnt_stiffness[3] = stiffness
        vehicle.follow_model()
        assert vehicle._implicit.plan["direct"] == direct
    vehicle.step(DriverCommand(), ActuatorCommand())


def test_a_limit_that_is_set_at_run_time_acts() -> None:
    vehicle, name = standing(), "steering_wheel"
    joint = vehicle.model.joint(name).id
    vehicle.model.jnt_limited[joint], vehicle.model.jnt_range[joint] = 1, (-0.1, 0.1)
    vehicle.follow_model()
    for _ in range(300):
        vehicle.step(DriverCommand(1.0), ActuatorCommand())
    assert vehicle.data.nefc == 1
    assert vehicle.data.qfrc_constraint[vehicle.model.jnt_dofadr[joint]] < -1.0


def test_the_watch_holds_all_that_the_decision_reads() -> None:
    """The tables can change too; sizes and the tree of joints cannot."""
    read: set[str] = set()

    class Reader:
        def __init__(self, read_from: Any) -> None:
            self._from = read_from

        def __getattr__(self, name: str) -> Any:
            read.add(name)
            value = getattr(self._from, name)
            return Reader(value) if name == "opt" else value

    handed_over(Reader(standing().model))  # pyright: ignore[reportArgumentType]
    tree = {"body_treeid", "tree_dofnum", "jnt_bodyid", "opt", "neq", "nflex", "nplugin", "nplastic"}
    assert read - tree <= {*ARRAYS, *OPTIONS}
    assert len(read & {*ARRAYS, *OPTIONS}) > 20


def test_another_time_step_is_refused() -> None:
    vehicle = standing()
    vehicle.model.opt.timestep = 0.002
    with pytest.raises(ModelError, match=r"from 0\.001 to 0\.002 s"):
        vehicle.follow_model()


@pytest.mark.parametrize("array", ["body_mass", "body_inertia", "dof_armature"])
def test_a_negative_inertia_is_refused(array: str) -> None:
    vehicle = standing()
    getattr(vehicle.model, array)[8] = -0.001
    with pytest.raises(ModelError, match=f"{array} of the model holds -0.001"):
        vehicle.follow_model()


def test_an_indefinite_matrix_ends_the_run() -> None:
    vehicle = standing()
    vehicle.model.body_mass[vehicle.model.body("chassis").id] = -5000.0
    with pytest.raises(SimulationDiverged, match="Inertia matrix"):
        vehicle.step(DriverCommand(), ActuatorCommand())
    assert vehicle.data.warning[INERTIA].number > 0


def test_an_indefinite_matrix_that_the_engine_does_not_see_is_counted_too() -> None:
    """The armature is negative, and its stiff servo hides this from the diagonal that the engine factorises."""
    vehicle = standing()
    dof = int(vehicle.model.jnt_dofadr[vehicle.model.joint("rl_steer").id])
    vehicle.model.dof_armature[dof] = -10.0
    with pytest.raises(SimulationDiverged):
        vehicle.step(DriverCommand(), ActuatorCommand())
    assert vehicle.data.warning[INERTIA].number > 0


@pytest.fixture
def _no_control_callback() -> Iterator[None]:
    yield
    mujoco.set_mjcb_control(None)


@pytest.mark.usefixtures("_no_control_callback")
def test_a_control_callback_of_the_user_is_called() -> None:
    vehicle, calls = standing(), []
    mujoco.set_mjcb_control(lambda model, data: calls.append(data.time))
    vehicle.follow_model()
    vehicle.step(DriverCommand(), ActuatorCommand())
    assert handed_over(vehicle.model) == ["mjcb_control"]
    assert calls

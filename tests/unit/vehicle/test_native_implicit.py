"""The step with directly found accelerations is the engine's step, except for the error that its iteration leaves."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import mujoco
import numpy as np
import pytest

from activesteer.core.signals import ActuatorCommand, DriverCommand
from activesteer.scenario import load_car
from activesteer.vehicle import Vehicle
from activesteer.vehicle.implicit_plan import ImplicitPlan, handed_over
from activesteer.vehicle.native_forces import install_native_forces, remove_native_forces
from tests.unit.vehicle.cars import dof, tilted_and_moving
from tests.unit.vehicle.random_models import STATE, differences

CARS = ("compact", "sedan", "tesla_model_s")
TIGHT = 1e-14
"""Tolerance at which the engine's own solution is as good as it gets."""


def _pair(
    name: str, *, prepare: Callable[[Vehicle], None] | None = None, speed_mps: float = 25.0
) -> tuple[Vehicle, Vehicle]:
    pair = load_car(name).on(), load_car(name).on()
    for vehicle in pair:
        vehicle.model.opt.tolerance = TIGHT
        vehicle.start(speed_mps)
        vehicle.step(DriverCommand(), ActuatorCommand())  # engages the gear
        if prepare is not None:
            prepare(vehicle)
    return pair


def _drive(ours: Vehicle, engine: Vehicle, steps: int, steer_rad: float = 1.0) -> None:
    """Weave with one car by our step, and with the other by the engine's step with the same inputs."""
    for step in range(steps):
        angle_rad = steer_rad * np.sin(2.0 * np.pi * 0.01 * step)
        ours.step(DriverCommand(angle_rad, 200.0, 0.2), ActuatorCommand(0.02 * angle_rad, 0.01))
        engine.data.ctrl[:] = ours.data.ctrl
        mujoco.mj_step(engine.model, engine.data)


@pytest.mark.parametrize("name", CARS)
def test_a_weaving_car_goes_where_the_engine_takes_it(name: str) -> None:
    """With third-order stops, rubber that hardens, dry friction, and servos: all features of the cars."""
    ours, engine = _pair(name)
    assert not handed_over(ours.model)
    _drive(ours, engine, 150)
    assert abs(ours.data.qvel[5]) > 0.02, "it turns"
    found = differences(ours.data, engine.data)
    assert max(found.values()) < 1e-8, found


def test_the_engine_s_iteration_converges_to_what_we_find() -> None:
    """Only the tolerance of the engine's solver causes the difference."""
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8):
        ours, engine = _pair("sedan")
        engine.model.opt.tolerance = tolerance
        _drive(ours, engine, 60)
        errors.append(differences(ours.data, engine.data)["qvel"])
    assert errors[0] > 5.0 * errors[1] > 25.0 * errors[2]


@pytest.mark.parametrize("name", CARS)
def test_any_pose_gives_the_engine_s_accelerations(name: str) -> None:
    def thrown(vehicle: Vehicle) -> None:
        tilted_and_moving(vehicle, np.random.default_rng(5))

    ours, engine = _pair(name, prepare=thrown)
    _drive(ours, engine, 1)
    found = differences(ours.data, engine.data)
    assert np.abs(ours.data.qacc).max() > 100.0
    assert max(found.values()) < 1e-9, found


@pytest.mark.parametrize("held_Nm", [2.0, 0.05])
def test_hands_that_give_way_are_no_spring(held_Nm: float) -> None:
    ours, engine = _pair("compact", prepare=lambda vehicle: vehicle.limit_hands(held_Nm))
    _drive(ours, engine, 40)
    hands = ours.model.actuator("steering_wheel").id
    assert abs(ours.data.actuator_force[hands]) == pytest.approx(ours.model.actuator_forcerange[hands, 1])
    assert max(differences(ours.data, engine.data).values()) < 1e-8


def test_at_a_stop_of_the_rack_the_engine_steps() -> None:
    """At the stop the steps are bit-identical; after it, the direct solution continues."""
    ours, engine = _pair("compact", speed_mps=2.0)
    joint = ours.model.joint("rack").id
    place = ours.model.jnt_qposadr[joint]
    for vehicle in (ours, engine):
        vehicle.data.qpos[place] = vehicle.model.jnt_range[joint, 1] + 1e-4
        vehicle.data.qvel[dof(vehicle, "rack")] = 0.05
    _drive(ours, engine, 1)
    for name in STATE:
        assert getattr(ours.data, name).tobytes() == getattr(engine.data, name).tobytes(), name
    assert engine.data.nefc == 1
    _drive(ours, engine, 100, steer_rad=0.0)
    assert engine.data.nefc == 0
    assert ours.data.qpos[place] < ours.model.jnt_range[joint, 1]
    assert max(differences(ours.data, engine.data).values()) < 1e-8


def test_a_push_acts_as_in_the_engine() -> None:
    def pushed(vehicle: Vehicle) -> None:
        vehicle.data.xfrc_applied[vehicle.model.body("chassis").id, 1] = 3000.0

    ours, engine = _pair("compact", prepare=pushed)
    _drive(ours, engine, 20, steer_rad=0.0)
    assert ours.data.qvel[1] == pytest.approx(20e-3 * 3000.0 / sum(ours.model.body_mass), rel=0.2)
    assert ours.data.qpos.tobytes() == engine.data.qpos.tobytes()


def _rounding_radps2(vehicle: Vehicle) -> float:
    """Return the largest change of an acceleration if each link's length of two runs is rounded in the worst way.

    A length is the distance of two sites. Both ends and their distance are rounded to half the spacing of the numbers
    at the largest coordinate, so the lengths of two runs differ by at most four half spacings each. Times the stiffness
    this is a force, and (M + h D + h^2 K)^-1 gives the acceleration.
    """
    model, data = vehicle.model, vehicle.data
    mass, lengths = np.zeros((model.nv, model.nv)), np.zeros((model.ntendon, model.nv))
    mujoco.mj_fullM(model, data, mass)
    mujoco.mju_sparse2dense(lengths, data.ten_J, model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind)
    step_s, stiffness = model.opt.timestep, model.tendon_stiffness
    link = step_s * model.tendon_damping + step_s**2 * stiffness
    implicit = mass + np.diag(step_s * model.dof_damping) + lengths.T @ (link[:, np.newaxis] * lengths)
    forces_N = 4.0 * stiffness * np.spacing(np.abs(data.site_xpos).max())
    return float((np.abs(np.linalg.solve(implicit, lengths.T)) @ forces_N).max())


@pytest.mark.parametrize("name", CARS)
def test_at_standstill_the_solutions_differ_by_the_rounding_of_stiff_links(name: str) -> None:
    """From the same state the first step differs by less than 1e-12; see `implicit_plan` for the following ones."""
    ours, engine = _pair(name, speed_mps=0.0)
    bound = _rounding_radps2(engine)
    assert bound < 1e-7
    for step in range(150):
        _drive(ours, engine, 1, steer_rad=0.0)
        assert differences(ours.data, engine.data)["qacc"] < (1e-12 if step == 0 else bound)


def test_what_changes_in_the_model_counts_at_once() -> None:
    def stiffer(vehicle: Vehicle) -> None:
        vehicle.model.tendon_stiffness[:] *= 1.5
        vehicle.model.dof_damping[:] += 0.5

    ours, engine = _pair("compact", prepare=stiffer)
    _drive(ours, engine, 50)
    assert max(differences(ours.data, engine.data).values()) < 1e-8


def test_the_factor_of_a_car_is_hardly_larger_than_its_mass_matrix() -> None:
    """This makes the direct solution fast; without a suitable order, all degrees of freedom would be coupled."""
    for name in CARS:
        vehicle = load_car(name).on()
        entries = ImplicitPlan(vehicle.model, vehicle.data).plan["n_factor"][0]
        assert entries < 1.2 * vehicle.model.nC


@pytest.fixture
def _clock_as_before() -> Iterator[None]:
    yield
    mujoco.set_mjcb_time(None)
    install_native_forces()


@pytest.mark.usefixtures("_clock_as_before")
def test_a_clock_of_somebody_else_goes_on() -> None:
    remove_native_forces()
    assert mujoco.get_mjcb_time() is None
    ticks = []
    mujoco.set_mjcb_time(lambda: float(ticks.append(0) or len(ticks)))
    _drive(*_pair("compact"), 1)
    assert ticks

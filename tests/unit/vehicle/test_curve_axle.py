"""Axles of curves: their forces derive from an energy, both sides are equal, and their stiffness is the given one."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import mujoco
import numpy as np
import pytest

from activesteer import simulate
from activesteer.core.conventions import Array
from activesteer.errors import ModelError, ParameterError
from activesteer.rigs.kc import kinematics_compliance
from activesteer.rigs.kc.result import write_tables
from activesteer.scenario import CarSpec, load_car
from activesteer.studies.linear.linearisation import linear_car
from activesteer.vehicle import Vehicle
from activesteer.vehicle_builder import new_vehicle
from activesteer.vehicle_builder.texts import car_table
from tests.bench import on_the_bench
from tests.raising import raises
from tests.unit.vehicle_builder.other_curves import other_axle, other_curves

JOINTS = ("x", "y", "z", "toe", "camber", "caster")


@pytest.fixture(scope="module")
def guided(tmp_path_factory: pytest.TempPathFactory) -> CarSpec:
    """Return the compact with curves instead of links."""
    folder = tmp_path_factory.mktemp("kc")
    result = on_the_bench()
    write_tables(result, folder)
    (folder / "car.toml").write_text(car_table(load_car("compact"), result), encoding="utf-8")
    return load_car(new_vehicle("guided", folder=folder / "car", kc=folder).vehicle_file)


def strange(guided: CarSpec) -> Vehicle:
    """Return the same car with curves that bend in every coordinate, far from any real car."""
    return dataclasses.replace(guided, config=dataclasses.replace(guided.config, curves=other_curves())).on()


def suspension_forces(vehicle: Vehicle, qpos: Array) -> Array:
    """Return the passive forces at rest without those of the road."""
    model, data = vehicle.model, mujoco.MjData(vehicle.model)
    data.qpos[:] = qpos
    data.qpos[2] += 1.0
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    return data.qfrc_passive.copy()


def test_forces_are_the_slopes_of_an_energy(guided: CarSpec, rng: np.random.Generator) -> None:
    """Virtual work: the stiffness is symmetric wherever the wheels are, to 1e-6 of its largest entry.

    What a curve's slope hands from a side force to the springs it takes from the side: no way round gains work.
    """
    vehicle = strange(guided)
    model = vehicle.model
    names = [f"{corner}_{name}" for corner in ("fl", "fr", "rl", "rr") for name in JOINTS] + ["rack"]
    dofs = [int(model.joint(name).dofadr[0]) for name in names]
    qpos = model.qpos0.copy()
    move = np.zeros(model.nv)
    move[dofs] = 0.01 * rng.normal(size=len(dofs))
    mujoco.mj_integratePos(model, qpos, move, 1.0)
    stiffness = np.empty((len(dofs), len(dofs)))
    for column, dof in enumerate(dofs):
        sides = []
        for sign in (1.0, -1.0):
            there, step = qpos.copy(), np.zeros(model.nv)
            step[dof] = sign * 1e-6
            mujoco.mj_integratePos(model, there, step, 1.0)
            sides.append(suspension_forces(vehicle, there)[dofs])
        stiffness[:, column] = (sides[0] - sides[1]) / 2e-6
    assert np.abs(stiffness).max() > 1e6
    assert np.abs(stiffness - stiffness.T).max() < 1e-6 * np.abs(stiffness).max()


def test_left_and_right_are_mirror_images(guided: CarSpec, rng: np.random.Generator) -> None:
    vehicle = strange(guided)
    model = vehicle.model
    signs = np.array([1.0, -1.0, 1.0, -1.0, -1.0, 1.0])
    moves = 0.01 * rng.normal(size=6)
    forces = []
    for corner, mirror in (("fl", np.ones(6)), ("fr", signs)):
        qpos = model.qpos0.copy()
        dofs = [int(model.joint(f"{corner}_{name}").dofadr[0]) for name in JOINTS]
        for name, move in zip(JOINTS, mirror * moves, strict=True):
            qpos[int(model.joint(f"{corner}_{name}").qposadr[0])] = move
        qpos[int(model.joint("rack").qposadr[0])] = 0.01 * mirror[1]
        forces.append(mirror * suspension_forces(vehicle, qpos)[dofs])
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-9, atol=1e-6)


def test_the_rig_finds_the_measured_curves(guided: CarSpec) -> None:
    """Over the whole travel within 0.01 deg and 0.1 mm; over forces as well as five numbers can describe it.

    Curves of parallel travel know nothing of the load of roll on the top mounts: the roll centre is 2 mm lower.
    """
    before, after = on_the_bench(), kinematics_compliance(Path(guided.mjcf).with_suffix(".toml"))
    sweeps = [result.curves["parallel_travel"] for result in (before, after)]
    for angle in ("toe_rad", "camber_rad"):
        assert np.degrees(np.abs(getattr(sweeps[0], angle) - getattr(sweeps[1], angle)).max()) < 0.01, angle
    ways = [sweep.centre_m - sweep.centre_m[sweep.zero] for sweep in sweeps]
    assert np.abs(ways[0] - ways[1]).max() < 1e-4
    for axle, name, share in (
        ("front", "wheel_rate", 0.01), ("rear", "wheel_rate", 0.01), ("front", "roll_stiffness", 0.01),
        ("front", "steering_ratio", 1e-3), ("front", "ackermann", 0.01),
        ("rear", "side_force_toe", 0.03), ("rear", "side_force_camber", 0.03), ("front", "aligning_steer", 0.03),
        ("rear", "longitudinal_compliance_centre", 0.03), ("front", "roll_centre_height_by_force", 0.03),
        ("rear", "kingpin_inclination", 0.02), ("car", "body_roll_frequency", 0.01),
    ):  # fmt: skip
        assert after[axle, name] == pytest.approx(before[axle, name], rel=share), (axle, name)
    # Toe-out of the links less toe-in of the arms: 3 % of the 0.1 deg/kN that each of them has.
    assert after["front", "side_force_toe"] == pytest.approx(before["front", "side_force_toe"], abs=0.003)


def test_a_guided_car_drives_as_the_one_it_was_measured_on(guided: CarSpec) -> None:
    """A step of 30 deg: steady state within 1 %, peaks within 3 %."""
    file = Path(guided.mjcf).with_suffix(".toml")
    runs = [simulate("step_steer", "none", car, {"steer.steering_wheel_deg": 30.0}) for car in ("compact", file)]
    for channel in ("yaw_rate_radps", "ay_mps2", "roll_rad"):
        steady = [float(run[channel][-500:].mean()) for run in runs]
        assert steady[1] == pytest.approx(steady[0], rel=0.01), channel
        assert np.abs(runs[1][channel]).max() == pytest.approx(np.abs(runs[0][channel]).max(), rel=0.03), channel


def test_half_a_step_changes_nothing(guided: CarSpec) -> None:
    """The stiff part is implicit in the engine, the curvature is not; together they do not depend on the step."""
    file = Path(guided.mjcf).with_suffix(".toml")
    changes = {"steer.steering_wheel_deg": 90.0, "duration_s": 2.0}
    rolls = [simulate("step_steer", "none", file, changes, timestep_s=step)["roll_rad"] for step in (1e-3, 5e-4)]
    assert np.abs(rolls[1]).max() == pytest.approx(np.abs(rolls[0]).max(), rel=2e-3)


def test_the_state_is_complete(guided: CarSpec) -> None:
    vehicle = guided.on()
    vehicle.start(20.0)
    for _ in range(50):
        mujoco.mj_step(vehicle.model, vehicle.data)
    state = vehicle.save_state()
    ends = []
    for _ in range(2):
        vehicle.restore_state(state)
        for _ in range(50):
            mujoco.mj_step(vehicle.model, vehicle.data)
        ends.append(vehicle.data.qpos.copy())
    np.testing.assert_array_equal(ends[0], ends[1])


def test_modes_of_guided_wheels_have_the_names_of_wheels() -> None:
    """As in a car of links, no joint of a corner acts independently."""
    modes = linear_car("tesla_model_s", 20.0).modes()
    parts = {part for mode in modes for part in mode.participation}
    assert {"front wheel camber", "rear wheel camber", "front wheel steer", "rear wheel fore-aft"} <= parts
    assert not [part for part in parts if part.startswith(("fl_", "fr_", "rl_", "rr_"))]


def test_links_where_curves_are_asked_for_are_an_error() -> None:
    car = load_car("compact")
    with raises(ModelError, value="fl_x"):
        dataclasses.replace(car, config=dataclasses.replace(car.config, curves=other_curves())).on()


def test_a_stiffness_that_holds_nothing_is_an_error() -> None:
    axle = other_axle(steered=False)
    with raises(ParameterError, key="stiffness"):
        dataclasses.replace(axle, stiffness=(-1.0, *axle.stiffness[1:]))

"""The native callbacks: they apply the forces that they record, and do not change other models."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.errors import ModelError
from activesteer.vehicle import Vehicle
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.native_forces import install_native_forces, remove_native_forces
from tests.raising import raises
from tests.unit.vehicle.cars import record, standing, tilted_and_moving

NO_DAMPERS = {
    "dampers.front.velocity_mps": [-1.0, 1.0],
    "dampers.front.force_N": [0.0, 0.0],
    "dampers.rear.velocity_mps": [-1.0, 1.0],
    "dampers.rear.force_N": [0.0, 0.0],
}
NO_DRAG = {"aerodynamics.drag_area_m2": 0.0}


@pytest.fixture(autouse=True)
def callbacks_as_before() -> Iterator[None]:
    yield
    mujoco.set_mjcb_passive(None)
    mujoco.set_mjcb_act_dyn(None)
    install_native_forces()


def applied(vehicle: Vehicle) -> np.ndarray:
    """Return the generalised forces of the callback alone, shape (nv,)."""
    model, data = vehicle.model, vehicle.data
    install_native_forces()
    mujoco.mj_forward(model, data)
    with_ours, scratch = data.qfrc_passive.copy(), data.userdata.copy()
    remove_native_forces()
    mujoco.mj_forward(model, data)
    without = data.qfrc_passive.copy()
    install_native_forces()
    data.userdata[:] = scratch
    return with_ours - without


FORCES_AND_MOMENTS = ("fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm")


def wheel_wrench(vehicle: Vehicle, corner: str) -> np.ndarray:
    """Return the engine's generalised forces of one tyre, from its recorded forces at the contact, shape (nv,)."""
    model, data = vehicle.model, vehicle.data
    body = model.body(f"{corner}_wheel").id
    axis = data.xmat[body].reshape(3, 3)[:, 1]
    up = np.array([0.0, 0.0, 1.0])
    forward = np.cross(axis, up)
    forward /= np.linalg.norm(forward)
    left = np.cross(up, forward)
    down = -(up - (up @ axis) * axis)
    down /= np.linalg.norm(down)
    # Along `down` from the centre to the road.
    contact = data.xpos[body] + down * (data.xpos[body, 2] / -down[2])
    fx, fy, fz, mx, my, mz = (record(vehicle, corner, field) for field in FORCES_AND_MOMENTS)
    result = np.zeros(model.nv)
    force = fx * forward + fy * left + fz * up
    torque = mx * forward + my * left + mz * up
    mujoco.mj_applyFT(model, data, force, torque, contact, body, result)
    return result


def lift(vehicle: Vehicle, corner: str) -> None:
    """Lift one wheel off the road by its suspension travel."""
    joint = f"{corner}_jounce" if corner.startswith("f") else f"{corner}_z"
    vehicle.data.qpos[vehicle.model.joint(joint).qposadr[0]] += 0.4


@pytest.mark.parametrize("corner", CORNERS)
def test_generalised_force_of_a_tyre_is_the_engine_s_for_the_recorded_wrench(
    corner: str, rng: np.random.Generator
) -> None:
    vehicle = standing(NO_DAMPERS | NO_DRAG)
    tilted_and_moving(vehicle, rng)
    for other in CORNERS:
        if other != corner:
            lift(vehicle, other)
    got = applied(vehicle)
    assert [record(vehicle, each, "fz_N") > 100.0 for each in CORNERS] == [each == corner for each in CORNERS]
    expected = wheel_wrench(vehicle, corner)
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_generalised_forces_of_all_tyres_add_up(rng: np.random.Generator) -> None:
    vehicle = standing(NO_DAMPERS | NO_DRAG)
    tilted_and_moving(vehicle, rng)
    got = applied(vehicle)
    expected = sum(wheel_wrench(vehicle, corner) for corner in CORNERS)
    assert all(record(vehicle, corner, "fz_N") > 100.0 for corner in CORNERS)
    assert all(abs(record(vehicle, corner, "fy_N")) > 10.0 for corner in CORNERS)
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_dampers_act_along_their_tendons(rng: np.random.Generator) -> None:
    vehicle = standing(NO_DRAG)
    tilted_and_moving(vehicle, rng)
    for corner in CORNERS:
        lift(vehicle, corner)
    got = applied(vehicle)
    model, data = vehicle.model, vehicle.data
    expected = np.zeros(model.nv)
    for index, corner in enumerate(CORNERS):
        tendon = model.tendon(f"{corner}_damper").id
        row, count = model.ten_J_rowadr[tendon], model.ten_J_rownnz[tendon]
        columns = model.ten_J_colind[row : row + count]
        force = data.userdata[len(CORNERS) * fb.USERDATA_PER_WHEEL + index]
        expected[columns] += data.ten_J.ravel()[row : row + count] * force
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())
    # Whatever way they move, dampers take energy.
    assert got @ data.qvel < 0.0


def test_drag_acts_against_the_motion_at_its_point(rng: np.random.Generator) -> None:
    vehicle = standing(NO_DAMPERS)
    tilted_and_moving(vehicle, rng)
    for corner in CORNERS:
        lift(vehicle, corner)
    got = applied(vehicle)
    model, data = vehicle.model, vehicle.data
    chassis = model.body("chassis").id
    aero = vehicle.parameters.aerodynamics
    point = data.xpos[chassis] + data.xmat[chassis].reshape(3, 3) @ np.array(aero.pressure_point_m)
    along = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, along, None, point, chassis)
    velocity = along @ data.qvel
    velocity[2] = 0.0
    force = -0.5 * aero.air_density_kgpm3 * aero.drag_area_m2 * np.linalg.norm(velocity) * velocity
    expected = along.T @ force
    np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_a_lifted_wheel_feels_nothing() -> None:
    vehicle = standing()
    lift(vehicle, "fl")
    mujoco.mj_forward(vehicle.model, vehicle.data)
    assert [record(vehicle, "fl", field) for field in FORCES_AND_MOMENTS] == [0.0] * 6


def foreign(numbers: str = "1 2 3") -> mujoco.MjModel:
    """Another project's model with features of ours: custom numbers, user data, an actuator with user dynamics."""
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <size nuserdata="64"/>
      <custom><numeric name="theirs" data="{numbers}"/></custom>
      <worldbody>
        <site name="a" pos="0.3 0 0"/>
        <body pos="0 0 1">
          <joint name="j" axis="0 1 0" stiffness="3" damping="0.1"/><geom size="0.1" pos="0.2 0 -0.1"/>
          <site name="b"/>
          <body pos="0 0 -0.5"><joint axis="1 0 0"/><geom size="0.05" pos="0 0.1 -0.2"/></body>
        </body>
      </worldbody>
      <tendon><spatial stiffness="20"><site site="a"/><site site="b"/></spatial></tendon>
      <actuator><general joint="j" dyntype="user" gainprm="5"/></actuator>
    </mujoco>""")


def trajectory(model: mujoco.MjModel) -> np.ndarray:
    data = mujoco.MjData(model)
    data.qpos[:] = 0.4
    data.act[:] = 0.3
    data.userdata[:] = 7.0
    rows = []
    for index in range(300):
        data.ctrl[:] = np.sin(0.01 * index)
        mujoco.mj_step(model, data)
        rows.append(np.concatenate([data.qpos, data.qvel, data.act, data.qfrc_passive, data.userdata]))
    return np.array(rows)


@pytest.mark.parametrize("numbers", ["1 2 3", "0", f"5 {fb.MARKER + 1}", "20121120 3 0 0"])
def test_other_models_are_left_alone(numbers: str) -> None:
    model = foreign(numbers)
    remove_native_forces()
    without = trajectory(model)
    install_native_forces()
    assert mujoco.get_mjcb_passive() is not None
    np.testing.assert_array_equal(trajectory(model), without)


def test_user_dynamics_of_other_models_stand_still() -> None:
    install_native_forces()
    model = foreign()
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    mujoco.mj_forward(model, data)
    assert data.act_dot.tolist() == [0.0]


def test_a_model_without_custom_numbers_is_left_alone() -> None:
    install_native_forces()
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint/><geom size='0.1' pos='0.1 0 0'/></body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert not data.qfrc_passive.any()


@pytest.mark.parametrize("name", ["mjcb_passive", "mjcb_act_dyn"])
def test_a_foreign_callback_is_not_displaced(name: str) -> None:
    remove_native_forces()

    def theirs(*_arguments: object) -> float:
        return 0.0

    getattr(mujoco, f"set_{name}")(theirs)
    with raises(ModelError, value=name):
        standing()
    assert getattr(mujoco, f"get_{name}")() is theirs


def test_removing_leaves_a_foreign_callback() -> None:
    remove_native_forces()

    def theirs(_model: mujoco.MjModel, _data: mujoco.MjData) -> None:
        return

    mujoco.set_mjcb_passive(theirs)
    remove_native_forces()
    assert mujoco.get_mjcb_passive() is theirs


def test_without_the_callback_nothing_carries_the_car() -> None:
    """The opposite of all tests above: the callback causes the forces."""
    vehicle = standing()
    remove_native_forces()
    model, data = vehicle.model, vehicle.data
    model.opt.tolerance = 1e-12  # so that the accelerations are those of the forces to the last digits
    mujoco.mj_forward(model, data)
    momentum_rate = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, momentum_rate, data.qacc)
    assert momentum_rate[2] == pytest.approx(-9.81 * model.body_mass.sum(), rel=1e-9)

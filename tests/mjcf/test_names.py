"""Names, orders and frames of the car that loader, callback and recorder rely on."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from tests.mjcf.car import ACTUATORS, BODIES, FRONT, JOINTS, LINKS, REAR, SENSORS, TENDONS, car, names

OBJ = mujoco.mjtObj


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return car()


def test_engine_options_are_those_the_stiff_links_need(model: mujoco.MjModel) -> None:
    assert model.opt.timestep == 0.001
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE
    assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE
    assert model.opt.solver == mujoco.mjtSolver.mjSOL_NEWTON


def test_names_and_their_order(model: mujoco.MjModel) -> None:
    assert names(model, OBJ.mjOBJ_BODY, model.nbody) == ["world", *BODIES]
    assert names(model, OBJ.mjOBJ_JOINT, model.njnt) == JOINTS
    assert names(model, OBJ.mjOBJ_TENDON, model.ntendon) == TENDONS
    assert names(model, OBJ.mjOBJ_ACTUATOR, model.nu) == ACTUATORS
    assert names(model, OBJ.mjOBJ_SENSOR, model.nsensor) == SENSORS


@pytest.mark.parametrize("link", LINKS)
def test_each_link_runs_from_chassis_or_rack_to_its_knuckle(model: mujoco.MjModel, link: str) -> None:
    corner = link[:2]
    inner, outer = model.site(f"{link}_inner"), model.site(f"{link}_outer")
    first = model.tendon(link).id
    start = model.tendon_adr[first]
    assert list(model.wrap_objid[start : start + 2]) == [inner.id, outer.id]
    assert model.body(int(inner.bodyid[0])).name == ("rack" if "tie_rod" in link else "chassis")
    assert model.body(int(outer.bodyid[0])).name == f"{corner}_knuckle"


def test_body_frames_lie_at_the_vehicle_origin(model: mujoco.MjModel) -> None:
    for name in BODIES:
        if not name.endswith("wheel"):
            np.testing.assert_array_equal(model.body(name).pos, 0.0, err_msg=name)
            np.testing.assert_array_equal(model.body(name).quat, [1.0, 0.0, 0.0, 0.0], err_msg=name)


def test_wheelbase_track_and_loaded_radius(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    centre = {c: data.site(f"{c}_wheel_centre").xpos for c in CORNERS}
    assert centre["fl"][0] == 0.0
    assert centre["rl"][0] == pytest.approx(-2.637)
    assert 2 * centre["fl"][1] == pytest.approx(1.53, abs=0.01)
    assert 2 * centre["rl"][1] == pytest.approx(1.52, abs=0.015)
    np.testing.assert_allclose(model.site("front_axle").pos, [0.0, 0.0, centre["fl"][2]])
    np.testing.assert_array_equal(model.site("origin").pos, 0.0)


def test_joint_axes(model: mujoco.MjModel) -> None:
    for corner in CORNERS:
        np.testing.assert_array_equal(model.joint(f"{corner}_spin").axis, [0.0, 1.0, 0.0])
    for corner in FRONT:
        assert model.joint(f"{corner}_jounce").axis[2] > 0.95
    for corner in REAR:
        steer = model.joint(f"{corner}_steer")
        assert steer.axis[2] > 0.95  # upwards on both sides: positive turns left on both sides
        np.testing.assert_allclose(steer.range, [-0.0523598776, 0.0523598776])
    np.testing.assert_array_equal(model.joint("rack").axis, [0.0, -1.0, 0.0])
    for name in ("steering_wheel", "superposition"):
        assert model.joint(name).axis[0] < -0.8  # towards the driver
        assert model.joint(name).axis[2] > 0.0


def test_states_of_the_callback_are_user_dynamics_without_force(model: mujoco.MjModel) -> None:
    states = {name for name in ACTUATORS if name.endswith(("_brake", "_friction")) or "_slip_" in name}
    user = {"superposition", "rl_steer", "rr_steer"} | states
    for name in ACTUATORS:
        actuator = model.actuator(name)
        assert (actuator.dyntype == mujoco.mjtDyn.mjDYN_USER) == (name in user), name
        if name in states:
            np.testing.assert_array_equal(actuator.gainprm, 0.0, err_msg=name)
            assert actuator.biastype == mujoco.mjtBias.mjBIAS_NONE
    for name in ("superposition", "rl_steer", "rr_steer"):
        lag_s, rate_radps = model.actuator(name).dynprm[:2]
        assert 0.01 <= lag_s <= 0.05
        assert 0.1 <= rate_radps <= 20.0
    np.testing.assert_allclose(model.actuator("rl_steer").ctrlrange, [-0.0523598776, 0.0523598776])


def test_dampers_have_no_damping_of_their_own(model: mujoco.MjModel) -> None:
    for corner in CORNERS:
        assert model.tendon_damping[model.tendon(f"{corner}_damper").id] == 0.0


@pytest.mark.parametrize("corner", CORNERS)
def test_stops_leave_the_damper_its_travel_and_push_back_beyond_it(model: mujoco.MjModel, corner: str) -> None:
    damper = model.tendon(f"{corner}_damper").id
    design_m = model.tendon_length0[damper]
    bump_m, rebound_m = model.tendon_lengthspring[damper] - design_m
    assert -0.045 < bump_m < -0.025
    assert 0.055 < rebound_m < 0.075
    beyond_m = np.linspace(0.001, 0.06, 60)
    a, b, c = model.tendon_stiffness[damper], *model.tendon_stiffnesspoly[damper]
    on_bump_N = -(a * -beyond_m + b * beyond_m**2 + c * -(beyond_m**3))
    on_rebound_N = a * beyond_m + b * beyond_m**2 + c * beyond_m**3
    assert (np.diff(on_bump_N, prepend=0.0) > 0.0).all()
    assert (on_rebound_N > on_bump_N).all()
    assert on_bump_N[-1] > 5e3


def test_column_couples_rack_to_the_sum_of_both_angles(model: mujoco.MjModel) -> None:
    column = model.tendon("steering_column").id
    start = model.tendon_adr[column]
    joints = [model.joint(int(i)).name for i in model.wrap_objid[start : start + 3]]
    assert joints == ["rack", "steering_wheel", "superposition"]
    rack, wheel, superposition = model.wrap_prm[start : start + 3]
    assert rack == 1.0
    assert wheel == superposition
    assert -0.009 < wheel < -0.007  # pinion radius, 44 to 57 mm of rack a turn

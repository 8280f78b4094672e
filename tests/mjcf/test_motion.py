"""Motion of the mechanism without tyre callback: static ride, steering signs, torque reaction, robustness."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from tests.mjcf.car import ACTUATORS, REAR, car, held_car, put_on_tyre_springs, warnings, weight_N, wheel_angles_deg


def test_design_position_is_the_static_ride() -> None:
    model = car()
    data = mujoco.MjData(model)
    dampers = [model.tendon(f"{c}_damper").id for c in CORNERS]
    model.tendon_damping[dampers] = 6000.0  # heavy, so that it comes to rest soon; rest does not depend on it
    mujoco.mj_forward(model, data)
    for _ in range(4000):
        put_on_tyre_springs(model, data)
        mujoco.mj_step(model, data)
    loads_N = put_on_tyre_springs(model, data)
    assert np.abs(data.qvel).max() < 1e-3
    assert abs(data.qpos[2]) < 1e-3
    nose_down_rad = 2 * data.qpos[5]
    assert abs(nose_down_rad) * 2.637 < 1e-3
    assert loads_N.sum() == pytest.approx(weight_N(model), rel=1e-3)
    assert loads_N[:2].sum() / loads_N.sum() == pytest.approx(0.59, abs=0.002)
    np.testing.assert_allclose(loads_N[::2], loads_N[1::2], rtol=1e-6)
    for corner in CORNERS:
        steer_deg, camber_deg = wheel_angles_deg(model, data, corner)
        toe_in_deg = -steer_deg if corner[1] == "l" else steer_deg
        assert toe_in_deg == pytest.approx(0.05 if corner[0] == "f" else 0.12, abs=0.01)
        assert camber_deg == pytest.approx(-0.5 if corner[0] == "f" else -1.3, abs=0.02)


def settle(model: mujoco.MjModel, data: mujoco.MjData, steps: int = 600) -> None:
    """Let the held car come to rest with its wheels free of load and weight."""
    model.opt.gravity[:] = 0.0
    model.tendon_stiffness[[model.tendon(f"{c}_spring").id for c in CORNERS]] = 0.0  # else they push the wheels out
    for _ in range(steps):
        mujoco.mj_step(model, data)


@pytest.mark.parametrize("through", ["steering_wheel", "superposition"])
def test_left_is_positive_and_the_ratio_is_that_of_a_car(through: str) -> None:
    model = held_car()
    data = mujoco.MjData(model)
    settle(model, data, 1)
    straight = [wheel_angles_deg(model, data, c)[0] for c in ("fl", "fr")]
    angle_rad = 0.5
    if through == "steering_wheel":
        data.ctrl[model.actuator(through).id] = angle_rad
    else:
        data.act[model.actuator(through).actadr[0]] = angle_rad
    settle(model, data)
    turned = [wheel_angles_deg(model, data, c)[0] for c in ("fl", "fr")]
    steer_deg = np.subtract(turned, straight)
    assert (steer_deg > 0.0).all()
    assert 15.0 < np.degrees(angle_rad) / steer_deg.mean() < 16.5


def test_inner_wheel_turns_further_and_the_rack_stops_at_full_lock() -> None:
    model = held_car()
    data = mujoco.MjData(model)
    settle(model, data, 1)
    wheel = model.actuator("steering_wheel").id
    for time_s in np.arange(0.0, 1.5, model.opt.timestep):
        data.ctrl[wheel] = min(20.0 * time_s, model.actuator_ctrlrange[wheel, 1])  # 1150 deg/s: no driver is faster
        mujoco.mj_step(model, data)
    inner, outer = (wheel_angles_deg(model, data, c)[0] for c in ("fl", "fr"))
    assert 35.0 < inner < 39.0
    assert 3.0 < inner - outer < 9.0
    assert data.joint("rack").qpos[0] < model.joint("rack").range[1] + 1e-4
    assert warnings(data) == 0


@pytest.mark.parametrize("corner", REAR)
def test_rear_wheel_steers_to_its_stop_and_not_beyond(corner: str) -> None:
    model = held_car()
    data = mujoco.MjData(model)
    settle(model, data, 1)
    straight = wheel_angles_deg(model, data, corner)[0]
    limit_rad = model.joint(f"{corner}_steer").range[1]
    data.act[model.actuator(f"{corner}_steer").actadr[0]] = limit_rad
    dof = model.joint(f"{corner}_steer").dofadr[0]
    data.qfrc_applied[dof] = 500.0  # a tyre that pushes against the stop
    settle(model, data)
    assert data.qpos[model.joint(f"{corner}_steer").qposadr[0]] == pytest.approx(limit_rad, abs=np.radians(0.02))
    assert wheel_angles_deg(model, data, corner)[0] - straight == pytest.approx(3.0, abs=0.05)


@pytest.mark.parametrize("corner", CORNERS)
def test_drive_torque_reacts_on_the_chassis(corner: str) -> None:
    model = car()
    data = mujoco.MjData(model)
    model.opt.gravity[:] = 0.0
    model.tendon_stiffness[[model.tendon(f"{c}_spring").id for c in CORNERS]] = 0.0
    data.ctrl[model.actuator(f"{corner}_drive").id] = 100.0
    for _ in range(20):
        mujoco.mj_step(model, data)
    assert data.joint(f"{corner}_spin").qvel[0] == pytest.approx(100.0 / 1.0 * 0.02, rel=0.02)  # 100 Nm, 1 kgm2, 20 ms
    assert data.joint("root").qvel[4] < 0.0  # the nose rises
    mujoco.mj_subtreeVel(model, data)
    gained_Nms = data.subtree_angmom[0][1]
    assert abs(gained_Nms) < 0.02 * 100.0 * 0.02  # action and reaction: the whole car gains nothing


def test_held_car_steps_under_control_noise_without_a_warning(rng: np.random.Generator) -> None:
    model = held_car()
    data = mujoco.MjData(model)
    scale = np.zeros(model.nu)
    for name, size in (("steering_wheel", 1.0), ("superposition", 0.5), ("rl_steer", 0.05), ("rr_steer", 0.05)):
        scale[ACTUATORS.index(name)] = size
    for corner in CORNERS:
        scale[ACTUATORS.index(f"{corner}_drive")] = 200.0
    mujoco.mj_forward(model, data)
    noise = np.zeros(model.nu)
    for _ in range(1000):
        noise += 0.05 * (rng.normal(size=model.nu) - noise)
        data.ctrl[:] = scale * noise
        data.act[:3] = data.ctrl[1:4]  # the callback that would move them is not there
        put_on_tyre_springs(model, data)
        mujoco.mj_step(model, data)
        assert np.isfinite(data.qacc).all()
    assert warnings(data) == 0
    assert np.abs(data.qpos).max() < 200.0
    wheels = [data.xpos[model.body(f"{c}_wheel").id] for c in CORNERS]
    assert np.abs(np.array(wheels)[:, 2] - 0.3).max() < 0.12


def test_forward_called_twice_changes_nothing(rng: np.random.Generator) -> None:
    model = held_car()
    data = mujoco.MjData(model)
    data.qvel[:] = 0.02 * rng.normal(size=model.nv)
    for _ in range(20):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    first = data.qacc.copy()
    mujoco.mj_forward(model, data)
    np.testing.assert_array_equal(data.qacc, first)

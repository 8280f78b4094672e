"""Requirements for every car's MJCF: mirrored sides, a standing scene, no warnings."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from tests.mjcf.car import warnings

MJCF = Path(__file__).resolve().parents[2] / "models" / "mjcf"
CARS = sorted(path.name for path in MJCF.iterdir() if (path / f"{path.name}.xml").is_file())

Y = np.array([1.0, -1.0, 1.0])
SIDES = {"fl_": "fr_", "rl_": "rr_"}


def on_the_right(name: str) -> str | None:
    """Return the name of the mirror image of a left-hand object; None for other objects."""
    return SIDES[name[:3]] + name[3:] if name[:3] in SIDES else None


def inertia(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Return the inertia about the body's centre of mass in the body's axes [kg m2], shape (3, 3)."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    axes = turn.reshape(3, 3)
    return axes @ np.diag(model.body_inertia[body]) @ axes.T


@pytest.fixture(scope="module", params=CARS)
def car(request: pytest.FixtureRequest) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(MJCF / request.param / f"{request.param}.xml"))


def test_both_cars_are_there() -> None:
    assert {"compact", "sedan"} <= set(CARS)


def test_bodies_on_the_right_are_those_on_the_left_mirrored(car: mujoco.MjModel) -> None:
    mirror = np.diag(Y)
    pairs = 0
    for left in range(car.nbody):
        if (name := on_the_right(car.body(left).name)) is None:
            continue
        right = car.body(name).id
        np.testing.assert_array_equal(car.body_pos[right], Y * car.body_pos[left], err_msg=name)
        np.testing.assert_allclose(car.body_ipos[right], Y * car.body_ipos[left], atol=1e-15, err_msg=name)
        assert car.body_mass[right] == car.body_mass[left]
        mirrored = mirror @ inertia(car, left) @ mirror
        np.testing.assert_allclose(
            inertia(car, right), mirrored, atol=1e-12 + 1e-9 * np.abs(mirrored).max(), err_msg=name
        )
        pairs += 1
    # Knuckle and wheel, and at the rear what steers; struts are bodies of their own.
    assert pairs >= 5


def test_joints_on_the_right_turn_about_mirrored_lines(car: mujoco.MjModel) -> None:
    for left in range(car.njnt):
        if (name := on_the_right(car.joint(left).name)) is None:
            continue
        right = car.joint(name).id
        assert car.jnt_type[right] == car.jnt_type[left]
        np.testing.assert_array_equal(car.jnt_pos[right], Y * car.jnt_pos[left], err_msg=name)
        # The sense along the line is the modeller's choice.
        one, other = car.jnt_axis[right], Y * car.jnt_axis[left]
        assert abs(float(one @ other)) == pytest.approx(1.0, abs=1e-12), name
        for field in ("dof_damping", "dof_armature"):
            first, second = (getattr(car, field)[car.jnt_dofadr[joint]] for joint in (left, right))
            assert first == second, name


def test_sites_and_tendons_on_the_right_are_mirrored(car: mujoco.MjModel) -> None:
    for left in range(car.nsite):
        if name := on_the_right(car.site(left).name):
            np.testing.assert_array_equal(car.site_pos[car.site(name).id], Y * car.site_pos[left], err_msg=name)
    for left in range(car.ntendon):
        if name := on_the_right(car.tendon(left).name):
            right = car.tendon(name).id
            for field in ("stiffness", "stiffnesspoly", "damping"):
                values = getattr(car, f"tendon_{field}")
                np.testing.assert_array_equal(values[right], values[left], err_msg=name)
            np.testing.assert_allclose(car.tendon_lengthspring[right], car.tendon_lengthspring[left], rtol=1e-12)


@pytest.mark.parametrize("name", CARS)
def test_the_scene_stands_on_its_road(name: str) -> None:
    scene = mujoco.MjModel.from_xml_path(str(MJCF / name / "scene.xml"))
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    for _ in range(1500):
        mujoco.mj_step(scene, data)
    assert warnings(data) == 0
    assert np.abs(data.qvel[:6]).max() < 0.05
    assert np.abs(2 * data.qpos[4:6]).max() < np.radians(1.0)
    for corner in CORNERS:
        radius_m = float(scene.geom(f"{corner}_tyre").size[0])
        assert 0.0 < radius_m - data.body(f"{corner}_wheel").xpos[2] < 0.03

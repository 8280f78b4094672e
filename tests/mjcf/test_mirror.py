"""The right side is the left side with y negated; any difference would pull the car to one side."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from tests.mjcf.car import BODIES, JOINTS, TENDONS, car

Y = np.array([1.0, -1.0, 1.0])
SIDES = {"fl": "fr", "rl": "rr"}


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return car()


def on_the_right(name: str) -> str | None:
    """Return the name of the mirror image of a left-hand object; None for other objects."""
    return SIDES[name[:2]] + name[2:] if name[:3] in {"fl_", "rl_"} else None


def mirrored_quat(quat: np.ndarray) -> np.ndarray:
    """Return a rotation mirrored in the plane y = 0: rotations about x and z change sign."""
    return quat * np.array([1.0, -1.0, 1.0, -1.0])


@pytest.mark.parametrize("name", [b for b in BODIES if on_the_right(b)])
def test_bodies_and_inertials(model: mujoco.MjModel, name: str) -> None:
    left, right = model.body(name), model.body(on_the_right(name))
    np.testing.assert_array_equal(right.pos, Y * left.pos)
    np.testing.assert_array_equal(right.quat, mirrored_quat(left.quat))
    np.testing.assert_array_equal(right.ipos, Y * left.ipos)
    np.testing.assert_array_equal(right.iquat, mirrored_quat(left.iquat))
    np.testing.assert_array_equal(right.mass, left.mass)
    np.testing.assert_array_equal(right.inertia, left.inertia)


@pytest.mark.parametrize("name", [j for j in JOINTS if on_the_right(j)])
def test_joints(model: mujoco.MjModel, name: str) -> None:
    left, right = model.joint(name), model.joint(on_the_right(name))
    np.testing.assert_array_equal(right.type, left.type)
    np.testing.assert_array_equal(right.pos, Y * left.pos)
    # Struts and kingpins lean to the middle and point up on both sides; all other axes are those of the vehicle.
    leaning = name.endswith(("_jounce", "_steer", "_mount_x", "_mount_y", "_mount_z"))
    np.testing.assert_array_equal(right.axis, Y * left.axis if leaning else left.axis)
    first, second = model.jnt_dofadr[left.id], model.jnt_dofadr[right.id]
    assert model.dof_damping[first] == model.dof_damping[second]
    assert model.dof_armature[first] == model.dof_armature[second]
    np.testing.assert_array_equal(right.range, left.range)


def test_sites(model: mujoco.MjModel) -> None:
    pairs = 0
    for i in range(model.nsite):
        left = model.site(i)
        if (name := on_the_right(left.name)) is None:
            continue
        right = model.site(name)
        np.testing.assert_array_equal(right.pos, Y * left.pos, err_msg=name)
        left_body = model.body(int(left.bodyid[0])).name
        assert model.body(int(right.bodyid[0])).name == (on_the_right(left_body) or left_body)
        pairs += 1
    assert pairs == 26  # front 3 links, spring, damper; rear 5 links, spring, damper: two ends each; two wheel centres


@pytest.mark.parametrize("name", [t for t in TENDONS if on_the_right(t)])
def test_links_springs_and_stops(model: mujoco.MjModel, name: str) -> None:
    left, right = model.tendon(name).id, model.tendon(on_the_right(name)).id
    for field in ("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss"):
        values = getattr(model, f"tendon_{field}")
        np.testing.assert_array_equal(values[right], values[left], err_msg=field)
    np.testing.assert_allclose(model.tendon_lengthspring[right], model.tendon_lengthspring[left], rtol=1e-14)


def test_what_belongs_to_no_side_lies_in_the_middle(model: mujoco.MjModel) -> None:
    for name in ("chassis", "rack"):
        assert model.body(name).ipos[1] == 0.0
    for name in ("steering_wheel", "superposition"):  # off the middle, so without mass
        assert model.body(name).mass[0] < 1e-6

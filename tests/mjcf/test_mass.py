"""Mass, centre of gravity and inertia of the whole car."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from tests.mjcf.car import car


@pytest.fixture(scope="module")
def at_design() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = car()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_total_mass_with_driver(at_design: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, _ = at_design
    assert model.body_mass.sum() == pytest.approx(1430.0, abs=0.01)


def test_cg_site_sits_at_the_centre_of_gravity(at_design: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    _, data = at_design
    np.testing.assert_allclose(data.site("cg").xpos, data.subtree_com[0], atol=5e-4)
    np.testing.assert_array_equal(data.site("cg").xmat.reshape(3, 3), np.eye(3))
    assert -data.subtree_com[0][0] / 2.637 == pytest.approx(1 - 0.59, abs=0.002)
    assert 0.54 <= data.subtree_com[0][2] <= 0.55


def test_inertia_about_the_centre_of_gravity(at_design: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = at_design
    inertia = np.zeros((3, 3))
    for body in range(1, model.nbody):
        turn = data.ximat[body].reshape(3, 3)
        arm = data.xipos[body] - data.subtree_com[0]
        inertia += turn @ np.diag(model.body_inertia[body]) @ turn.T
        inertia += model.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    roll, pitch, yaw = np.diag(inertia)
    assert roll == pytest.approx(530.0, rel=0.01)
    assert pitch == pytest.approx(2100.0, rel=0.01)
    assert yaw == pytest.approx(2200.0, rel=0.01)
    assert abs(inertia[0, 1]) < 1e-6
    assert abs(inertia[1, 2]) < 1e-6


@pytest.mark.parametrize("corner", CORNERS)
def test_unsprung_mass_and_wheel(at_design: tuple[mujoco.MjModel, mujoco.MjData], corner: str) -> None:
    model, _ = at_design
    wheel = model.body(f"{corner}_wheel")
    unsprung_kg = model.body(f"{corner}_knuckle").subtreemass[0]
    assert 18.0 <= wheel.mass[0] <= 19.0
    assert 0.9 <= wheel.inertia[1] <= 1.1
    assert (38.0 if corner[0] == "f" else 36.0) <= unsprung_kg <= (42.0 if corner[0] == "f" else 40.0)

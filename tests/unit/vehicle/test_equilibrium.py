"""The search for static ride: it finds the equilibrium, keeps fixed coordinates, and reports a missing equilibrium."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.errors import ModelError
from activesteer.vehicle.statics import static_ride
from tests.raising import raises
from tests.unit.vehicle.cars import standing

NOTHING = np.array([], dtype=np.intp)


def mass_on(joint: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco><option gravity="0 0 -10"/><worldbody>
      <body><joint name="heave" type="slide" axis="0 0 1" {joint}/><geom size="0.1" mass="2"/></body>
    </worldbody></mujoco>""")
    return model, mujoco.MjData(model)


def test_finds_the_balance_of_weight_and_spring() -> None:
    model, data = mass_on('stiffness="200"')
    static_ride(model, data, NOTHING)
    assert data.qpos[0] == pytest.approx(-0.1, abs=1e-9)


def test_finds_it_through_a_hardening_spring() -> None:
    model, data = mass_on('stiffness="100 0 5e4"')
    static_ride(model, data, NOTHING)
    x = -data.qpos[0]
    assert 100.0 * x + 5e4 * x**3 == pytest.approx(20.0, abs=1e-6)


def test_a_mass_that_nothing_carries_is_an_error_that_names_the_joint() -> None:
    model, data = mass_on("")
    with raises(ModelError, value="heave"):
        static_ride(model, data, NOTHING)


def test_a_held_coordinate_is_left_alone() -> None:
    model = mujoco.MjModel.from_xml_string("""
    <mujoco><option gravity="0 0 -10"/><worldbody>
      <body><joint name="heave" type="slide" axis="0 0 1"/><geom size="0.1" mass="2"/>
        <body><joint name="on_it" type="slide" axis="0 0 1" stiffness="50"/><geom size="0.1" mass="1"/></body>
      </body>
    </worldbody></mujoco>""")
    data = mujoco.MjData(model)
    data.qpos[0] = 0.3
    static_ride(model, data, np.array([0]))
    assert data.qpos.tolist() == [0.3, pytest.approx(-0.2, abs=1e-9)]


def test_a_car_far_from_balance_comes_to_it() -> None:
    vehicle = standing()
    model, data = vehicle.model, vehicle.data
    found = data.qpos.copy()
    data.qpos[2] -= 0.02
    held = [0, 1, 5, *(int(model.joint(f"{corner}_spin").dofadr[0]) for corner in ("fl", "fr", "rl", "rr"))]
    static_ride(model, data, np.array(held))
    np.testing.assert_allclose(data.qpos, found, atol=1e-8)


def test_a_car_in_the_air_has_none() -> None:
    vehicle = standing()
    model, data = vehicle.model, vehicle.data
    mujoco.mj_resetData(model, data)
    data.qpos[2] = 5.0
    held = [0, 1, 5, *(int(model.joint(f"{corner}_spin").dofadr[0]) for corner in ("fl", "fr", "rl", "rr"))]
    with raises(ModelError, value="root"):
        static_ride(model, data, np.array(held))

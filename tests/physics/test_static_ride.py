"""The standing car: it carries its weight, equally left and right, and its keyframe is an equilibrium."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.vehicle import Vehicle
from tests.physics.runs import car, corners, mass_kg, run


@pytest.fixture(scope="module")
def standing() -> Vehicle:
    return car()


def accelerations(vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray]:
    """Return linear [m/s2] and angular [rad/s2] accelerations of all bodies at rest, shape (nbody - 1, 3) each."""
    model, data = vehicle.model, vehicle.data
    along, about = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    linear, angular = [], []
    for body in range(1, model.nbody):
        mujoco.mj_jacBodyCom(model, data, along, about, body)
        linear.append(along @ data.qacc)
        angular.append(about @ data.qacc)
    return np.array(linear), np.array(angular)


def test_corner_loads_sum_to_the_weight(standing: Vehicle) -> None:
    loads_N = corners(run("standstill"), "tyre_fz_N")
    np.testing.assert_allclose(loads_N.sum(axis=1), mass_kg(standing) * GRAVITY_MPS2, rtol=1e-3)


def test_left_carries_as_much_as_right() -> None:
    loads_N = corners(run("standstill"), "tyre_fz_N")
    np.testing.assert_allclose(loads_N[:, ::2], loads_N[:, 1::2], rtol=1e-9)


def test_front_axle_carries_its_share_of_the_weight(standing: Vehicle) -> None:
    """Moments about the rear contact points: the front axle load follows from the position of the mass."""
    model, data = standing.model, standing.data
    chassis = model.body("chassis").id
    front_m, rear_m = (float(data.xpos[model.body(f"{axle}l_wheel").id, 0]) for axle in "fr")
    centre_m = float(data.subtree_com[chassis, 0])
    loads_N = corners(run("standstill"), "tyre_fz_N")[-1]
    share = (centre_m - rear_m) / (front_m - rear_m)
    assert loads_N[:2].sum() / loads_N.sum() == pytest.approx(share, abs=1e-3)


def test_no_body_accelerates_in_static_equilibrium(standing: Vehicle) -> None:
    mujoco.mj_forward(standing.model, standing.data)
    linear_mps2, angular_radps2 = accelerations(standing)
    assert np.abs(linear_mps2).max() < 1e-3
    assert np.abs(angular_radps2).max() < 1e-2


def test_no_body_accelerates_at_the_keyframe() -> None:
    vehicle = car()
    mujoco.mj_resetDataKeyframe(vehicle.model, vehicle.data, vehicle.model.key("static_ride").id)
    mujoco.mj_forward(vehicle.model, vehicle.data)
    linear_mps2, angular_radps2 = accelerations(vehicle)
    assert np.abs(linear_mps2).max() < 1e-3
    assert np.abs(angular_radps2).max() < 1e-2


def test_static_ride_is_the_design_position() -> None:
    """The springs are designed for static ride, so the hardpoints of the model file are those of the standing car."""
    assert np.abs(corners(run("standstill"), "travel_m")).max() < 2e-3
    assert np.abs(run("standstill")["roll_rad"]).max() < 1e-9

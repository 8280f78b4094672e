"""Damper curves: the applied force is that of the vehicle file, separately for rebound and bump."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.errors import ParameterError
from activesteer.scenario import load_car
from activesteer.vehicle import Vehicle
from activesteer.vehicle import force_block as fb
from tests.raising import raises
from tests.unit.vehicle.cars import standing

CURVE_MPS = [-0.8, -0.2, 0.0, 0.1, 0.5]
CURVE_N = [-2000.0, -900.0, 0.0, 250.0, 700.0]


@pytest.fixture(scope="module")
def car() -> Vehicle:
    curves = {}
    for axle, factor in (("front", 1.0), ("rear", 0.5)):
        curves[f"dampers.{axle}.velocity_mps"] = CURVE_MPS
        curves[f"dampers.{axle}.force_N"] = [factor * force for force in CURVE_N]
    return standing(curves)


def force_at(vehicle: Vehicle, corner: str, compression_mps: float) -> float:
    """Return the force of a damper compressed at a speed [N], positive in compression."""
    model, data = vehicle.model, vehicle.data
    joint = f"{corner}_jounce" if corner.startswith("f") else f"{corner}_z"
    dof = model.joint(joint).dofadr[0]
    tendon = model.tendon(f"{corner}_damper").id
    data.qvel[:] = 0.0
    data.qvel[dof] = 1.0
    mujoco.mj_forward(model, data)
    data.qvel[dof] = -compression_mps / data.ten_velocity[tendon]
    mujoco.mj_forward(model, data)
    assert data.ten_velocity[tendon] == pytest.approx(-compression_mps, abs=1e-12)
    data.qvel[:] = 0.0
    return float(data.userdata[len(CORNERS) * fb.USERDATA_PER_WHEEL + CORNERS.index(corner)])


@pytest.mark.parametrize("corner", CORNERS)
def test_force_is_the_curve_s(car: Vehicle, corner: str) -> None:
    velocities_mps = [-0.8, -0.5, -0.2, -0.07, 0.0, 0.03, 0.1, 0.3, 0.5]
    expected = (1.0 if corner.startswith("f") else 0.5) * np.interp(velocities_mps, CURVE_MPS, CURVE_N)
    np.testing.assert_allclose([force_at(car, corner, v) for v in velocities_mps], expected, rtol=1e-6, atol=1e-6)


def test_beyond_its_ends_the_curve_goes_on_with_its_last_slope(car: Vehicle) -> None:
    assert force_at(car, "fl", 0.9) == pytest.approx(700.0 + 0.4 * 450.0 / 0.4, abs=1e-6)
    assert force_at(car, "fl", -1.1) == pytest.approx(-2000.0 - 0.3 * 1100.0 / 0.6, abs=1e-6)


@pytest.mark.parametrize("corner", CORNERS)
def test_the_compact_s_dampers_resist_rebound_more_than_bump(corner: str) -> None:
    vehicle = standing()
    for speed_mps in (0.05, 0.1, 0.3, 0.6, 1.0):
        bump, rebound = (force_at(vehicle, corner, sign * speed_mps) for sign in (1.0, -1.0))
        assert bump > 0.0
        assert -rebound > 1.5 * bump


def test_bump_of_a_wheel_compresses_its_damper() -> None:
    vehicle = standing()
    model, data = vehicle.model, vehicle.data
    for corner in CORNERS:
        joint = f"{corner}_jounce" if corner.startswith("f") else f"{corner}_z"
        data.qvel[:] = 0.0
        data.qvel[model.joint(joint).dofadr[0]] = 0.2
        mujoco.mj_forward(model, data)
        assert data.ten_velocity[model.tendon(f"{corner}_damper").id] < -0.1


@pytest.mark.parametrize(
    ("velocity_mps", "force_N", "key"),
    [
        ([0.0, 0.1, 0.1], [0.0, 1.0, 2.0], "dampers.rear.velocity_mps"),
        ([0.2, 0.1], [0.0, 1.0], "dampers.rear.velocity_mps"),
        ([0.0, 0.1], [0.0, 1.0, 2.0], "dampers.rear.force_N"),
        ([0.0], [0.0], "dampers.rear.velocity_mps"),
        ([0.1 * i for i in range(13)], [0.0] * 13, "dampers.rear.velocity_mps"),
    ],
)
def test_a_wrong_curve_is_an_error_that_names_file_and_key(
    velocity_mps: list[float], force_N: list[float], key: str
) -> None:
    with raises(ParameterError, file="compact.toml", key=key):
        load_car(overrides={"dampers.rear.velocity_mps": velocity_mps, "dampers.rear.force_N": force_N})

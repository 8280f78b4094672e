from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import pytest

from activesteer.errors import ModelError, ParameterError
from activesteer.vehicle.native_forces import install_native_forces, remove_native_forces
from tests.raising import raises
from tests.tyre_rig import Motion, TyreRig
from tests.unit.tyre.tyres import tyre

AT = {"slip_angle_rad": 0.05, "slip_ratio": 0.02, "inclination_rad": 0.03, "load_N": 4000.0, "speed_mps": 20.0}


def test_a_sweep_is_its_points() -> None:
    rig = TyreRig(tyre())
    angles = np.array([-0.1, 0.0, 0.1])
    swept = rig.sweep(**(AT | {"slip_angle_rad": angles}))
    assert swept.force_N.shape == (3, 3)
    assert swept.loaded_radius_m.shape == (3,)
    one = rig.steady(**(AT | {"slip_angle_rad": 0.1}))
    assert one.force_N.shape == (3,)
    assert swept.force_N[2] == pytest.approx(one.force_N, rel=1e-9)


def test_points_do_not_depend_on_what_was_measured_before() -> None:
    rig = TyreRig(tyre())
    first = rig.steady(**AT)
    rig.steady(-0.2, 0.3, -0.1, 8000.0, -50.0, 2.0)
    rig.advance(Motion(0.25, (3.0, 2.0, -1.0), 50.0, 1.0, 0.1, 2.0, 1.0))
    assert rig.steady(**AT).force_N == pytest.approx(first.force_N, rel=1e-8)


def test_forces_turn_with_the_heading() -> None:
    rig = TyreRig(tyre())
    x, y, z = rig.steady(**AT).force_N
    assert rig.steady(**AT, heading_rad=0.5).force_N == pytest.approx(
        [math.cos(0.5) * x - math.sin(0.5) * y, math.sin(0.5) * x + math.cos(0.5) * y, z]
    )


def test_a_steady_motion_in_time_is_the_steady_state() -> None:
    rig = TyreRig(tyre())
    steady = rig.steady(**AT, heading_rad=0.5)
    time = np.arange(1000) * rig.timestep_s
    velocity = (20.0, 20.0 * math.tan(0.05))
    height = float(steady.loaded_radius_m) * math.cos(0.03)
    rig.reset()
    forces = rig.transient(time, velocity, float(steady.spin_radps), height, 0.5, 0.03)
    assert forces.force_N[0] != pytest.approx(steady.force_N, rel=0.1)
    assert forces.force_N[-1] == pytest.approx(steady.force_N, rel=1e-6)


def test_reset_releases_the_tyre() -> None:
    rig = TyreRig(tyre())
    motion = Motion(0.29, (0.0, 0.05, 0.0))
    first = rig.advance(motion)
    wound = [rig.advance(motion) for _ in range(50)][-1]
    assert abs(wound.force_N[1]) > 3 * abs(first.force_N[1])
    rig.reset()
    assert rig.advance(motion).force_N == pytest.approx(first.force_N, rel=1e-12)


def test_inclination_and_heading_rates_move_the_contact_point() -> None:
    rig = TyreRig(tyre())
    rolling = Motion(0.29, (20.0, 0.0, 0.0), 65.0)
    straight = rig.advance(rolling).force_N[1]
    rig.reset()
    # The top falls to the right, so the contact point moves to the left: force to the right.
    tilting = rig.advance(Motion(0.29, (20.0, 0.0, 0.0), 65.0, inclination_rate_radps=1.0)).force_N[1]
    assert tilting < straight
    rig.reset()
    # Turning about the vertical through an upright wheel leaves the contact point where it is.
    turning = rig.advance(Motion(0.29, (20.0, 0.0, 0.0), 65.0, heading_rate_radps=1.0)).force_N[1]
    assert turning == pytest.approx(straight, rel=1e-9)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("mu", 0.0),
        ("mu", math.nan),
        ("pressure_Pa", -1.0),
        ("timestep_s", math.inf),
        ("low_speed_damping_Nspm", -1.0),
        ("side", "left"),
    ],
)
def test_a_rig_that_cannot_be_is_an_error(key: str, value: Any) -> None:
    with raises(ParameterError, key=key, value=value):
        TyreRig(tyre(), **{key: value})


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"load_N": 0.0}, "load_N"),
        ({"speed_mps": 0.0}, "speed_mps"),
        ({"load_N": math.nan}, "load_N"),
        ({"slip_angle_rad": math.nan}, "alpha_rad"),
        ({"load_N": 1e9}, None),
    ],
)
def test_an_operating_point_that_cannot_be_is_an_error(changes, key: str | None) -> None:
    with raises(ParameterError, key=key):
        TyreRig(tyre()).steady(**(AT | changes))


def test_shapes_that_do_not_fit_are_errors() -> None:
    rig = TyreRig(tyre())
    with raises(ParameterError, cause=ValueError):
        rig.sweep(np.zeros(2), np.zeros(3), 0.0, 4000.0, 20.0)
    with raises(ParameterError, value=2):
        rig.sweep(np.zeros((2, 2)), 0.0, 0.0, 4000.0, 20.0)
    with raises(ParameterError, key="time_s"):
        rig.transient(np.linspace(0.0, 1.0, 11), (1.0, 0.0), 0.0, 0.29)
    with raises(ParameterError, cause=ValueError):
        rig.transient(np.arange(10) * 0.001, np.zeros((9, 2)), 0.0, 0.29)


def test_the_rig_measures_the_callback_and_nothing_else() -> None:
    rig = TyreRig(tyre())
    motion = Motion(0.29, (20.0, 1.0, 0.0), 65.0)
    assert rig.advance(motion).force_N[2] > 1000.0
    remove_native_forces()
    try:
        assert (rig.advance(motion).force_N == 0.0).all()
    finally:
        install_native_forces()


def test_a_callback_of_someone_else_is_reported() -> None:
    remove_native_forces()
    mujoco.set_mjcb_passive(lambda model, data: None)
    try:
        with raises(ModelError, value="mjcb_passive"):
            TyreRig(tyre())
    finally:
        mujoco.set_mjcb_passive(None)
        install_native_forces()

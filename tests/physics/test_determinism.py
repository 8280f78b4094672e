"""The callbacks are pure functions of the state: repeated computations are bit-identical."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import activesteer
from activesteer.simulation.closed_loop import ClosedLoop
from tests.physics.runs import (
    STEP_DEG,
    assert_goes_on_from_its_state,
    go_on,
    in_the_corner,
    step_steer,
    step_steer_scenario,
)

SYSTEMS = ("ars", *(pytest.param(name, marks=pytest.mark.slow) for name in ("none", "afs")))
DERIVED = ("qacc", "sensordata", "qfrc_passive", "qfrc_actuator", "act_dot", "userdata", "actuator_force")


@pytest.mark.parametrize("controller", SYSTEMS)
def test_two_runs_are_bit_identical(controller: str) -> None:
    first = step_steer(controller)
    second = activesteer.simulate("step_steer", controller, overrides={"steer.steering_wheel_deg": STEP_DEG})
    np.testing.assert_array_equal(first.values, second.values)
    np.testing.assert_array_equal(first.poses.positions_m, second.poses.positions_m)


@pytest.mark.parametrize("steps", [0, 600, 900])
def test_forward_called_twice_changes_nothing(steps: int) -> None:
    """The instants have the steering at rest, the steepest part of the response, and the end of the response."""
    vehicle = in_the_corner("ars", steps).vehicle
    model, data = vehicle.model, vehicle.data
    mujoco.mj_forward(model, data)
    first = {name: getattr(data, name).copy() for name in DERIVED}
    mujoco.mj_forward(model, data)
    mujoco.mj_forward(model, data)
    for name, values in first.items():
        np.testing.assert_array_equal(getattr(data, name), values, err_msg=name)


def test_a_call_in_between_does_not_change_the_run() -> None:
    plain, looked_at = in_the_corner("afs"), in_the_corner("afs")
    mujoco.mj_forward(looked_at.vehicle.model, looked_at.vehicle.data)
    np.testing.assert_array_equal(go_on(plain, 200), go_on(looked_at, 200))


@pytest.mark.parametrize("controller", SYSTEMS)
def test_a_restored_state_continues_bit_identically(controller: str) -> None:
    assert_goes_on_from_its_state(in_the_corner(controller), 1500)


@pytest.mark.parametrize("controller", SYSTEMS)
def test_a_state_restored_into_another_simulation_continues_bit_identically(controller: str) -> None:
    assert_goes_on_from_its_state(in_the_corner(controller), 1500, ClosedLoop(step_steer_scenario(), controller))


def test_saving_does_not_disturb_the_run() -> None:
    plain, saved = in_the_corner("ars"), in_the_corner("ars")
    saved.save_state()
    np.testing.assert_array_equal(go_on(plain, 200), go_on(saved, 200))


def test_two_cars_in_one_process_do_not_disturb_each_other() -> None:
    alone = go_on(in_the_corner("ars"), 200)
    one, other = in_the_corner("ars"), in_the_corner("none")
    interleaved = []
    for _ in range(200):
        interleaved.append(go_on(one, 1))
        go_on(other, 1)
    # Every channel but the unwrapped yaw angle depends on one row alone; its wrapping is the same here.
    np.testing.assert_array_equal(np.concatenate(interleaved), alone)

"""The state of a car without position, heading and wheel angles."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from activesteer.core.signals import ActuatorCommand, DriverCommand
from activesteer.scenario import resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.vehicle.linear_state import LocalState

ROLLING = {"kind": "open_loop", "speed_kmh": 80, "duration_s": 1.0, "settle_s": 0.5}


@pytest.fixture
def local() -> LocalState:
    return LocalState(ClosedLoop(resolve(ROLLING)).vehicle)


def step(local: LocalState) -> None:
    local.vehicle.step(DriverCommand(0.02, 100.0), ActuatorCommand(0.001, 0.0))


def test_what_was_written_is_read(local, rng):
    difference = rng.normal(0.0, 1e-5, len(local.names))
    local.write(difference)
    assert local.read() == pytest.approx(difference, abs=1e-9)


def test_names_are_one_each_and_leave_out_what_is_cyclic(local):
    assert len(set(local.names)) == len(local.names)
    assert {"z", "roll", "pitch", "d_x", "d_y", "d_yaw", "act_fl_slip_y", "d_fl_spin"} <= set(local.names)
    assert not {"x", "y", "yaw", "fl_spin", "act_fl_brake"} & set(local.names)


def test_motion_does_not_depend_on_place_heading_and_wheel_angles(local, rng):
    difference = rng.normal(0.0, 1e-4, len(local.names))
    local.write(difference)
    step(local)
    expected = local.read()
    local.write(difference)
    data, angle = local.vehicle.data, 0.7
    turned = np.empty(4)
    mujoco.mju_mulQuat(turned, np.array([math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)]), data.qpos[3:7])
    data.qpos[3:7] = turned
    data.qpos[:2] = 300.0, -40.0
    vx, vy = data.qvel[:2]
    data.qvel[:2] = math.cos(angle) * vx - math.sin(angle) * vy, math.sin(angle) * vx + math.cos(angle) * vy
    for corner in ("fl", "fr", "rl", "rr"):
        data.qpos[int(local.vehicle.model.joint(f"{corner}_spin").qposadr[0])] = 1.3
    step(local)
    assert local.read() == pytest.approx(expected, abs=1e-9)


def test_roll_does_not_turn_the_heading(local):
    difference = np.zeros(len(local.names))
    difference[local.names.index("roll")] = 0.01
    local.write(difference)
    assert local.read()[local.names.index("d_y")] == pytest.approx(0.0, abs=1e-12)

"""Dry friction of seals and rack: it holds, slips, dissipates energy, and is smoothed by a vibrating road."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.errors import ModelError, ParameterError
from activesteer.scenario import load_car
from activesteer.vehicle import Vehicle
from activesteer.vehicle.native_actuators import friction_rate
from tests.raising import raises
from tests.unit.vehicle.cars import activation, actuator, changed_model, dof, floating, standing, step

SLIP_M = 4e-4
NO_FRICTION = {"friction.front_damper_N": 0.0, "friction.rear_damper_N": 0.0, "friction.rack_N": 0.0}


def follow(speed_mps: np.ndarray, vibration_mps: float = 0.0, timestep_s: float = 1e-3) -> np.ndarray:
    """Return the deflection over time, in units of the deflection at which the seal slips."""
    w, result = 0.0, []
    for v in speed_mps:
        w += timestep_s * friction_rate(w, float(v), vibration_mps, SLIP_M, timestep_s)
        result.append(w / SLIP_M)
    return np.array(result)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_seal_gives_way_elastically_then_slips_at_its_force(side: float) -> None:
    w = follow(np.full(2000, side * 1e-3))
    assert w[9] == pytest.approx(side * 1e-5 / SLIP_M, rel=0.05)
    assert w[-1] == pytest.approx(side, rel=0.01)
    assert np.abs(w).max() <= 1.0


@pytest.mark.parametrize("speed_mps", [0.01, 1.0, 100.0])
def test_the_force_of_slipping_does_not_depend_on_speed(speed_mps: float) -> None:
    assert follow(np.full(3000, speed_mps))[-1] == pytest.approx(1.0, rel=1e-6)


def test_a_seal_at_rest_stays_as_it_is() -> None:
    assert friction_rate(0.3 * SLIP_M, 0.0, 0.0, SLIP_M, 1e-3) == 0.0


def test_a_cycle_loses_four_times_force_and_amplitude() -> None:
    time_s = np.arange(0.0, 4.0, 1e-3)
    amplitude_m, omega = 0.05, 2.0 * math.pi
    v = amplitude_m * omega * np.cos(omega * time_s)
    loss = np.sum(follow(v)[1000:2000] * v[1000:2000]) * 1e-3
    # Less what is stored elastically at the ends and given back: twice two slip lengths.
    assert loss == pytest.approx(4.0 * amplitude_m, rel=4.0 * SLIP_M / amplitude_m)


@pytest.mark.parametrize("speed_mps", [1e-7, 0.01, 0.05, 0.1, 0.3])
def test_on_a_shaking_road_the_mean_of_the_true_force_is_left(speed_mps: float) -> None:
    vibration_mps = 0.07
    w = follow(np.full(2000, speed_mps), vibration_mps)[-1]
    # The normal distribution itself, by its quantiles.
    grid = (np.arange(400_000) + 0.5) / 400_000 * 16.0 - 8.0
    weight = np.exp(-0.5 * grid**2)
    expected = np.sum(np.sign(speed_mps + vibration_mps * grid) * weight) / weight.sum()
    assert w == pytest.approx(expected, abs=2e-5)
    if speed_mps > 1e-6:
        assert w > 0.0


def test_a_shaken_seal_does_not_hold() -> None:
    rate = friction_rate(SLIP_M, 0.0, 0.07, SLIP_M, 1e-3)
    assert rate < -1e-2


def test_the_step_does_not_matter() -> None:
    time_s = np.arange(0.0, 1.0, 1e-4)
    v = 0.1 * np.sin(2.0 * math.pi * 1.5 * time_s)
    for vibration_mps in (0.0, 0.07):
        fine = follow(v, vibration_mps, 1e-4)[9::10]
        assert follow(v.reshape(-1, 10).mean(axis=1), vibration_mps) == pytest.approx(fine, abs=0.005)


def test_without_friction_nothing_is_wound_up() -> None:
    vehicle = floating(NO_FRICTION)
    vehicle.data.qvel[dof(vehicle, "fl_jounce")] = 1.0
    step(vehicle, 20)
    names = [*(f"{corner}_damper_friction" for corner in CORNERS), "rack_friction"]
    assert [activation(vehicle, name) for name in names] == [0.0] * 5
    assert [vehicle.data.actuator_force[actuator(vehicle, name)] for name in names] == [0.0] * 5


@pytest.mark.parametrize("corner", CORNERS)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_friction_of_a_damper_acts_against_its_motion(corner: str, side: float) -> None:
    vehicle = floating()
    model, data = vehicle.model, vehicle.data
    friction = vehicle.parameters.friction
    force_N = friction.front_damper_N if corner.startswith("f") else friction.rear_damper_N
    slip_m = force_N / friction.damper_stiffness_Npm
    index, tendon = actuator(vehicle, f"{corner}_damper_friction"), model.tendon(f"{corner}_damper").id
    data.act[model.actuator_actadr[index]] = side * slip_m
    joint = f"{corner}_jounce" if corner.startswith("f") else f"{corner}_z"
    data.qvel[dof(vehicle, joint)] = -side * 0.5
    mujoco.mj_forward(model, data)
    assert data.ten_velocity[tendon] * side > 0.3
    assert data.actuator_force[index] == pytest.approx(-side * force_N, rel=1e-6)
    assert data.actuator_force[index] * data.actuator_velocity[index] < 0.0


def heave(vehicle: Vehicle, force_N: float) -> float:
    """Return the settlement of the standing car under a slowly applied force on its body [m]."""
    before = float(vehicle.data.qpos[2])
    for index in range(3000):
        vehicle.data.qfrc_applied[2] = -force_N * min(1.0, index / 1000)
        step(vehicle, 1)
    return before - float(vehicle.data.qpos[2])


def test_the_standing_car_rides_on_its_tyres_until_the_seals_slip() -> None:
    """A light push acts against stuck dampers, a strong push against the springs."""
    tyres_only, springs = heave(standing(), 20.0) / 20.0, heave(standing(NO_FRICTION), 20.0) / 20.0
    assert springs > 1.0 / 100e3
    assert tyres_only < 0.45 * springs
    assert heave(standing(), 4000.0) / 4000.0 == pytest.approx(heave(standing(NO_FRICTION), 4000.0) / 4000.0, rel=0.05)


def turn(vehicle: Vehicle, target_rad: float) -> float:
    """Return the rack position after the steering wheel has been turned slowly to an angle [m]."""
    start = float(vehicle.data.joint("steering_wheel").qpos[0])
    for index in range(2500):
        share = 0.5 - 0.5 * math.cos(math.pi * min(1.0, index / 2000))
        vehicle.data.ctrl[actuator(vehicle, "steering_wheel")] = start + share * (target_rad - start)
        step(vehicle, 1)
    return float(vehicle.data.joint("rack").qpos[0])


def test_the_rack_lags_behind_the_steering_wheel_by_its_friction_over_the_column_s_stiffness() -> None:
    vehicle = floating()
    model = vehicle.model
    column = float(model.tendon_stiffness[model.tendon("steering_column").id])
    turn(vehicle, 0.5)
    from_left = turn(vehicle, 0.0)
    turn(vehicle, -0.5)
    from_right = turn(vehicle, 0.0)
    lag_m = 2.0 * vehicle.parameters.friction.rack_N / column
    assert from_left - from_right == pytest.approx(lag_m, rel=0.1)
    free = floating(NO_FRICTION)
    turn(free, 0.5)
    assert abs(turn(free, 0.0)) < 0.02 * lag_m


def test_friction_is_recorded_as_forces() -> None:
    vehicle = standing()
    names = [channel.name for channel in vehicle.channels.channels]
    for name in (*(f"{corner}_damper_friction_N" for corner in CORNERS), "rack_friction_N"):
        assert name in names


def test_static_ride_leaves_friction_relaxed() -> None:
    vehicle = standing()
    assert not vehicle.data.act.any()


def test_friction_without_a_place_in_the_model_is_answered(tmp_path: Path) -> None:
    rack = '    <general name="rack_friction" class="friction_state" joint="rack"/>\n'
    mjcf = changed_model(tmp_path, "compact.xml", rack, "")
    given = load_car()
    with raises(ModelError, file=str(mjcf), value="rack_friction"):
        dataclasses.replace(given, mjcf=mjcf).on()
    dataclasses.replace(load_car(overrides={"friction.rack_N": 0.0}), mjcf=mjcf).on()


def test_negative_friction_is_answered() -> None:
    with raises(ParameterError, file="compact.toml", key="friction.rack_N", value=-1.0):
        load_car(overrides={"friction.rack_N": -1.0})

"""Steering servos, brakes and drive: lag, limits, holding and slipping, and the reaction of each torque."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import ActuatorCommand, DriverCommand, WheelTorques
from activesteer.errors import ParameterError
from activesteer.vehicle import Tape, Vehicle
from activesteer.vehicle.parameters import PowertrainLimits
from tests.raising import raises
from tests.unit.vehicle.cars import activation, actuator, dof, floating, standing, step

SERVOS = ("superposition", "rl_steer", "rr_steer")


def lag_and_rate(vehicle: Vehicle, name: str) -> tuple[float, float]:
    lag, rate = vehicle.model.actuator_dynprm[actuator(vehicle, name), :2]
    return float(lag), float(rate)


@pytest.mark.parametrize("name", SERVOS)
def test_a_small_step_follows_with_the_lag(name: str) -> None:
    vehicle = floating()
    lag_s, rate = lag_and_rate(vehicle, name)
    target = 0.5 * rate * lag_s
    vehicle.data.ctrl[actuator(vehicle, name)] = target
    step(vehicle, round(lag_s / vehicle.timestep_s))
    # Of a first-order lag; half a step of its 25 is what the time grid leaves open.
    assert activation(vehicle, name) / target == pytest.approx(1.0 - math.exp(-1.0), abs=0.02)
    step(vehicle, round(9.0 * lag_s / vehicle.timestep_s))
    assert activation(vehicle, name) == pytest.approx(target, rel=1e-3)


def test_servos_of_a_longer_lag_are_as_much_slower_and_no_factor_is_without_effect() -> None:
    for name in SERVOS:
        assert lag_and_rate(standing({"factors.servo_lag": 1.2}), name)[0] == pytest.approx(
            1.2 * lag_and_rate(standing(), name)[0]
        )
    motors = {"rear_actuator.preset": "screw_3deg", "superposition_actuator.preset": "strain_wave"}
    with raises(ParameterError, key="factors.servo_lag", value=1.2):
        standing({"factors.servo_lag": 1.2, **motors})


@pytest.mark.parametrize("name", SERVOS)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_large_step_follows_at_the_rate_limit(name: str, side: float) -> None:
    vehicle = floating()
    lag_s, rate = lag_and_rate(vehicle, name)
    high = float(vehicle.model.actuator_ctrlrange[actuator(vehicle, name), 1])
    vehicle.data.ctrl[actuator(vehicle, name)] = side * high
    limited_s = high / rate - lag_s
    assert limited_s > 0.03
    before = 0.0
    for _ in range(round(limited_s / vehicle.timestep_s) - 1):
        step(vehicle, 1)
        now = activation(vehicle, name)
        assert side * (now - before) == pytest.approx(rate * vehicle.timestep_s, rel=1e-6)
        before = now


@pytest.mark.parametrize("name", SERVOS)
def test_a_demand_beyond_the_range_stops_at_the_range(name: str) -> None:
    vehicle = floating()
    high = float(vehicle.model.actuator_ctrlrange[actuator(vehicle, name), 1])
    vehicle.data.ctrl[actuator(vehicle, name)] = 5.0 * high
    step(vehicle, 600)
    assert activation(vehicle, name) <= high
    assert activation(vehicle, name) == pytest.approx(high, rel=1e-3)
    assert vehicle.data.joint(name).qpos[0] == pytest.approx(high, rel=0.02)


@pytest.mark.parametrize("name", SERVOS)
def test_the_wheel_s_hinge_follows_its_servo(name: str) -> None:
    vehicle = floating()
    vehicle.data.ctrl[actuator(vehicle, name)] = 0.02
    step(vehicle, 400)
    assert vehicle.data.joint(name).qpos[0] == pytest.approx(0.02, abs=5e-4)


@pytest.mark.parametrize("name", ["rl_steer", "rr_steer"])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rear_hinges_stop_at_three_degrees(name: str, side: float) -> None:
    """Demanded beyond the angle and pushed with the full force of the servo, for a tenth of a second."""
    vehicle = floating()
    vehicle.data.ctrl[actuator(vehicle, name)] = side * 0.2
    largest = 0.0
    for index in range(500):
        vehicle.data.qfrc_applied[dof(vehicle, name)] = side * 800.0 * min(1.0, index / 100)
        step(vehicle, 1)
        largest = max(largest, abs(float(vehicle.data.joint(name).qpos[0])))
    assert math.degrees(largest) < 3.15
    assert math.degrees(abs(float(vehicle.data.joint(name).qpos[0]))) == pytest.approx(3.0, abs=0.05)


def test_the_commands_reach_their_actuators() -> None:
    vehicle = standing()
    ratio = vehicle.parameters.steering.ratio
    vehicle.step(DriverCommand(0.3, 800.0, 0.25), ActuatorCommand(0.01, 0.02))
    ctrl = vehicle.data.ctrl
    brakes = vehicle.parameters.brakes
    assert ctrl[actuator(vehicle, "steering_wheel")] == 0.3
    assert ctrl[actuator(vehicle, "superposition")] == pytest.approx(0.02 * ratio)
    assert [ctrl[actuator(vehicle, f"{corner}_steer")] for corner in ("rl", "rr")] == [0.01, 0.01]
    assert sum(ctrl[actuator(vehicle, f"{corner}_drive")] for corner in CORNERS) == pytest.approx(800.0)
    for _ in range(100):
        vehicle.step(DriverCommand(0.3, 800.0, 0.25), ActuatorCommand(0.01, 0.02))
    assert ctrl[actuator(vehicle, "fl_brake")] == pytest.approx(0.25 * brakes.front_torque_Nm, rel=1e-4)
    assert ctrl[actuator(vehicle, "rr_brake")] == pytest.approx(0.25 * brakes.rear_torque_Nm, rel=1e-4)


def test_what_a_controller_asks_of_brakes_and_drive_comes_on_top_of_the_driver() -> None:
    vehicle = standing()
    rows = vehicle.rows.empty(1)
    recorded, poses = Tape(), np.empty((2, vehicle.model.nbody, 4))
    asked = ActuatorCommand(brake_torque_demand_Nm=(300.0, 0.0, -50.0, 20.0), drive_torque_change_Nm=-200.0)
    for _ in range(100):
        vehicle.step(DriverCommand(0.0, 800.0, 0.25), asked)
    tape = recorded.record
    tape["row"], tape["row_bytes"], tape["room"] = rows.sensordata.ctypes.data, rows.sensordata.strides[0], 1
    tape["pose_every"], tape["position"], tape["quaternion"] = 2, poses[0].ctypes.data, poses[1].ctypes.data
    vehicle.record_on(recorded)
    vehicle.step(DriverCommand(0.0, 800.0, 0.25), asked)
    front_Nm, rear_Nm = (0.25 * torque for torque in (vehicle.parameters.brakes.front_torque_Nm, 700.0))
    brakes = [vehicle.data.ctrl[actuator(vehicle, f"{corner}_brake")] for corner in CORNERS]
    assert brakes == pytest.approx([front_Nm + 300.0, front_Nm, rear_Nm - 50.0, rear_Nm + 20.0], rel=1e-3)
    assert vehicle.data.ctrl[actuator(vehicle, "fl_drive")] == pytest.approx(0.5 * 600.0)
    values = vehicle.channels.evaluate(rows)[0]
    recorded = dict(zip((channel.name for channel in vehicle.channels.channels), values, strict=True))
    assert [recorded[f"{corner}_brake_torque_demand_Nm"] for corner in CORNERS] == [300.0, 0.0, -50.0, 20.0]
    assert recorded["drive_torque_change_Nm"] == -200.0


def test_a_controller_does_not_drive_while_the_clutch_is_open() -> None:
    vehicle = standing()
    vehicle.step(DriverCommand(gear=0), ActuatorCommand(drive_torque_change_Nm=500.0))
    assert [vehicle.data.ctrl[actuator(vehicle, f"{corner}_drive")] for corner in CORNERS] == [0.0] * 4


def push(vehicle: Vehicle, corner: str, torque_Nm: float, steps: int) -> float:
    """Turn a wheel by a torque for some steps; return its speed [rad/s]."""
    vehicle.data.qfrc_applied[dof(vehicle, f"{corner}_spin")] = torque_Nm
    step(vehicle, steps)
    return float(vehicle.data.qvel[dof(vehicle, f"{corner}_spin")])


@pytest.mark.parametrize("corner", CORNERS)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_brake_holds_up_to_its_torque_and_slips_beyond(corner: str, side: float) -> None:
    vehicle = floating()
    vehicle.data.ctrl[actuator(vehicle, f"{corner}_brake")] = 300.0
    push(vehicle, corner, side * 280.0, 3000)
    assert abs(push(vehicle, corner, side * 280.0, 500)) < 0.02
    held_rad = float(vehicle.data.joint(f"{corner}_spin").qpos[0])
    assert abs(held_rad) < 0.1
    # Wound up by the torque that it holds.
    assert activation(vehicle, f"{corner}_brake") == pytest.approx(
        side * 280.0 / vehicle.parameters.brakes.stiffness_Nmprad, rel=0.05
    )
    slipping = floating()
    slipping.data.ctrl[actuator(slipping, f"{corner}_brake")] = 300.0
    assert side * push(slipping, corner, side * 400.0, 100) > 1.0
    force = slipping.data.actuator_force[actuator(slipping, f"{corner}_brake")]
    assert force == pytest.approx(-side * 300.0, rel=1e-6)


def test_a_brake_demand_beyond_its_strength_gives_its_strength() -> None:
    vehicle = floating()
    vehicle.data.ctrl[actuator(vehicle, "rl_brake")] = 1e5
    push(vehicle, "rl", 3000.0, 100)
    maximum = vehicle.parameters.brakes.rear_torque_Nm
    assert vehicle.data.actuator_force[actuator(vehicle, "rl_brake")] == pytest.approx(-maximum, rel=1e-6)


@pytest.mark.parametrize("corner", CORNERS)
def test_a_spinning_wheel_in_the_air_runs_out_by_the_drag_of_its_brake_and_stays(corner: str) -> None:
    vehicle = floating({"brakes.drag_torque_Nm": 1.5})
    spin = dof(vehicle, f"{corner}_spin")
    inertia = vehicle.model.body_inertia[vehicle.model.body(f"{corner}_wheel").id].max()
    vehicle.data.qvel[spin] = 1.0
    mujoco.mj_forward(vehicle.model, vehicle.data)
    speeds = []
    for _ in range(1200):
        step(vehicle, 1)
        speeds.append(float(vehicle.data.qvel[spin]))
    slope = (speeds[300] - speeds[100]) / 0.2
    # The wheel's own inertia, less what the light knuckle gives way.
    assert slope == pytest.approx(-1.5 / inertia, rel=0.1)
    assert abs(speeds[-1]) < 0.01
    assert np.abs(speeds[900:]).max() < 0.03


def test_tyres_in_the_air_lose_their_deflection() -> None:
    vehicle = floating()
    model, data = vehicle.model, vehicle.data
    slips = [model.actuator_actadr[actuator(vehicle, f"{corner}_slip_{axis}")] for corner in CORNERS for axis in "xy"]
    data.act[slips] = 0.02
    step(vehicle, 50)
    np.testing.assert_allclose(data.act[slips], 0.02 * math.exp(-1.0), rtol=0.03)
    step(vehicle, 450)
    assert np.abs(data.act[slips]).max() < 2e-6


def generalised(vehicle: Vehicle, name: str) -> np.ndarray:
    """Return the generalised forces of 100 Nm of an actuator, shape (nv,)."""
    vehicle.data.ctrl[actuator(vehicle, name)] = 100.0
    mujoco.mj_forward(vehicle.model, vehicle.data)
    return vehicle.data.qfrc_actuator.copy()


@pytest.mark.parametrize("corner", CORNERS)
def test_drive_torque_reacts_on_the_chassis(corner: str) -> None:
    """The half-shaft bypasses the suspension: its joints carry the torque, and no net torque acts on the car."""
    vehicle = floating()
    torques = WheelTorques(tuple(100.0 * (each == corner) for each in CORNERS), (0.0,) * 4)  # type: ignore[arg-type]
    before = vehicle.data.qpos.copy()
    vehicle.step(DriverCommand(wheel_torques=torques), ActuatorCommand())
    vehicle.data.qpos[:], vehicle.data.qvel[:] = before, 0.0
    force = generalised(vehicle, f"{corner}_drive")
    root = dof(vehicle, "root")
    np.testing.assert_allclose(force[root : root + 6], 0.0, atol=1e-9)
    assert force[dof(vehicle, f"{corner}_spin")] == pytest.approx(100.0, rel=1e-3)
    ball = dof(vehicle, f"{corner}_topmount" if corner.startswith("f") else f"{corner}_rot")
    assert force[ball + 1] == pytest.approx(100.0, rel=1e-3)


def test_drive_torque_lags_behind_its_demand() -> None:
    vehicle = floating()
    for _ in range(round(vehicle.parameters.powertrain.lag_s / vehicle.timestep_s)):
        vehicle.step(DriverCommand(drive_torque_demand_Nm=200.0), ActuatorCommand())
    assert activation(vehicle, "fl_drive") == pytest.approx(63.2, abs=0.1)


def test_open_clutch_takes_the_torque_away_at_once() -> None:
    vehicle = floating()
    for gear, torque_Nm in ((1, 86.5), (0, 0.0)):
        for _ in range(round(2.0 * vehicle.parameters.powertrain.lag_s / vehicle.timestep_s)):
            vehicle.step(DriverCommand(drive_torque_demand_Nm=200.0, gear=gear), ActuatorCommand())
        assert activation(vehicle, "fl_drive") == pytest.approx(torque_Nm, abs=0.1)


@pytest.mark.parametrize(("speed_radps", "gear"), [(0.0, 1), (20.0, 1), (80.0, 1), (-20.0, 1), (-20.0, -1)])
@pytest.mark.parametrize("front_fraction", [1.0, 0.4])
def test_the_drive_gives_what_the_engine_gives_at_the_mean_speed_of_its_wheels(
    speed_radps, gear, front_fraction
) -> None:
    vehicle = floating({"powertrain.front_fraction": front_fraction, "powertrain.lag_s": 0.001})
    engine = vehicle.parameters.powertrain
    turning = speed_radps * np.array([0.6, 1.4, 0.9, 1.1])
    for demand_Nm in (1e5, -1e5):
        vehicle.data.act[:] = 0.0
        for _ in range(30):
            vehicle.data.qvel[:] = 0.0
            for corner, speed in zip(CORNERS, turning, strict=True):
                vehicle.data.qvel[dof(vehicle, f"{corner}_spin")] = speed
            vehicle.step(DriverCommand(drive_torque_demand_Nm=demand_Nm, gear=gear), ActuatorCommand())
        given = [float(vehicle.data.actuator_force[actuator(vehicle, f"{corner}_drive")]) for corner in CORNERS]
        low, high = PowertrainLimits(engine).limits_Nm(speed_radps, gear)
        expected = high if demand_Nm > 0.0 else low
        np.testing.assert_allclose(given, expected * np.asarray(engine.wheel_fractions), rtol=1e-9, atol=1e-9)
        assert float(np.dot(given, turning)) <= engine.max_power_W * (1.0 + 1e-12)


def test_torques_given_wheel_by_wheel_arrive_at_once_and_unlimited() -> None:
    vehicle = floating()
    torques = WheelTorques((9e3, -9e3, 8e3, 0.0), (0.0, 0.0, 0.0, 0.0))
    vehicle.step(DriverCommand(wheel_torques=torques), ActuatorCommand())
    given = [vehicle.data.actuator_force[actuator(vehicle, f"{corner}_drive")] for corner in CORNERS]
    np.testing.assert_allclose(given, torques.drive_Nm, rtol=1e-12)


def test_engine_turns_with_the_wheels_that_it_drives_while_the_clutch_is_closed() -> None:
    """In the air, an external torque accelerates wheels and engine; the rear wheels drive no engine."""
    vehicle = floating({"powertrain.inertia_kgm2": 3.0})
    data, rest = vehicle.data, vehicle.save_state()

    def inertia_kgm2(corner: str, gear: int) -> float:
        spin, faster = dof(vehicle, f"{corner}_spin"), []
        for torque_Nm in (0.0, 10.0):
            vehicle.restore_state(rest)
            data.qfrc_applied[spin] = torque_Nm
            vehicle.step(DriverCommand(gear=gear), ActuatorCommand())
            faster.append(float(data.qacc[spin]))
        return 10.0 / (faster[1] - faster[0])

    for corner, engine_kgm2 in (("fl", 1.5), ("fr", 1.5), ("rl", 0.0), ("rr", 0.0)):
        for gear in (1, -1):
            added = inertia_kgm2(corner, gear) - inertia_kgm2(corner, 0)
            assert added == pytest.approx(engine_kgm2, abs=1e-4)

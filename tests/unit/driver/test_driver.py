"""The open-loop driver and the speed hold."""

from __future__ import annotations

import pytest

from activesteer.core.signals import Measurement, Motion, Setpoint
from activesteer.driver import OpenLoopDriver, SpeedHold
from tests.unit.driver.drives import DRIVE, parameters

MASS_KG, RADIUS_M = 1400.0, 0.31
MOTION = Motion(0.0, 0.0, 0.0, 20.0, 0.0, 0.0)


def speed_hold(timestep_s: float = 0.001) -> SpeedHold:
    return SpeedHold(parameters(), DRIVE, MASS_KG, RADIUS_M, timestep_s)


def driver() -> OpenLoopDriver:
    return OpenLoopDriver(speed_hold(), steering_ratio=16.0, steering_wheel_limit_rad=8.0)


def at(speed_mps: float, faster_mps: float = 0.0) -> Measurement:
    """Measurement of a car whose front wheels spin."""
    front, rear = (speed_mps + faster_mps) / RADIUS_M, speed_mps / RADIUS_M
    return Measurement(0.0, speed_mps, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (front, front, rear, rear))


def drive(block: SpeedHold, wanted_mps: float, speed_mps: float, drag_N: float, steps: int) -> list[float]:
    """Speeds of a point mass driven by the block."""
    speeds = []
    for _ in range(steps):
        torque = block.step(wanted_mps, at(speed_mps))
        speed_mps += (torque / RADIUS_M - drag_N) / MASS_KG * 0.001
        speeds.append(speed_mps)
    return speeds


def test_speed_is_held_against_drag_without_an_error_that_stays():
    speeds = drive(speed_hold(), 22.0, 22.0, drag_N=400.0, steps=20_000)
    assert min(speeds) > 21.8
    assert speeds[-1] == pytest.approx(22.0, abs=1e-4)


def test_speed_error_is_answered_in_proportion():
    accelerated_mps2 = speed_hold().step(20.0, at(19.9)) / RADIUS_M / MASS_KG
    assert accelerated_mps2 == pytest.approx(0.1 * parameters().speed_gain_1ps)


@pytest.mark.parametrize(
    ("wanted_mps", "torque_Nm"), [(60.0, 100e3 / 25.0 * RADIUS_M), (0.0, -350.0 * 100e3 / 1900.0 / 25.0 * RADIUS_M)]
)
def test_torque_stops_at_the_limits_of_the_engine_and_says_so(wanted_mps, torque_Nm):
    block = speed_hold()
    assert block.step(wanted_mps, at(25.0)) == pytest.approx(torque_Nm)
    assert block.saturated
    block.step(25.0, at(25.0))
    assert not block.saturated


def test_long_acceleration_at_full_throttle_does_not_wind_up():
    speeds = drive(speed_hold(), 30.0, 10.0, drag_N=300.0, steps=30_000)
    assert max(speeds) < 30.3
    assert speeds[-1] == pytest.approx(30.0, abs=1e-3)


def test_wish_to_stand_still_needs_no_torque_at_rest():
    block = speed_hold()
    block.step(0.0, at(0.2))
    assert block.step(0.0, at(0.01)) == 0.0
    assert block.step(0.0, at(-0.01)) == 0.0


def test_reset_forgets_the_trim():
    used = speed_hold()
    drive(used, 22.0, 22.0, drag_N=400.0, steps=5000)
    assert used.step(22.0, at(22.0)) > 50.0
    used.reset()
    assert used.step(22.0, at(22.0)) == 0.0


def test_driver_turns_the_steering_wheel_as_asked():
    command = driver().step(Setpoint(0.8, 20.0, 0.0, True), at(20.0), MOTION)
    assert command.steering_wheel_demand_rad == 0.8
    assert command.front_steer_demand_rad == pytest.approx(0.05)
    assert command.brake_pedal == 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_steering_wheel_stops_at_its_lock(side):
    command = driver().step(Setpoint(side * 9.0, 20.0, 0.0, True), at(20.0), MOTION)
    assert command.steering_wheel_demand_rad == side * 8.0
    assert command.front_steer_demand_rad == side * 0.5
    assert command.saturated
    assert not driver().step(Setpoint(side * 7.0, 20.0, 0.0, True), at(20.0), MOTION).saturated


def test_driver_holds_speed_only_where_asked_and_presses_the_brake():
    asked = driver()
    assert asked.step(Setpoint(0.0, 21.0, 0.0, True), at(20.0), MOTION).drive_torque_demand_Nm > 0.0
    command = asked.step(Setpoint(0.0, 21.0, 0.6, False), at(20.0), MOTION)
    assert command.drive_torque_demand_Nm == 0.0
    assert command.brake_pedal == 0.6


def test_driver_starts_anew_after_braking():
    used = driver()
    for _ in range(3000):
        used.step(Setpoint(0.0, 21.0, 0.0, True), at(20.5), MOTION)
    used.step(Setpoint(0.0, 21.0, 0.6, False), at(20.0), MOTION)
    held = Setpoint(0.0, 20.0, 0.0, True)
    assert (
        used.step(held, at(19.9), MOTION).drive_torque_demand_Nm
        == driver().step(held, at(19.9), MOTION).drive_torque_demand_Nm
    )


def test_reversing_car_is_driven_backwards_and_braked_forwards_by_the_engine():
    assert speed_hold().step(-10.0, at(0.0)) == -1900.0
    assert 0.0 < speed_hold().step(-1.0, at(-10.0)) <= 350.0
    assert driver().step(Setpoint(0.0, -10.0, 0.0, True), at(0.0), MOTION).gear == -1


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_foot_goes_back_while_wheels_spin_and_returns_slowly_when_they_roll(side):
    block, known = speed_hold(), parameters()
    asked = block.step(side * 20.0, at(side * 10.0))
    spinning = [block.step(side * 20.0, at(side * 10.0, side * 8.0)) for _ in range(round(1e3 * known.foot_lag_s))]
    assert block.saturated
    assert spinning[-1] / spinning[0] == pytest.approx(0.368, rel=0.02)
    rolling = [block.step(side * 20.0, at(side * 10.0)) for _ in range(200)]
    assert rolling[0] / asked < 0.4
    assert (rolling[-1] - rolling[0]) / asked == pytest.approx(known.foot_return_per_s * 0.199, rel=0.01)


def test_slip_of_the_greatest_force_is_no_spin():
    block = speed_hold()
    alone = block.step(40.0, at(25.0, 3.0))
    for _ in range(1000):
        assert block.step(40.0, at(25.0, 3.0)) == alone

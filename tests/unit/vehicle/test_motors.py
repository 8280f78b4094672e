"""Electric motors in the native step: torques, limits, power, faults; wheel torques of a controller."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from activesteer.config import read_toml
from activesteer.config.faults import Fault
from activesteer.core.conventions import CORNERS
from activesteer.core.signals import NO_BRAKES, ActuatorCommand, DriverCommand, WheelTorques
from activesteer.errors import ManeuverError, ParameterError
from activesteer.resources import find_vehicle
from activesteer.road.road import Road
from activesteer.scenario import load_car
from activesteer.scenario.car import split_axles
from activesteer.vehicle import Vehicle
from activesteer.vehicle.electric_actuators import Battery, Motor, Motors
from activesteer.vehicle.faults import Faults
from tests.raising import raises

PAIR = "compact_electric"
NO_TCS = {"brakes.tcs": False}


def rolling(speed_mps: float, changes: dict[str, Any] | None = None, vehicle: str = PAIR) -> Vehicle:
    car = load_car(vehicle, changes).on()
    car.start(speed_mps)
    return car


def drive(vehicle: Vehicle, steps: int, added_Nm=(0.0,) * 4, **driver: Any) -> np.ndarray:
    """Return the torques at the wheels after some steps."""
    command = ActuatorCommand(wheel_torque_demand_Nm=added_Nm)
    for _ in range(steps):
        vehicle.step(DriverCommand(**driver), command)
    return np.array([vehicle.data.actuator(f"{corner}_drive").force[0] for corner in CORNERS])


def wheel_speeds(vehicle: Vehicle) -> np.ndarray:
    return np.array([vehicle.data.joint(f"{corner}_spin").qvel[0] for corner in CORNERS])


def test_a_motor_adds_the_torque_of_the_controller_to_the_share_of_the_driver_with_its_lag() -> None:
    vehicle = rolling(20.0, NO_TCS | {"motors.rl.rate_Nmps": 1e6, "motors.rr.rate_Nmps": 1e6})
    lag_steps = 15
    after_lag = drive(vehicle, lag_steps, (0.0, 0.0, -200.0, 300.0), drive_torque_demand_Nm=400.0)
    np.testing.assert_allclose(after_lag[2:], np.array([0.0, 500.0]) * (1.0 - math.exp(-1.0)), atol=1e-6)
    settled = drive(vehicle, 300, (0.0, 0.0, -200.0, 300.0), drive_torque_demand_Nm=400.0)
    np.testing.assert_allclose(settled, [0.0, 0.0, 0.0, 500.0], atol=1e-4)


def test_right_torque_turns_the_car_to_the_left_and_equal_torques_do_not_turn_it() -> None:
    rates = []
    for added in ((0.0, 0.0, -400.0, 400.0), (0.0, 0.0, 400.0, -400.0), (0.0, 0.0, 400.0, 400.0)):
        vehicle = rolling(20.0)
        drive(vehicle, 500, added)
        rates.append(float(vehicle.data.qvel[5]))
    assert rates[0] > 0.02
    assert rates[1] == pytest.approx(-rates[0], rel=1e-6)
    assert abs(rates[2]) < 1e-9


def test_rate_limit_map_and_power_limit_the_torque() -> None:
    vehicle = rolling(20.0, NO_TCS)
    motor = vehicle.parameters.motors.rr
    assert motor is not None
    assert motor.rate_Nmps is not None
    first, second = (drive(vehicle, 1, (0.0, 0.0, 0.0, 9e3))[3] for _ in range(2))
    assert second - first == pytest.approx(motor.gear_ratio * motor.rate_Nmps * 1e-3, rel=1e-9)
    torque = drive(vehicle, 600, (0.0, 0.0, 0.0, 9e3))[3]
    speed = vehicle.electric.states["torque_Nm"][1], wheel_speeds(vehicle)[3]
    assert torque == pytest.approx(min(motor.wheel_torque_Nm, motor.power_W / speed[1]), rel=2e-3)
    assert vehicle.electric.states["limited"].tolist() == [0.0, 1.0]
    fast = rolling(48.0, NO_TCS)
    torque, speed = drive(fast, 300, (0.0, 0.0, 9e3, 9e3))[3], wheel_speeds(fast)[3]
    assert torque * speed == pytest.approx(motor.power_W, rel=2e-3)


def test_the_power_of_a_motor_is_its_torque_times_speed_over_its_efficiency_and_less_comes_back() -> None:
    for demand_Nm in (600.0, -600.0):
        vehicle = rolling(20.0)
        drive(vehicle, 200, drive_torque_demand_Nm=0.0)
        drive(vehicle, 200, (0.0, 0.0, 0.5 * demand_Nm, 0.5 * demand_Nm))
        speed = wheel_speeds(vehicle)[2:].copy()
        torque = drive(vehicle, 1, (0.0, 0.0, 0.5 * demand_Nm, 0.5 * demand_Nm))[2:]
        mechanical = torque * speed
        electric = np.where(mechanical > 0.0, mechanical / 0.92, mechanical * 0.92) + 150.0
        np.testing.assert_allclose(vehicle.electric.states["power_W"], electric, rtol=1e-9)
        assert vehicle.electric.state[0] == pytest.approx(electric.sum() + 400.0)


def test_the_battery_limits_the_power_both_ways() -> None:
    limits = {"battery.discharge_power_W": 20e3, "battery.charge_power_W": 10e3} | NO_TCS
    for demand_Nm, limit_W in ((1500.0, 20e3), (-1500.0, -10e3)):
        vehicle = rolling(20.0, limits)
        drive(vehicle, 300, (0.0, 0.0, 0.5 * demand_Nm, 0.5 * demand_Nm))
        assert vehicle.electric.state[0] == pytest.approx(limit_W, rel=1e-6)
        assert vehicle.electric.state[2] == 1.0


def test_a_motor_without_regeneration_does_not_brake() -> None:
    vehicle = rolling(20.0, {"motors.rl.regeneration": 0.0, "motors.rr.regeneration": 0.5})
    left, right = drive(vehicle, 300, (0.0, 0.0, -9e3, -9e3))[2:]
    assert left == pytest.approx(0.0, abs=1e-9)
    assert right == pytest.approx(-0.5 * 55e3 / wheel_speeds(vehicle)[3], rel=0.01)


AXLE: dict[str, Any] = {
    "motors": {
        "rear": {"speed_radps": [0.0, 1700.0], "torque_Nm": [300.0, 300.0], "gear_ratio": 9.0, "lag_s": 0.01},
    },
    "powertrain": {
        "front_fraction": 0.0, "max_torque_Nm": 2700.0, "max_power_W": 120e3, "engine_brake_torque_Nm": 300.0,
        "max_wheel_speed_radps": 180.0,
    },
}  # fmt: skip


def of_axle(**changes: Any) -> Vehicle:
    table, _ = read_toml(find_vehicle("compact"))
    motors = {"rear": {**AXLE["motors"]["rear"], **changes}}
    vehicle = load_car({**table, **AXLE, "motors": motors}).on()
    vehicle.start(20.0)
    return vehicle


def test_an_open_differential_gives_both_wheels_the_mean_and_a_splitting_one_the_difference() -> None:
    np.testing.assert_allclose(drive(of_axle(), 200, (0.0, 0.0, -200.0, 600.0))[2:], [200.0, 200.0], rtol=1e-6)
    splitting = of_axle(differential="splitting", split_torque_Nm=500.0)
    np.testing.assert_allclose(drive(splitting, 200, (0.0, 0.0, -200.0, 600.0))[2:], [-50.0, 450.0], rtol=1e-6)
    np.testing.assert_allclose(drive(splitting, 200, (0.0, 0.0, 0.0, 200.0))[2:], [0.0, 200.0], rtol=1e-6, atol=1e-6)


def test_an_engine_gets_the_sum_of_its_wheels_and_an_undriven_wheel_refuses() -> None:
    vehicle = rolling(20.0, None, "compact")
    given = drive(vehicle, 1500, (300.0, 100.0, 0.0, 0.0))
    np.testing.assert_allclose(given, [200.0, 200.0, 0.0, 0.0], rtol=1e-5)
    with raises(ParameterError, key="wheel_torque_demand_Nm"):
        drive(vehicle, 1, (0.0, 0.0, 10.0, 0.0))


def test_torques_of_the_driver_stay_absolute_and_switch_the_motors_off() -> None:
    vehicle = rolling(20.0)
    torques = WheelTorques((10.0, 20.0, 30.0, 40.0), NO_BRAKES)
    given = drive(vehicle, 2, (0.0, 0.0, 500.0, 500.0), wheel_torques=torques)
    np.testing.assert_allclose(given, [10.0, 20.0, 30.0, 40.0])
    assert vehicle.electric.state[0] == pytest.approx(400.0 + 300.0)


def test_a_motor_has_no_clutch_so_only_the_torque_of_the_driver_is_missing() -> None:
    vehicle = rolling(20.0)
    drive(vehicle, 100, drive_torque_demand_Nm=800.0)
    given = drive(vehicle, 300, (0.0, 0.0, -300.0, 500.0), drive_torque_demand_Nm=800.0, gear=0)
    np.testing.assert_allclose(given, [0.0, 0.0, -300.0, 500.0], atol=1e-3)


def test_a_wheel_that_spins_loses_the_controller_s_torque_with_traction_control() -> None:
    speeds = []
    for tcs in (True, False):
        vehicle = load_car(PAIR, {"brakes.tcs": tcs}).on(Road(mu=0.15))
        vehicle.start(15.0)
        drive(vehicle, 800, (0.0, 0.0, 0.0, 1200.0))
        speeds.append(wheel_speeds(vehicle)[3] / wheel_speeds(vehicle)[0])
    assert speeds[0] < 1.2
    assert speeds[1] > 1.5


def test_state_is_saved_and_restored_to_the_last_bit() -> None:
    vehicle = rolling(20.0)
    drive(vehicle, 20, (0.0, 0.0, -100.0, 200.0), drive_torque_demand_Nm=300.0)
    state = vehicle.save_state()
    first = drive(vehicle, 30, (0.0, 0.0, 300.0, -200.0)), vehicle.electric.state.copy(), vehicle.data.qpos.copy()
    vehicle.restore_state(state)
    again = drive(vehicle, 30, (0.0, 0.0, 300.0, -200.0)), vehicle.electric.state.copy(), vehicle.data.qpos.copy()
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, other)


FAULTS: dict[str, tuple[dict[str, Any], Any]] = {
    "stuck": ({}, lambda before: before), "dropout": ({}, lambda _: 0.0), "reversed": ({}, lambda _: 100.0),
    "offset": ({"size_Nm": 70.0}, lambda _: -30.0), "runaway": ({}, None),
}  # fmt: skip


@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_of_a_motor_acts_and_ends(kind: str) -> None:
    vehicle, (size, expected) = rolling(8.0), FAULTS[kind]
    faults = Faults(vehicle, [Fault("motor_rl", kind, 0.0, 1.0, **size)])
    before = drive(vehicle, 300, (0.0, 0.0, 200.0, 200.0))[2]
    faults.act(0)
    left, right = drive(vehicle, 500, (0.0, 0.0, -100.0, 200.0))[2:]
    most = min(155.0 * 9.5, 55e3 / wheel_speeds(vehicle)[2])
    assert left == pytest.approx(most if expected is None else expected(before), rel=2e-2, abs=1e-3)
    assert right == pytest.approx(200.0, abs=1e-3)
    faults.act(1000)
    assert drive(vehicle, 500, (0.0, 0.0, -100.0, 200.0))[2] == pytest.approx(-100.0, abs=1e-3)


def test_a_fault_of_a_motor_that_a_car_lacks_is_refused() -> None:
    with raises(ManeuverError, key="part"):
        Faults(rolling(0.0), [Fault("motor_front", "stuck", 0.0)])
    with raises(ManeuverError, key="part"):
        Faults(rolling(0.0, None, "compact"), [Fault("motor_rl", "stuck", 0.0)])
    with raises(ManeuverError, key="kind"):
        Fault("motor_rl", "float", 0.0)


GOOD: dict[str, Any] = {"speed_radps": (0.0, 100.0), "torque_Nm": (10.0, 5.0)}


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: Motor((0.0,), (10.0,)), "speed_radps"),
        (lambda: Motor((0.0, 100.0), (10.0, -5.0)), "torque_Nm"),
        (lambda: Motor((10.0, 100.0), (10.0, 5.0)), "speed_radps"),
        (lambda: Motor(**GOOD, split_torque_Nm=10.0), "split_torque_Nm"),
        (lambda: Motor(**GOOD, differential="splitting"), "split_torque_Nm"),
        (lambda: Motors(rl=Motor(**GOOD)), "rr"),
        (lambda: Motors(rear=Motor(**GOOD), rl=Motor(**GOOD), rr=Motor(**GOOD)), "rl"),
        (
            lambda: Motors(
                fl=Motor(**GOOD), fr=Motor(**GOOD, differential="splitting", split_torque_Nm=1.0)
            ),
            "fr.differential",
        ),
    ],
)  # fmt: skip
def test_wrong_motors_are_refused(make, key: str) -> None:
    with raises(ParameterError, key=key):
        make()


def test_keys_without_effect_are_refused() -> None:
    with raises(ParameterError, key="battery"):
        load_car("compact", {"battery.auxiliary_power_W": 100.0})
    with raises(ParameterError, key="powertrain.inertia_kgm2"):
        load_car(PAIR, {"powertrain.inertia_kgm2": 2.0})


def test_the_driver_knows_the_limits_of_the_motors() -> None:
    weaker = {f"motors.{corner}.{key}": value for corner in ("rl", "rr") for key, value in
              (("max_power_W", 20e3), ("torque_Nm", [50.0, 50.0]))}  # fmt: skip
    drive_of = load_car(PAIR, weaker).config.drive
    assert (drive_of.max_torque_Nm, drive_of.max_power_W) == (950.0, 40e3)
    assert load_car("compact").config.drive == load_car("compact").config.powertrain


def test_power_of_a_map_has_its_maximum_between_its_points() -> None:
    """T = 10 - 0.1 n from 0 to 100 rad/s: T n has its maximum 250 W at 50 rad/s."""
    assert Motor((0.0, 100.0), (10.0, 0.0)).power_W == pytest.approx(250.0)
    assert Motor((0.0, 100.0), (10.0, 0.0), max_power_W=90.0).power_W == 90.0
    assert Battery().discharge_power_W is None


def test_an_axle_that_splits_its_torque_drives_a_wheel_by_half_of_torque_and_difference() -> None:
    splitting = Motor(**GOOD, differential="splitting", split_torque_Nm=600.0)
    [axle] = split_axles(Motors(rear=splitting))
    assert (axle.place, axle.difference_Nm) == (2, 600.0)
    assert axle.torque_Nm == pytest.approx(0.5 * (splitting.wheel_torque_Nm + 600.0))
    [axle] = split_axles(Motors(fl=Motor(**GOOD), fr=Motor(**GOOD)))
    own = Motor(**GOOD).wheel_torque_Nm
    assert (axle.place, axle.torque_Nm, axle.difference_Nm) == (0, own, 2.0 * own)
    assert split_axles(Motors(front=Motor(**GOOD))) == ()

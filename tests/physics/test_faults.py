"""Effects of faults on the car: actuators that stick, run away or fail free; wrong sensor signals."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer import ActuatorCommand, Recording, Simulation
from activesteer.config.faults import fault_table
from activesteer.errors import ManeuverError
from tests.physics.runs import assert_goes_on_bit_by_bit
from tests.raising import raises

AT_S = 1.0
ROW = round(1000 * AT_S)
STEP = {"steer.steering_wheel_deg": 36.5, "duration_s": 2.0, "settle_s": 0.5, "speed_kmh": 120.0}


class Weaves:
    """A controller that steers both axles alternately to both sides."""

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        angle = 0.02 * np.sin(2.0 * np.pi * max(measurement.time_s, 0.0))
        return ActuatorCommand(rear_steer_demand_rad=angle, superposition_demand_rad=angle)


class Reads:
    """A controller that demands nothing and records its measurements."""

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        return ActuatorCommand(yaw_rate_desired_radps=measurement.yaw_rate_radps, prediction_rad=measurement.ay_mps2)


@functools.cache
def driven(*faults: str, controller: Any = Weaves, **overrides: Any) -> Recording:
    changes = {**STEP, **overrides}
    if faults:
        changes["fault"] = [fault_table(text) for text in faults]
    return activesteer.simulate("step_steer", controller, overrides=changes)


@pytest.fixture(scope="module")
def healthy() -> Recording:
    return driven()


@pytest.fixture(scope="module")
def told() -> Recording:
    return driven(controller=Reads)


def test_nothing_differs_before_the_fault_and_what_differs_after_it_is_recorded(healthy: Recording) -> None:
    failed = driven(f"rear:stuck@{AT_S}-1.5")
    for name in ("rear_steer_rad", "yaw_rate_radps", "x_m", "y_m"):
        np.testing.assert_array_equal(failed[name][:ROW], healthy[name][:ROW])
        assert (failed[name][ROW + 50 :] != healthy[name][ROW + 50 :]).all()
    active = failed["active_faults"]
    assert (active[ROW:1500] == 1).all()
    assert not active[:ROW].any()
    assert not active[1500:].any()
    assert not healthy["active_faults"].any()


@pytest.mark.parametrize(("part", "channel"), [("rear", "rear_steer_rad"), ("superposition", "superposition_rad")])
def test_stuck_means_that_the_angle_stays(part: str, channel: str) -> None:
    failed = driven(f"{part}:stuck@1.2")
    demand = failed[channel.replace("_rad", "_demand_rad")]
    assert np.ptp(demand[1200:]) > 0.02
    # What is left is the give of the servo's screw and of the housing under the wheel's forces.
    assert np.ptp(failed[channel][1250:]) < 0.04 * np.ptp(demand[1200:])


def test_one_side_sticks_and_the_other_goes_on() -> None:
    failed = driven("rear_left:stuck@1.2")
    left, right = failed["rl_steer_rad"][1250:], failed["rr_steer_rad"][1250:]
    assert np.ptp(left) < 0.3 * np.ptp(right)


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_runaway_goes_to_the_stop_at_the_actuator_s_own_rate(side: str, sign: float) -> None:
    failed = driven(f"rear:runaway={side}@{AT_S}", controller="none")
    angle, rate = sign * failed["rear_steer_rad"], np.gradient(sign * failed["rear_steer_rad"], 1e-3)
    assert angle[-1] == pytest.approx(np.radians(3.0), abs=np.radians(0.05))
    # dynprm of the model: 0.5 rad/s; 0.05 rad at that rate are 0.1 s.
    assert np.median(rate[ROW + 20 : ROW + 70]) == pytest.approx(0.5, rel=0.1)


def test_mirrored_faults_in_mirrored_runs_mirror() -> None:
    one = driven(f"rear:runaway=left@{AT_S}", controller="none")
    other = driven(f"rear:runaway=right@{AT_S}", controller="none", **{"steer.steering_wheel_deg": -36.5})
    for name in ("y_m", "yaw_rate_radps", "rear_steer_rad"):
        np.testing.assert_allclose(one[name], -other[name], atol=1e-6)


def test_a_floating_rear_wheel_gives_way_to_its_forces() -> None:
    failed = driven(f"rear:float@{AT_S}", controller="none")
    # The tyres' side force acts behind the hinge and turns the wheels out of the bend until they are at the stop.
    assert abs(failed["rear_steer_rad"][ROW - 1]) < np.radians(0.1)
    assert abs(failed["rear_steer_rad"][-1]) == pytest.approx(np.radians(3.0), abs=np.radians(0.05))
    assert failed["rear_steer_rad"][-1] < 0.0 < failed["ay_mps2"][ROW]


def test_a_servo_comes_back_from_floating_at_its_own_rate() -> None:
    # The sedan's superposition is as good as rigid: with a servo that went on without its part it would strike.
    start_s, end_s = 0.95, 1.1
    fault = {"fault": [fault_table(f"superposition:float@{start_s}-{end_s}")]}
    back = activesteer.simulate("step_steer", vehicle="sedan", overrides=STEP | fault)
    angle, rows = back["superposition_rad"], slice(round(1e3 * end_s), None)
    rate_radps = np.gradient(angle, 1e-3)
    assert abs(angle[rows][0]) > np.radians(1.0)
    assert abs(angle[-1]) < np.radians(0.01)
    assert np.abs(rate_radps[rows][5:]).max() == pytest.approx(np.radians(28.8), rel=0.05)
    assert np.abs(back["ay_mps2"]).max() < 9.0


SLOW: dict[str, Any] = {"speed_kmh": 20.0, "steer.steering_wheel_deg": 5.0}
"""The wheels' forces are small, and with them the give of the servos."""


@pytest.fixture(scope="module")
def healthy_and_slow() -> Recording:
    return driven(**SLOW)


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ("offset=0.5deg", lambda angle: angle[1300:] + np.radians(0.5)),
        ("reversed", lambda angle: -angle[1300:]),
        ("dropout", lambda angle: 0.0 * angle[1300:]),
        ("delayed=0.1s", lambda angle: angle[1200:-100]),
    ],
)
def test_faults_of_the_demand(fault: str, expected: Any, healthy_and_slow: Recording) -> None:
    failed = driven(f"rear:{fault}@{AT_S}", **SLOW)
    good = healthy_and_slow["rear_steer_rad"]
    assert np.ptp(good[1300:]) > 0.03
    np.testing.assert_allclose(failed["rear_steer_rad"][1300:], expected(good), atol=2e-4)


def test_a_sensor_s_fault_changes_what_the_controller_is_told_and_not_the_car(told: Recording) -> None:
    failed = driven(
        f"yaw_rate_sensor:stuck@{AT_S}", f"ay_sensor:offset=0.5mps2@{AT_S}-1.5", controller=Reads
    )  # fmt: skip
    np.testing.assert_array_equal(failed["yaw_rate_radps"], told["yaw_rate_radps"])
    good, read = told["yaw_rate_desired_radps"], failed["yaw_rate_desired_radps"]
    # A controller's row holds what it made of the reading of the step before.
    np.testing.assert_array_equal(read[: ROW + 1], good[: ROW + 1])
    assert (read[ROW + 1 :] == good[ROW]).all()
    off = failed["prediction_rad"] - told["prediction_rad"]
    np.testing.assert_allclose(off[ROW + 1 : 1501], 0.5, rtol=1e-12)
    assert not off[: ROW + 1].any()
    assert not off[1501:].any()
    assert failed["active_faults"][ROW] == 2


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ("delayed=0.05s", lambda good: good[ROW + 1 - 50 : -50]),
        ("reversed", lambda good: -good[ROW + 1 :]),
        ("dropout", lambda good: 0.0 * good[ROW + 1 :]),
        ("runaway=1.3radps", lambda good: 0.0 * good[ROW + 1 :] + 1.3),
    ],
)
def test_the_kinds_of_sensor_faults(fault: str, expected: Any, told: Recording) -> None:
    failed = driven(f"yaw_rate_sensor:{fault}@{AT_S}", controller=Reads)
    np.testing.assert_array_equal(failed["yaw_rate_desired_radps"][ROW + 1 :], expected(told["yaw_rate_desired_radps"]))


def test_a_wheel_speed_sensor_is_one_of_four() -> None:
    speeds = []

    class Keeps:
        def step(self, command: Any, measurement: Any) -> ActuatorCommand:
            speeds.append(measurement.wheel_speed_radps)
            return ActuatorCommand()

    overrides = {
        **STEP,
        "duration_s": 0.2,
        "steer.start_s": 0.1,
        "fault": [fault_table("fr_wheel_speed_sensor:dropout@0.1")],
    }
    activesteer.simulate("step_steer", Keeps, overrides=overrides)
    assert speeds[-1][1] == 0.0
    assert min(speeds[-1][0], *speeds[-1][2:]) > 50.0


def test_a_dead_wheel_speed_sensor_reaches_the_anti_lock_system_of_ideal_sensors_too() -> None:
    """For the control unit the wheel has locked: it lowers the pressure, and the car pulls to the other side."""
    stop: dict[str, Any] = {"speed_kmh": 60.0, "duration_s": 1.2}
    fault = {"fault": [fault_table(f"fl_wheel_speed_sensor:dropout@{AT_S}")]}
    good = activesteer.simulate("straight_braking", overrides=stop)
    failed = activesteer.simulate("straight_braking", overrides={**stop, **fault})
    for name in ("x_m", "fl_brake_pressure_Pa", "rr_slip_ratio", "abs_speed_mps"):
        np.testing.assert_array_equal(failed[name][:ROW], good[name][:ROW])
    assert failed["fl_brake_pressure_Pa"][-1] < 0.1 * failed["fr_brake_pressure_Pa"][-1]
    assert failed["yaw_rate_radps"][-1] < -0.05


def test_a_steering_angle_sensor_s_fault_reaches_the_controller_of_ideal_sensors_too() -> None:
    texts = (f"steering_wheel_sensor:dropout@{AT_S}-1.5",)
    good, failed = driven(controller="ars"), driven(*texts, controller="ars")
    np.testing.assert_array_equal(failed["prediction_rad"][:ROW], good["prediction_rad"][:ROW])
    assert abs(good["prediction_rad"][1490]) > np.radians(0.5)
    # The prediction is that of a driver who has let go; then it comes back.
    assert abs(failed["prediction_rad"][1490]) < 0.05 * abs(good["prediction_rad"][1490])
    assert failed["prediction_rad"][-1] == pytest.approx(good["prediction_rad"][-1], rel=0.05)
    np.testing.assert_allclose(failed["steering_wheel_rad"], good["steering_wheel_rad"], atol=0.02)


def test_one_wheel_of_a_screw_for_both_is_no_part() -> None:
    central = {"rear_actuator.preset": "screw_10deg"}
    with raises(ManeuverError, key="part", value="rear_left", allowed=["rear"]):
        driven(f"rear_left:stuck@{AT_S}", **central)


def test_a_state_saved_in_the_midst_of_faults_goes_on_bit_by_bit() -> None:
    texts = (
        "rear:delayed=0.08s@0.6",
        "yaw_rate_sensor:stuck@0.9-1.4",
        "superposition:offset=1deg@0.7-1.1",
        "steering_wheel_sensor:offset=5deg@0.8-1.2",
        "rl_wheel_speed_sensor:dropout@0.5",
    )
    overrides = {**STEP, "fault": [fault_table(text) for text in texts]}
    assert_goes_on_bit_by_bit(overrides, save_at=950, back_after=800)


@pytest.mark.parametrize(
    "fault", ["rear:float", "rear:offset=1deg", "rear:reversed", "superposition:runaway=left", "rear_left:stuck"]
)
def test_after_the_last_fault_the_car_is_as_built(fault: str) -> None:
    simulation = Simulation("step_steer", "ars", overrides={**STEP, "fault": [fault_table(f"{fault}@0.5-0.6")]})
    model = simulation.loop.vehicle.model

    def numbers() -> list[Any]:
        return [model.numeric_data.copy(), model.actuator_gainprm.copy(), model.actuator_biasprm.copy()]

    before = numbers()
    simulation.advance(550)
    assert any((now != then).any() for now, then in zip(numbers(), before, strict=True))
    simulation.run()
    for now, then in zip(numbers(), before, strict=True):
        np.testing.assert_array_equal(now, then)


def test_the_search_for_an_amplitude_drives_the_car_in_order() -> None:
    aimed = {key: value for key, value in STEP.items() if key != "steer.steering_wheel_deg"} | {"speed_kmh": 80.0}
    fault = {"fault": [fault_table("rear:runaway=left@0.1")]}
    one, other = (Simulation("step_steer", overrides={**aimed, **more}) for more in ({}, fault))
    found, expected = (simulation.context.metadata["maneuver"]["steer"] for simulation in (one, other))
    assert found == expected


BRAKING: dict[str, Any] = {
    "kind": "open_loop", "speed_kmh": 80.0, "duration_s": 2.0, "settle_s": 0.5, "drive": "coast",
    "brake": {"time_s": [0.2, 0.3], "pedal": [0.0, 0.2]},
}  # fmt: skip


@pytest.fixture(scope="module")
def braking() -> Recording:
    return activesteer.simulate(BRAKING)


@pytest.mark.parametrize(
    ("fault", "torque_Nm"),
    [
        ("stuck", lambda good: good[ROW - 1]),
        ("dropout", lambda good: 0.0),
        ("offset=100Nm", lambda good: good[-1] + 100.0),
    ],
)
def test_faults_of_one_brake_pull_the_car_to_a_side(fault: str, torque_Nm: Any, braking: Recording) -> None:
    failed = activesteer.simulate(BRAKING, overrides={"fault": [fault_table(f"fl_brake:{fault}@{AT_S}")]})
    good = -braking["fl_brake_torque_Nm"]
    drag_Nm = 2.0
    assert -failed["fl_brake_torque_Nm"][-1] == pytest.approx(torque_Nm(good), abs=0.02 * good.max() + drag_Nm)
    np.testing.assert_allclose(failed["fr_brake_torque_Nm"][-1], braking["fr_brake_torque_Nm"][-1], rtol=0.02)
    pull = {"stuck": 0.0, "dropout": -1.0, "offset=100Nm": 1.0}[fault]
    if pull:
        assert pull * failed["yaw_rate_radps"][-1] > 0.003


def test_a_brake_that_runs_away_brakes_with_all_its_strength() -> None:
    table = {**BRAKING, "brake": {"time_s": [0.0], "pedal": [0.0]}}
    failed = activesteer.simulate(table, overrides={"fault": [fault_table(f"rl_brake:runaway@{AT_S}")]})
    assert failed["rl_slip_ratio"][-1] < -0.9
    assert failed["yaw_rate_radps"][ROW + 200] > 0.0

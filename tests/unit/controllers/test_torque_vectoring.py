"""Torque vectoring: signs, limits of motors, friction and battery, and the allocation with the steering."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from activesteer import simulate
from activesteer.controllers import load_controller
from activesteer.controllers.corrector import MIN_SPEED_MPS
from activesteer.controllers.torque_vectoring import Range, SplitTorques, TorqueVectoring
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.core.signals import NO_TORQUES, DriverCommand, Estimate
from activesteer.errors import ControllerError
from activesteer.scenario import resolve
from tests.raising import raises
from tests.unit.controllers.cars import held, measured, steering

SPEED_MPS = 25.0
CAR = "compact_electric"
STRAIGHT = Estimate(SPEED_MPS, 0.0, 0.0, 0.0, 0.9, *[0.0] * 5)


@pytest.fixture(scope="module")
def known():
    return resolve("straight_line", CAR).controller_setup(0.005)


def torques_of(known, moment_Nm, driver=None, now=STRAIGHT, ay_mps2=0.0, speed_mps=SPEED_MPS):
    seen = measured(0.0, speed_mps)._replace(ay_mps2=ay_mps2, wheel_speed_radps=(speed_mps / 0.307,) * 4)
    return SplitTorques(known).for_moment(moment_Nm, driver or DriverCommand(), seen, now._replace(speed_mps=speed_mps))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_more_torque_on_the_right_makes_a_moment_to_the_left_and_the_sum_stays(known, side):
    (fl, fr, rl, rr), reached = torques_of(known, side * 500.0)
    assert fl == fr == 0.0
    assert side * rr > 0.0 > side * rl
    assert rl + rr == pytest.approx(0.0, abs=1e-9)
    # By hand: the force of each wheel at half of the rear track of 1.524 m.
    radius_m = known.estimation.rolling_radius_m[2]
    assert (rr - rl) / radius_m * 0.5 * 1.524 == pytest.approx(side * 500.0) == pytest.approx(reached)


def test_the_moment_grows_with_the_speed_up_to_full_speed_and_no_further(known):
    p, asked_Nm = known.gains.tv, {}

    class Kept:
        def for_moment(self, moment_Nm, _command, _measurement, now):
            asked_Nm[now.speed_mps] = moment_Nm
            return NO_TORQUES, 0.0

    class Rolling:
        def step(self, measurement):
            return STRAIGHT._replace(speed_mps=measurement.speed_mps, yaw_rate_radps=0.1)

    vectoring: Any = TorqueVectoring(known)
    vectoring._estimator, vectoring._torques, vectoring._yaw_inertia_kgm2 = Rolling(), Kept(), 2000.0
    half_mps = 0.5 * (MIN_SPEED_MPS + p.full_speed_mps)
    for speed_mps in (half_mps, p.full_speed_mps, 3.0 * p.full_speed_mps):
        vectoring.step(steering(0.0), measured(0.0, speed_mps))
    full_Nm = -2000.0 * 0.1 / p.yaw_rate_time_s
    assert list(asked_Nm.values()) == pytest.approx([0.5 * full_Nm, full_Nm, full_Nm])


def test_without_an_error_there_is_no_torque_and_errors_have_the_sign_of_their_moment(known):
    def answer(front_rad, yaw_rate):
        return held(
            load_controller("tv", known), steering(front_rad), measured(yaw_rate, SPEED_MPS), 5
        ).wheel_torque_demand_Nm

    assert max(map(abs, answer(0.0, 0.0))) < 1e-9
    _, _, rl, rr = answer(0.0, 0.1)  # turns left and should not
    assert rl > 0.0 > rr
    assert answer(0.0, -0.1) == pytest.approx((0.0, 0.0, rr, rl), abs=1.0)


def test_a_wheel_gets_no_more_than_its_motor_has_beside_the_torque_of_the_driver(known):
    weak = replace(known, split_axles=(known.split_axles[0]._replace(torque_Nm=500.0, power_W=30e3),))
    (_, _, rl, rr), reached = torques_of(weak, 1e5, speed_mps=10.0)
    assert rr == -rl == 500.0
    assert reached < 1e5
    pedal = DriverCommand(drive_torque_demand_Nm=400.0)
    (_, _, rl, rr), _ = torques_of(weak, 1e5, pedal, speed_mps=10.0)
    assert rr == pytest.approx(500.0 - 200.0)
    assert rl == pytest.approx(-500.0 - 200.0)
    # 30 kW at 25 m/s.
    (_, _, rl, rr), _ = torques_of(weak, 1e5)
    assert rr == pytest.approx(30e3 / (SPEED_MPS / 0.307)) == -rl


def test_a_wheel_that_slips_gets_no_more_in_that_direction(known):
    split = SplitTorques(known)
    spinning = measured(0.0, SPEED_MPS)._replace(wheel_speed_radps=(81.4, 81.4, 81.4, 1.1 * 81.4))
    (_, _, rl, rr), _ = split.for_moment(300.0, DriverCommand(), spinning, STRAIGHT)
    assert rr == 0.0
    assert rl < -50.0


def test_friction_limits_the_torque_by_the_load_that_the_turn_leaves(known):
    slippery = STRAIGHT._replace(friction=0.3)
    load_N = 0.5 * 1430.0 * GRAVITY_MPS2 * 1.0821 / (1.0821 + 1.5554)
    radius_m, use = known.estimation.rolling_radius_m[3], known.gains.tv.friction_fraction
    (_, _, rl, rr), _ = torques_of(known, 1e5, now=slippery)
    assert rr == pytest.approx(radius_m * 0.3 * use * load_N, rel=1e-6) == -rl
    ay = 0.2 * GRAVITY_MPS2
    (_, _, rl, rr), _ = torques_of(known, 1e5, now=slippery, ay_mps2=ay)
    remaining = 0.3 * (use**2 - (0.2 / 0.3) ** 2) ** 0.5
    two = known.estimation.two_track
    shift_N = 1430.0 * two.load_height_m * (1.0 - two.front_load_transfer_fraction) / two.rear_track_m * ay
    assert rr == pytest.approx(radius_m * remaining * (load_N + shift_N), rel=1e-6)
    assert rl == pytest.approx(-radius_m * remaining * (load_N - shift_N), rel=1e-6)


def test_the_battery_limits_the_torques(known):
    for driver_Nm, limit_W in ((150.0, 15e3), (0.0, 2e3)):
        weak = replace(known, battery_power_W=(60e3, limit_W))
        (_, _, rl, rr), _ = torques_of(weak, 1e5, DriverCommand(drive_torque_demand_Nm=driver_Nm))
        powers = [(0.5 * driver_Nm + torque) * SPEED_MPS / 0.307 for torque in (rl, rr)]
        used = sum(power / 0.92 if power > 0.0 else power * 0.92 for power in powers)
        assert rr > 10.0
        assert used <= limit_W * (1.0 + 1e-9)


def test_the_controller_rests_while_the_driver_brakes(known):
    torques, reached = torques_of(known, 1e5, DriverCommand(brake_pedal=0.3))
    assert torques is NO_TORQUES
    assert reached == 0.0


def test_a_wheel_at_its_limit_leaves_the_rest_to_the_other_one():
    narrow = Range(2, 2.5, (-100.0, -100.0), (600.0, 600.0), 1000.0)
    assert narrow.torques(150.0) == (-75.0, 75.0)
    assert narrow.torques(500.0) == (-100.0, 400.0)
    assert narrow.torques(-500.0) == (400.0, -100.0)
    assert narrow.largest_Nm(1.0) == 700.0


def test_a_car_that_cannot_split_its_torque_is_refused():
    for car in ("compact", "tesla_model_s"):
        with raises(ControllerError, key="motors"):
            load_controller("tv", resolve("straight_line", car).controller_setup(0.005))


def test_a_spinning_car_gets_torques_where_the_steering_has_given_all(known):
    pytest.importorskip("daqp")
    seen = measured(0.5, SPEED_MPS)._replace(
        rear_steer_rad=0.0524, superposition_rad=-0.0524, wheel_speed_radps=(SPEED_MPS / 0.307,) * 4
    )
    answer = load_controller("integrated", known).step(steering(0.0), seen)
    _, _, rl, rr = answer.wheel_torque_demand_Nm
    # Of the left wheel the turn leaves no load.
    assert rl >= 0.0 > -50.0 > rr
    small = load_controller("integrated", known).step(steering(0.002), measured(0.01, SPEED_MPS))
    assert max(map(abs, small.wheel_torque_demand_Nm)) < 20.0


STEP = {"settle_s": 0.5, "steer.steering_wheel_deg": 36.5}


def test_vectoring_makes_the_step_of_the_electric_car_faster_and_reports_its_energy():
    without, vectored = (simulate("step_steer", name, CAR, STEP).metrics for name in ("none", "tv"))
    assert vectored["yaw_rate_response_time_s"] < without["yaw_rate_response_time_s"] - 0.01
    assert vectored["yaw_rate_overshoot"] < without["yaw_rate_overshoot"] - 0.01
    for energies in (without, vectored):
        assert 20e3 < energies["battery_energy_J"] < 100e3
        assert 0.0 <= energies["steering_energy_J"] < 10.0

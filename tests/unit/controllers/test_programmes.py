"""The quadratic programme of `integrated` and the turn of `lqr`, against their forces."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from activesteer.controllers import load_controller
from activesteer.controllers.axle_slopes import LEAST, AxleSlopes, excess
from activesteer.controllers.esc import wheel_torques
from activesteer.controllers.integrated import Integrated
from activesteer.controllers.lqr import SPEEDS_MPS, Lqr, _gain, _place, schedule, steady_turn
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.core.signals import Estimate
from activesteer.scenario import resolve
from activesteer.theory.single_track import SingleTrack
from tests.unit.controllers.cars import held, measured, steering

pytest.importorskip("daqp")
INTERVAL_S, SPEED_MPS = 0.01, 25.0


@pytest.fixture(scope="module")
def known():
    return resolve("straight_line").controller_setup(INTERVAL_S)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rear_wheels_turn_out_of_the_turn_by_what_a_heavily_loaded_axle_needs_more(known, side):
    controller, driver = load_controller("lqr", known), steering(0.09 * side)
    answer = held(controller, driver, measured(0.25 * side, SPEED_MPS), 300)
    straight = steady_turn(known.single_track, SPEED_MPS)[1, 0] * answer.yaw_rate_desired_radps
    more = answer.prediction_rad - straight
    # Load transfer: in a turn at most of the friction an axle needs a larger slip angle than its stiffness says.
    assert answer.estimate is not None
    friction, ay_mps2 = answer.estimate.friction, SPEED_MPS * answer.yaw_rate_desired_radps
    assert side * ay_mps2 > 0.7 * friction * GRAVITY_MPS2
    assert more * side > math.radians(0.05)
    assert more == pytest.approx(excess(AxleSlopes(known), ay_mps2, friction)[1], rel=0.1)


@pytest.mark.parametrize(
    ("moment_Nm", "yaw_rate_radps", "torques_Nm"),
    [
        (-1000.0, 0.3, (0.0, 400.0, 0.0, 0.0)), (1000.0, 0.3, (0.0, 0.0, 300.0, 0.0)),
        (1000.0, -0.3, (400.0, 0.0, 0.0, 0.0)), (-1000.0, -0.3, (0.0, 0.0, 0.0, 300.0)),
    ],
)  # fmt: skip
def test_one_wheel_makes_the_moment_and_the_others_roll(moment_Nm, yaw_rate_radps, torques_Nm):
    assert wheel_torques(moment_Nm, yaw_rate_radps, (0.4, 0.3), 2000.0) == torques_Nm


@pytest.mark.parametrize(("works", "stuck"), [((False, True), 0), ((True, False), 1)])
def test_turn_with_a_stuck_axle_is_asked_with_the_angle_at_which_it_is_stuck(known, works, stuck):
    seen = measured(0.1, SPEED_MPS)._replace(superposition_rad=0.01, rear_steer_rad=0.02)
    assert Lqr(known).turn(steering(0.03), seen, works).steady_rad[stuck] == pytest.approx((0.01, 0.02)[stuck])


def test_brakes_of_a_car_that_spins_to_the_left_are_those_of_one_that_spins_to_the_right_mirrored(known):
    answers = []
    for side in (1.0, -1.0):
        seen = measured(0.6 * side, SPEED_MPS)._replace(
            rear_steer_rad=side * math.radians(3.0), superposition_rad=-side * math.radians(3.0)
        )
        answers.append(load_controller("integrated", known).step(steering(0.0), seen).brake_torque_demand_Nm)
    fl, fr, rl, rr = answers[0]
    assert answers[1] == pytest.approx((fr, fl, rr, rl), abs=0.1)


def test_gains_of_the_regulator_are_those_of_the_schedule_and_between_its_speeds_their_mean(known):
    regulator, p = Lqr(known), known.gains
    rows = schedule(known.single_track, p.lqr, p.servos.lag_s, INTERVAL_S)

    def gains(speed_mps):
        return [_gain(regulator._schedule, *_place(speed_mps), column) for column in range(len(rows[0]))]

    assert gains(SPEEDS_MPS[3]) == pytest.approx(rows[3])
    assert gains(0.5 * (SPEEDS_MPS[3] + SPEEDS_MPS[4])) == pytest.approx(0.5 * (np.array(rows[3]) + rows[4]))
    assert gains(2.0 * SPEEDS_MPS[-1]) == pytest.approx(rows[-1], rel=1e-5)


def test_axle_that_carries_all_of_the_load_transfer_feels_twice_the_height(known):
    def excesses(height_m, front_fraction):
        two_track = replace(
            known.estimation.two_track, load_height_m=height_m, front_load_transfer_fraction=front_fraction
        )
        slopes = AxleSlopes(replace(known, estimation=replace(known.estimation, two_track=two_track)))
        return excess(slopes, 6.0, 0.9)

    front, rear = excesses(0.6, 1.0)
    assert front == pytest.approx(excesses(1.2, 0.5)[0])
    assert rear == pytest.approx(excesses(0.0, 0.5)[1])
    assert excesses(0.6, 0.0)[1] > rear


def test_sides_may_not_differ_once_an_actuator_is_known_to_be_stuck(known):
    controller = load_controller("integrated", known)
    stuck = measured(0.0, SPEED_MPS)._replace(rear_steer_rad=math.radians(0.6))
    assert controller.step(steering(0.0), stuck).side_difference_Pa > 0.0
    assert held(controller, steering(0.0), stuck, 60).side_difference_Pa == 0.0


def effects(known, driver_rad: float = 0.0, **motion: float):
    """Yaw moment per brake force of each wheel [m]."""
    controller, now = Integrated(known), Estimate(SPEED_MPS, 0.0, 0.0, 0.0, 0.9, *[0.0] * 5)._replace(**motion)

    class Known:
        innovation = rate_innovation = 0.0

        def step(self, _measurement):
            return now

    controller._lqr._estimator = Known()  # pyright: ignore[reportAttributeAccessIssue]
    controller.step(steering(driver_rad), measured(now.yaw_rate_radps, SPEED_MPS))
    return controller._effects / controller._per_moment / 1000.0


def test_brakes_turn_the_car_by_half_the_track_while_the_tyres_bear_no_side_force(known):
    more = known.estimation.two_track
    halves_m = 0.5 * np.array([more.front_track_m] * 2 + [more.rear_track_m] * 2)
    assert effects(known) == pytest.approx(halves_m * (1, -1, 1, -1), abs=0.01)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_brake_of_a_sliding_axle_costs_its_side_force(known, side):
    car, free = known.single_track, effects(known)
    # Both axles slide: in a left turn the side forces point to the left.
    sliding = effects(known, yaw_rate_radps=0.6 * side, sideslip_rad=-0.3 * side)
    loss = known.gains.integrated.brake_side_loss * (1.0 - LEAST) * side
    shifts_m = np.array([-car.cg_to_front_m * loss] * 2 + [car.cg_to_rear_m * loss] * 2)
    assert sliding - free == pytest.approx(shifts_m, abs=0.01)
    # Against the turn the outer front wheel works, with the turn the inner rear wheel.
    assert int(np.argmin(side * sliding)) == (1 if side > 0.0 else 0)
    assert int(np.argmax(side * sliding)) == (2 if side > 0.0 else 3)


def test_car_that_does_what_is_asked_keeps_the_angles_of_its_turn(known):
    car, driver_rad = known.single_track, 0.004
    yaw_rate_radps = driver_rad * SingleTrack(car).yaw_rate_gain(SPEED_MPS)
    front_rad, rear_rad = steady_turn(car, SPEED_MPS)[:2, 0] * yaw_rate_radps
    added_rad = front_rad - driver_rad
    assert abs(added_rad) > math.radians(0.02)
    assert rear_rad > math.radians(0.02)

    class Turning:
        innovation = 0.0

        def step(self, _measurement):
            return Estimate(SPEED_MPS, 0.0, 0.0, yaw_rate_radps, 0.9, *[0.0] * 5)

    regulator, turn = Lqr(known), None
    regulator._estimator = Turning()  # pyright: ignore[reportAttributeAccessIssue]
    seen = measured(yaw_rate_radps, SPEED_MPS)._replace(superposition_rad=added_rad, rear_steer_rad=rear_rad)
    for _ in range(400):  # until the desired yaw rate has settled
        regulator._front_rad, regulator._rear_rad = front_rad, rear_rad
        regulator.apply(added_rad, rear_rad)
        turn = regulator.turn(steering(driver_rad), seen)
    assert turn is not None
    assert turn.desired_radps == pytest.approx(yaw_rate_radps, rel=1e-3)
    assert turn.steady_rad == pytest.approx((added_rad, rear_rad), abs=math.radians(0.01))
    assert turn.demand_rad == pytest.approx((added_rad, rear_rad), abs=math.radians(0.01))

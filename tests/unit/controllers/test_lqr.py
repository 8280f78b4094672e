"""Both axles by one state feedback: its model, its gains, its signs and limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from activesteer.controllers import ControllerParameters, load_controller
from activesteer.controllers.allocation import Allocation, allocated, moment_change
from activesteer.controllers.lqr import BOTH, SPEEDS_MPS, STATES, Lqr, feedback, model, schedule, steady_turn
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.core.signals import Estimate
from activesteer.scenario import resolve
from activesteer.theory.single_track import SingleTrack
from tests.unit.controllers.cars import CAR, held, measured, steering

INTERVAL_S = 0.005
PARAMETERS, LAG_S = ControllerParameters().lqr, ControllerParameters().servos.lag_s


@pytest.fixture(scope="module")
def known():
    return resolve("straight_line").controller_setup(INTERVAL_S)


def first(known, command, measurement):
    return load_controller("lqr", known).step(command, measurement)


@pytest.mark.parametrize("speed_mps", [15.0, 40.0])
def test_desired_turn_repeats_itself_in_the_model(speed_mps):
    desired_radps = 0.1
    row = schedule(CAR, PARAMETERS, LAG_S, INTERVAL_S)[SPEEDS_MPS.index(speed_mps)]
    front, rear, sideslip = (gain * desired_radps for gain in (row[0], row[2], row[4]))
    a, b = model(CAR, PARAMETERS, LAG_S, speed_mps, INTERVAL_S)
    state = np.array([desired_radps, sideslip, *[front, rear] * 3])
    assert a @ state + b @ (front, rear) == pytest.approx(state, abs=1e-12)


@pytest.mark.parametrize("works", [(True, False), (False, True)])
def test_turn_with_one_axle_given_repeats_itself_too_with_the_sideslip_that_belongs_to_it(works):
    desired_radps, given_rad = 0.1, 0.02
    front, rear, sideslip = steady_turn(CAR, 20.0, works) @ (desired_radps, given_rad)
    assert (rear if works[0] else front) == given_rad
    assert sideslip != 0.0
    a, b = model(CAR, PARAMETERS, LAG_S, 20.0, INTERVAL_S)
    state = np.array([desired_radps, sideslip, *[front, rear] * 3])
    assert a @ state + b @ (front, rear) == pytest.approx(state, abs=1e-12)


def test_what_does_not_work_is_not_asked():
    for axle, works in enumerate([(False, True), (True, False)]):
        gain = feedback(CAR, PARAMETERS, LAG_S, 20.0, INTERVAL_S, works)
        assert not gain[axle].any()
        a, b = model(CAR, PARAMETERS, LAG_S, 20.0, INTERVAL_S)
        assert np.abs(np.linalg.eigvals(a - b @ gain)).max() < 1.0


def test_model_without_lags_is_the_single_track_model():
    speed_mps = 25.0
    quick = replace(PARAMETERS, relaxation_length_m=0.01)
    a, b = model(CAR, quick, 0.001, speed_mps, INTERVAL_S)
    state, angles = np.zeros(len(STATES)), np.array([0.01, 0.004])
    for _ in range(2000):
        state = a @ state + b @ angles
    system, inputs = SingleTrack(CAR).matrices(speed_mps)
    assert state[:2] == pytest.approx(np.linalg.solve(system, -inputs @ angles), rel=1e-6)


def test_feedback_makes_the_model_settle_faster_at_every_speed():
    for speed_mps in SPEEDS_MPS:
        a, b = model(CAR, PARAMETERS, LAG_S, speed_mps, INTERVAL_S)
        gain = feedback(CAR, PARAMETERS, LAG_S, speed_mps, INTERVAL_S)
        assert np.abs(np.linalg.eigvals(a - b @ gain)).max() < np.abs(np.linalg.eigvals(a)).max()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_car_that_turns_by_itself_gets_rear_wheels_with_the_turn_and_front_wheels_against_it(known, side):
    answer = first(known, steering(0.0), measured(0.03 * side))
    assert answer.rear_steer_demand_rad * side > 0.0
    assert answer.superposition_demand_rad * side < 0.0


def test_answers_are_mirrored(known):
    left, right = (first(known, steering(side * 0.01), measured(side * 0.02)) for side in (1.0, -1.0))
    assert left.rear_steer_demand_rad == pytest.approx(-right.rear_steer_demand_rad, rel=1e-9)
    assert left.superposition_demand_rad == pytest.approx(-right.superposition_demand_rad, rel=1e-9)


def test_angles_end_at_their_limits_and_say_so(known):
    near = {"rear_steer_rad": math.radians(2.0), "superposition_rad": -math.radians(2.0)}
    answer = first(known, steering(0.0), measured(1.0)._replace(**near))
    limit = known.gains.servos.rear_limit_rad
    assert answer.rear_steer_demand_rad == limit == math.radians(3.0)
    assert answer.superposition_demand_rad == -known.gains.servos.superposition_limit_rad
    assert answer.saturated


def test_desired_yaw_rate_is_the_cars_own_up_to_what_the_friction_gives(known):
    speed_mps, gain = 25.0, SingleTrack(known.single_track).yaw_rate_gain(25.0)
    small = held(load_controller("lqr", known), steering(0.01), measured(0.01 * gain, speed_mps))
    # The speed is the estimated one.
    assert small.yaw_rate_desired_radps == pytest.approx(0.01 * gain, rel=1e-3)
    large = held(load_controller("lqr", known), steering(0.2), measured(0.2, speed_mps), 300)
    # Three standard deviations of the assumed friction are added to it.
    most = known.gains.lqr.friction_fraction * (1.0 + 3.0 * 0.25) * GRAVITY_MPS2 / speed_mps
    assert 0.3 * most < large.yaw_rate_desired_radps < 1.2 * most


def test_rear_wheels_never_turn_out_of_phase_for_a_steady_turn():
    """Below the speed at which the own sideslip changes sign, sqrt(l_r C_r l / (m l_f)), they stay straight."""
    car = CAR
    wheelbase_m = car.cg_to_front_m + car.cg_to_rear_m
    changes_mps = math.sqrt(
        car.cg_to_rear_m * car.rear_stiffness_Nprad * wheelbase_m / (car.mass_kg * car.cg_to_front_m)
    )
    _, rear, sideslip = steady_turn(car, 0.7 * changes_mps, in_phase=True)[:, 0]
    assert rear == pytest.approx(0.0, abs=1e-12)
    assert sideslip > 0.0
    fast = steady_turn(car, 1.3 * changes_mps, in_phase=True)
    assert fast[1, 0] > 0.0
    assert fast[:, 0] == pytest.approx(steady_turn(car, 1.3 * changes_mps)[:, 0])


def test_at_rest_nothing_is_steered(known):
    answer = first(known, steering(0.3), measured(0.0, 0.0))
    assert answer.rear_steer_demand_rad == answer.superposition_demand_rad == 0.0


@pytest.mark.parametrize("angle", ["superposition_rad", "rear_steer_rad"])
def test_tyres_of_the_regulator_follow_an_angle_by_63_percent_over_one_relaxation_length(known, angle):
    speed_mps, regulator = 20.0, Lqr(known)
    straight = Estimate(speed_mps, 0.0, 0.0, 0.0, 0.9, *[0.0] * 5)

    class Straight:
        innovation = 0.0

        def step(self, _measurement):
            return straight

    regulator._estimator = Straight()  # pyright: ignore[reportAttributeAccessIssue]
    turned = measured(0.0, speed_mps)._replace(**{angle: 0.01})
    calls = round(known.gains.lqr.relaxation_length_m / (speed_mps * INTERVAL_S))
    demands = [regulator.turn(steering(0.0), turned).demand_rad[0] for _ in range(50 * calls)]
    left_first, left_later = demands[0] - demands[-1], demands[calls] - demands[-1]
    assert left_later / left_first == pytest.approx(math.exp(-1.0), rel=1e-6)


def test_moment_of_the_drivers_brakes_is_held_by_both_axles_without_side_force(known):
    car, two_track, estimation = known.single_track, known.estimation.two_track, known.estimation
    rolling = measured(0.0, 25.0)
    left_Pa, braking = (20e5, 5e5, 0.0, 0.0), steering(0.0)._replace(brake_pedal=1.0)

    def steady(command, pressures_Pa, own_Nm=(0.0, 0.0, 0.0, 0.0)):
        seen = rolling._replace(brake_pressure_Pa=pressures_Pa)
        return Lqr(known).turn(command, seen, own_brakes_Nm=own_Nm).steady_rad

    front, rear = steady(braking, left_Pa)
    per_Pa_N = estimation.brake_torque_per_pressure_NmpPa[0] / estimation.rolling_radius_m[0]
    moment_Nm = 0.5 * two_track.front_track_m * per_Pa_N * 15e5
    front_N, rear_N = car.front_stiffness_Nprad * front, car.rear_stiffness_Nprad * rear
    assert front_N + rear_N == pytest.approx(0.0, abs=1e-9)
    assert car.cg_to_front_m * front_N - car.cg_to_rear_m * rear_N == pytest.approx(-moment_Nm)
    assert steady(braking, (5e5, 20e5, 0.0, 0.0)) == pytest.approx((-front, -rear))
    # Not what it asks for itself, to turn the car.
    own_Nm = (estimation.brake_torque_per_pressure_NmpPa[0] * 15e5, 0.0, 0.0, 0.0)
    assert steady(braking, left_Pa, own_Nm) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert steady(steering(0.0), left_Pa) == (0.0, 0.0)


def against(known, driver_rad: float, calls: int, controller=None):
    """Superposition of a regulator that takes a road for slippery, for a constant driver's angle."""
    controller = Lqr(known) if controller is None else controller
    turns_radps = math.copysign(0.05, driver_rad)
    slippery = Estimate(25.0, 0.0, 0.0, turns_radps, 0.2, *[0.01] * 5)

    class Slippery:
        innovation = 0.0

        def step(self, _measurement):
            return slippery

    controller._estimator = Slippery()  # pyright: ignore[reportAttributeAccessIssue]
    added_rad, found = 0.0, []
    for _ in range(calls):
        seen = measured(turns_radps)._replace(superposition_rad=added_rad)
        added_rad = controller.step(steering(driver_rad), seen).superposition_demand_rad
        found.append(added_rad)
    return controller, found


def test_superposition_is_not_held_against_a_driver_who_does_not_steer_back(known):
    p = known.gains.lqr
    controller, found = against(known, 0.2, round(3.0 / INTERVAL_S))
    begun = next(call for call, angle in enumerate(found) if angle < -math.radians(0.5))
    held_calls, decayed = round(p.hold_s / INTERVAL_S), round((p.hold_s + p.decay_s) / INTERVAL_S)
    assert found[begun + held_calls // 2] < -math.radians(0.9)
    assert max(found[begun + decayed + 20 :]) >= 0.0
    assert min(found[begun + decayed + 20 :]) > -math.radians(0.05)
    # To the other side it may act anew.
    _, other = against(known, -0.2, round(0.5 / INTERVAL_S), controller)
    assert other[-1] > math.radians(0.9)


def test_superposition_into_a_turn_fades_only_if_the_desired_turn_stays_at_the_known_limit(known):
    """Else `lqr` steers a car with worn rear tyres over their limit; a lane change is over before."""
    p, most = known.gains.lqr, known.gains.servos.superposition_limit_rad
    at_limit_rad = 0.2

    def into_the_turn_rad(controller, driver_rad, time_s, friction_std=0.001):
        class Known:
            innovation = 0.0

            def step(self, _measurement):
                # The car turns as desired, which limits no superposition.
                now = Estimate(25.0, 0.0, 0.0, desired_radps, 0.3, *[0.001] * 5)
                return now._replace(friction_std=friction_std)

        controller._estimator = Known()  # pyright: ignore[reportAttributeAccessIssue]
        desired_radps = math.copysign(0.106, driver_rad) if abs(driver_rad) == at_limit_rad else 0.0
        for _ in range(round(time_s / INTERVAL_S)):
            found = controller.turn(steering(driver_rad), measured(0.0))
            desired_radps = found.desired_radps
        return max(math.copysign(1.0, driver_rad) * angle for angle in found.range_rad)

    soon, late = 0.9 * p.hold_s, 1.1 * (p.hold_s + p.decay_s)
    controller = Lqr(known)
    assert into_the_turn_rad(controller, at_limit_rad, soon) == pytest.approx(most, rel=0.01)
    assert into_the_turn_rad(controller, at_limit_rad, late) == pytest.approx(0.0, abs=0.01 * most)
    # A turn to the other side, a gentle turn, and a friction that nobody knows.
    assert into_the_turn_rad(controller, -at_limit_rad, soon) == pytest.approx(most, rel=0.01)
    assert into_the_turn_rad(Lqr(known), 0.1 * at_limit_rad, late) == pytest.approx(most, rel=0.01)
    unknown = known.gains.estimator.friction_std
    assert into_the_turn_rad(Lqr(known), at_limit_rad, late, unknown) == pytest.approx(most, rel=0.01)


@pytest.mark.parametrize("stiffness", [(0.7, 0.85), (0.85, 0.7), (1.2, 1.1)])
def test_while_the_friction_is_unknown_a_car_of_soft_front_tyres_keeps_its_own_turn(known, stiffness):
    """Else it is steered to the turn of new tyres on what may be snow."""
    car, speed_mps, driver_rad = known.single_track, 25.0, 0.002
    soft = replace(
        car,
        front_stiffness_Nprad=min(stiffness[0], 1.0) * car.front_stiffness_Nprad,
        rear_stiffness_Nprad=min(stiffness[1], 1.0) * car.rear_stiffness_Nprad,
        characteristic_speed_mps=None,
    )

    def turn(friction_std):
        controller = Lqr(known)

        class Known:
            innovation = 0.0

            def step(self, _measurement):
                now = Estimate(speed_mps, 0.0, 0.0, 0.0, 0.9, *[0.001] * 5, *stiffness)
                return now._replace(friction_std=friction_std)

        controller._estimator = Known()  # pyright: ignore[reportAttributeAccessIssue]
        return [controller.turn(steering(driver_rad), measured(0.0)) for _ in range(400)][-1]

    of_new_tyres, unknown = turn(0.0001), turn(known.gains.estimator.friction_std)
    assert of_new_tyres.desired_radps == pytest.approx(SingleTrack(car).yaw_rate_gain(speed_mps) * driver_rad, rel=1e-3)
    if stiffness[0] < stiffness[1]:
        gain = SingleTrack(soft).yaw_rate_gain(speed_mps)
        assert gain < 0.95 * SingleTrack(car).yaw_rate_gain(speed_mps)
        assert unknown.desired_radps == pytest.approx(gain * driver_rad, rel=0.01)
        # Both axles turn by the same angle, so the car turns as it does by itself, and without sideslip.
        assert unknown.steady_rad[0] == pytest.approx(unknown.steady_rad[1], rel=0.05)
    else:
        assert unknown.desired_radps == pytest.approx(of_new_tyres.desired_radps, rel=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_superposition_does_not_turn_a_car_further_from_the_desired_yaw_rate(known, side):
    def turn(yaw_rate_radps, friction_std=0.001):
        controller, rate = Lqr(known), side * yaw_rate_radps

        class Known:
            innovation = 0.0

            def step(self, _measurement):
                return Estimate(25.0, 0.0, 0.0, rate, 0.3, *[0.001] * 5)._replace(friction_std=friction_std)

        controller._estimator = Known()  # pyright: ignore[reportAttributeAccessIssue]
        return [controller.turn(steering(0.2 * side), measured(rate)) for _ in range(40)][-1]

    def along_and_against_rad(found):
        return sorted((side * angle for angle in found.range_rad), reverse=True)

    band, most = known.gains.lqr.lacking_radps, known.gains.servos.superposition_limit_rad
    desired = abs(turn(1.0).desired_radps)
    assert along_and_against_rad(turn(desired)) == pytest.approx([most, -most], rel=0.01)
    assert along_and_against_rad(turn(desired - 0.5 * band)) == pytest.approx([most, -0.5 * most], rel=0.02)
    assert along_and_against_rad(turn(desired + 0.5 * band)) == pytest.approx([0.5 * most, -most], rel=0.02)
    assert along_and_against_rad(turn(desired - 1.1 * band)) == pytest.approx([most, 0.0], abs=1e-9)
    assert along_and_against_rad(turn(desired + 1.1 * band)) == pytest.approx([0.0, -most], abs=0.001)
    # Against the driver less is allowed while the friction is unknown.
    unknown = known.gains.estimator.friction_std
    along, against = along_and_against_rad(turn(abs(turn(1.0, unknown).desired_radps), unknown))
    assert along == pytest.approx(most)
    assert against == pytest.approx(-known.gains.lqr.against_driver_rad, rel=0.01)


def test_angles_follow_the_demand_within_limits_and_rates(known):
    allocation = Allocation(known)
    now = Estimate(25.0, 0.0, 0.0, 0.02, 0.9, *[0.0] * 5)
    demand = 0.005, -0.004
    found = allocated(allocation, now, 0.002, (0.0, 0.0), demand, (-0.05, 0.05), BOTH, 0.5, 1.0)
    assert found == pytest.approx(demand, rel=1e-3)


SLIDING = Estimate(16.0, 0.0, math.radians(2.0), math.radians(-16.0), 0.23, *[0.0] * 5)
"""A turn to the right on packed snow: the rear axle slides outwards, and the car turns in."""


def mirrored(now, side):
    return now._replace(sideslip_rad=side * now.sideslip_rad, yaw_rate_radps=side * now.yaw_rate_radps)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_front_wheels_steer_back_while_the_rear_axle_slides(known, side):
    """The feedback counts on the moment of straight axle curves; a sliding rear axle does not make it."""
    car, desired_mps2 = known.single_track, -2.1 * side
    now, driver, at = mirrored(SLIDING, side), math.radians(-3.0 * side), (0.0, math.radians(-1.4 * side))
    demand = math.radians(-1.5 * side), at[1]

    def added(ay_mps2, authority, estimate=now):
        return allocated(Allocation(known), estimate, driver, at, demand, (-0.06, 0.06), BOTH, ay_mps2, authority)

    front, rear = added(desired_mps2, 1.0)
    moment_Nm = moment_change(Allocation(known), now, driver, at, (front, rear))
    assert rear == pytest.approx(demand[1])
    assert side * front > math.radians(0.5)
    # At most all of the side force that the front axle has on this road.
    most_Nm = now.friction * 9.81 * car.mass_kg * car.cg_to_rear_m / car.wheelbase_m * car.cg_to_front_m
    assert 0.1 * most_Nm < side * moment_Nm < most_Nm
    # A feedback without authority, a car that turns too little, and a straight curve leave the demand.
    assert added(desired_mps2, 0.0)[0] == pytest.approx(demand[0])
    slow = now._replace(yaw_rate_radps=-0.05 * side, sideslip_rad=0.0)
    assert added(desired_mps2, 1.0, slow)[0] == pytest.approx(demand[0])
    grips = SLIDING._replace(friction=30.0)
    assert added(desired_mps2, 1.0, mirrored(grips, side))[0] == pytest.approx(demand[0], abs=1e-4)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_front_wheels_keep_the_moment_when_the_rear_wheels_are_too_slow(known, side):
    """Both axles to the same side make side force; without the rear ones the front ones would turn the car in."""
    slow = replace(known.gains.servos, rear_rate_radps=math.radians(4.0))
    car, demand = known.single_track, (0.02 * side, 0.02 * side)
    now = Estimate(25.0, 0.0, 0.0, 0.0, 0.9, *[0.0] * 5)
    allocation = Allocation(replace(known, gains=replace(known.gains, servos=slow)))
    # One axle takes over with the lag of the actuators.
    front, rear = [
        allocated(allocation, now, 0.0, (0.0, 0.0), demand, (-0.05, 0.05), BOTH, 0.0, 1.0)
        for _ in range(round(10.0 * slow.lag_s / INTERVAL_S))
    ][-1]
    moment_Nm = moment_change(allocation, now, 0.0, (0.0, 0.0), (front, rear))
    assert abs(rear) == pytest.approx(min(known.gains.lqr.ahead_s * slow.rear_rate_radps, abs(demand[1])))
    front_Nm = car.front_stiffness_Nprad * car.cg_to_front_m
    rear_Nm = -car.rear_stiffness_Nprad * car.cg_to_rear_m
    wanted_Nm, careless_Nm = front_Nm * demand[0] + rear_Nm * demand[1], front_Nm * demand[0] + rear_Nm * rear
    assert moment_Nm == pytest.approx(front_Nm * front + rear_Nm * rear, rel=0.01)
    assert abs(moment_Nm - wanted_Nm) < 0.2 * abs(careless_Nm - wanted_Nm)


def test_no_angle_is_larger_than_its_actuator_removes_while_the_car_answers(known):
    slow = replace(known.gains.servos, rear_rate_radps=math.radians(12.0))
    setup = replace(known, gains=replace(known.gains, servos=slow))
    seen = measured(1.0)._replace(rear_steer_rad=math.radians(1.4))
    most = known.gains.lqr.removal_s * slow.rear_rate_radps
    assert first(setup, steering(0.0), seen).rear_steer_demand_rad == pytest.approx(most)

"""Envelope control: its model, its envelope, its signs and limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.controllers import ControllerParameters, load_controller
from activesteer.controllers.axle_slopes import AxleSlopes
from activesteer.controllers.lqr import steady_turn
from activesteer.controllers.mpc import GIVEN, STATES, envelope_problem, model
from activesteer.controllers.quadratic_programme import solver
from activesteer.conventions import GRAVITY_MPS2
from activesteer.scenario import resolve
from tests.unit.controllers.cars import CAR, held, measured, steering

pytest.importorskip("daqp")
INTERVAL_S, SPEED_MPS = 0.01, 25.0
PARAMETERS, LAG_S = ControllerParameters().mpc, ControllerParameters().servos.lag_s


@pytest.fixture(scope="module")
def known():
    return resolve("straight_line").controller_setup(INTERVAL_S)


def state(**values: float):
    names = (*STATES, *GIVEN)
    return np.array([values.get(name, 0.0) for name in names])


def test_steady_turn_repeats_itself_in_the_model():
    desired_radps = 0.1
    front, rear, _ = steady_turn(CAR, SPEED_MPS)[:, 0] * desired_radps
    a, b = model(CAR, PARAMETERS, LAG_S, INTERVAL_S, SPEED_MPS, 1.0, 1.0)
    z = state(yaw_rate=desired_radps, front=front, rear=rear, superposition=front, rear_actuator=rear)
    assert a @ z + b @ (front, rear) == pytest.approx(z, abs=1e-12)


def test_axle_with_half_the_slope_and_an_intercept_for_the_rest_moves_the_car_as_the_whole_axle_does():
    slip_rad = 0.02
    moving = {"front": slip_rad, "superposition": slip_rad}
    a, b = model(CAR, PARAMETERS, LAG_S, INTERVAL_S, SPEED_MPS, 1.0, 1.0)
    whole = a @ state(**moving) + b @ (slip_rad, 0.0)
    a, b = model(CAR, PARAMETERS, LAG_S, INTERVAL_S, SPEED_MPS, 0.5, 1.0)
    half = a @ state(**moving, front_intercept=0.5 * slip_rad) + b @ (slip_rad, 0.0)
    # The car has hardly begun to turn, so that its slip angle is still the angle of the wheels.
    assert half[:2] == pytest.approx(whole[:2], rel=0.02)


def test_envelope_bounds_the_predicted_yaw_rate_and_costs_nothing_where_it_is_kept():
    problem = envelope_problem(CAR, PARAMETERS, LAG_S, INTERVAL_S, SPEED_MPS)
    # The driver asks for 0.3 rad/s; the road gives 0.2.
    front, rear, _ = steady_turn(CAR, SPEED_MPS)[:, 0] * 0.3
    z = state(driver=front, desired=0.3, rear_steady=rear)
    unknowns, rows = len(problem.hessian), len(problem.rows)
    bound = np.repeat([0.2, 0.2], rows // 4)
    offset = (problem.offsets @ z)[: rows // 2]
    angles = np.full(unknowns - 2, math.radians(10.0))
    free = np.full(rows // 2, np.inf)
    lower = np.concatenate([-angles, [0.0, 0.0], -free, -bound - offset])
    found = {}
    for name, most in (("bounded", bound), ("free", free)):
        upper = np.concatenate([angles, [np.inf, np.inf], most - offset, free])
        least = lower if name == "bounded" else np.concatenate([-angles, [0.0, 0.0], -free, -free])
        x = solver()(problem.hessian, problem.gradient @ z, problem.rows, least, upper)
        found[name] = (problem.rows[: rows // 2, :-2] @ x[:-2] + offset)[: rows // 4], x[-2:]
    assert found["free"][0].max() > 0.25
    assert found["bounded"][0].max() < 0.21
    assert found["free"][1] == pytest.approx((0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_car_that_turns_by_itself_gets_rear_wheels_with_the_turn_and_front_wheels_against_it(known, side):
    answer = load_controller("mpc", known).step(steering(0.0), measured(0.02 * side, SPEED_MPS))
    assert answer.rear_steer_demand_rad * side > 0.0 > answer.superposition_demand_rad * side


def test_angles_and_their_rates_end_at_their_limits(known):
    controller, servos = load_controller("mpc", known), known.gains.servos
    first = controller.step(steering(0.0), measured(0.5, SPEED_MPS))
    assert first.rear_steer_demand_rad == pytest.approx(INTERVAL_S * servos.rear_rate_radps)
    assert first.superposition_demand_rad == pytest.approx(-INTERVAL_S * servos.superposition_rate_radps)
    last = held(controller, steering(0.0), measured(0.5, SPEED_MPS), 30)
    assert last.rear_steer_demand_rad == pytest.approx(servos.rear_limit_rad)


def test_slip_angle_of_the_largest_force_shrinks_with_the_friction(known):
    slopes = AxleSlopes(known)
    dry, wet = slopes.peak_rad(1, 0.9), slopes.peak_rad(1, 0.3)
    assert math.radians(4.0) < dry < math.radians(20.0)
    assert wet == pytest.approx(dry / 3.0)


def test_leaving_the_envelope_is_told(known):
    controller = load_controller("mpc", known)
    assert not controller.step(steering(0.0), measured(0.0, SPEED_MPS)).saturated
    assert controller.step(steering(0.0), measured(1.5 * GRAVITY_MPS2 / SPEED_MPS, SPEED_MPS)).saturated

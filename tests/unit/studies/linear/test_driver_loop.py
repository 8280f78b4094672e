"""The linear loop of driver and car, with a plant whose loop is known by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.controllers import load_controller
from activesteer.controllers.linear_form import LinearController, linear_controller
from activesteer.core.signals import ActuatorCommand
from activesteer.driver.path_preview import PREVIEW_INTERVAL_S, SteeringGains
from activesteer.errors import ControllerError, DriverError
from activesteer.scenario import resolve
from activesteer.studies.linear.driver_loop import (
    DURATION_S,
    STEP_M,
    DriverLoop,
    LoopAtSpeed,
    driver_loop,
    driver_loops,
)
from activesteer.studies.linear.linearisation import INPUTS, OUTPUTS, LinearCar
from tests.raising import raises
from tests.unit.analysis.synthetic import SyntheticRun
from tests.unit.controllers.cars import measured, setup, steering
from tests.unit.driver.drives import parameters

SPEED_MPS, YAW_GAIN_1PS, RATIO = 20.0, 5.0, 16.0
BY_OFFSET_RADPM, BY_HEADING = 0.02 * RATIO, 0.5 * RATIO
NOTHING = LinearController(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), np.zeros((2, 2)))
STEP_S = 1e-3


def ideal_car() -> LinearCar:
    """Return a car that yaws at once without sideslip; path offset is the double integral of steer angle."""
    b = np.zeros((1, len(INPUTS)))
    b[0, 0] = YAW_GAIN_1PS / RATIO
    c = np.zeros((len(OUTPUTS), 1))
    c[OUTPUTS.index("yaw_rate_radps"), 0] = 1.0
    d = np.zeros((len(OUTPUTS), len(INPUTS)))
    return LinearCar(SPEED_MPS, STEP_S, 0.0, ("d_yaw",), np.zeros((1, 1)), b, c, d, np.zeros((2, 1)))


def loop(delay_s: float = 0.0, lag_s: float = 0.0) -> DriverLoop:
    """Return a driver without model of car, arms and delay, who sees the path at the car and a second ahead."""
    far = BY_HEADING / SPEED_MPS
    path = np.zeros(101)
    path[0], path[100] = BY_OFFSET_RADPM - far, far
    waiting = np.zeros(round(delay_s / PREVIEW_INTERVAL_S))
    who = parameters(reaction_delay_s=delay_s, neuromuscular_lag_s=lag_s)
    return driver_loop(ideal_car(), NOTHING, who, SteeringGains(0.0, 0.0, 0.0, waiting, path), RATIO)


def by_hand() -> tuple[float, float, float, float]:
    """Return crossover and margin of L = (k2 s + k1 v) g / s^2; damping and frequency of s^2 + k2 g s + k1 g v."""
    by_offset, by_heading = 0.02 * YAW_GAIN_1PS * SPEED_MPS, 0.5 * YAW_GAIN_1PS
    squared = (by_heading**2 + math.sqrt(by_heading**4 + 4.0 * by_offset**2)) / 2.0
    crossover = math.sqrt(squared)
    natural = math.sqrt(by_offset)
    return crossover, math.atan2(by_heading * crossover, by_offset), by_heading / (2.0 * natural), natural


def test_loop_of_an_ideal_car_is_the_one_worked_out_by_hand():
    crossover, margin, damping, natural = by_hand()
    found_crossover, found_margin = loop().crossover()
    assert found_crossover == pytest.approx(crossover, rel=0.01)
    # A decision is held for 10 ms, and the car yaws a step later: 5.5 ms of delay on the way.
    assert found_margin == pytest.approx(margin - 0.0055 * crossover, abs=0.005)
    assert loop().damping() == pytest.approx((damping, natural), rel=0.02)


@pytest.mark.parametrize("delay_s", [0.05, 0.2])
def test_reaction_delay_costs_its_share_of_the_phase_margin(delay_s):
    crossover, margin = loop().crossover()
    delayed_crossover, delayed_margin = loop(delay_s).crossover()
    assert delayed_crossover == pytest.approx(crossover, rel=1e-9)
    assert delayed_margin == pytest.approx(margin - delay_s * crossover, abs=1e-4)  # read between two frequencies


def test_lag_of_the_arms_turns_the_phase_as_a_first_order_lag_does():
    lagging = loop(lag_s=0.1)
    crossover, margin = lagging.crossover()
    by_offset, by_heading = 0.02 * YAW_GAIN_1PS * SPEED_MPS, 0.5 * YAW_GAIN_1PS
    assert math.hypot(by_heading * crossover, by_offset) / crossover**2 / math.hypot(1.0, 0.1 * crossover) == (
        pytest.approx(1.0, rel=0.01)
    )
    hand = math.atan2(by_heading * crossover, by_offset) - math.atan(0.1 * crossover) - 0.0055 * crossover
    assert margin == pytest.approx(hand, abs=0.01)


def test_loop_at_the_limit_of_stability_has_no_margin_and_no_damping():
    crossover, margin = loop().crossover()
    lost = loop(round(margin / crossover, 2))
    assert abs(lost.crossover()[1]) < 0.005 * crossover
    assert abs(lost.damping()[0]) < 0.01


@pytest.mark.parametrize(
    ("controller", "output"), [("ars", "rear_steer_demand_rad"), ("afs", "superposition_demand_rad")]
)
def test_controllers_do_beyond_their_band_what_their_linear_form_says(controller, output):
    scenario = resolve("straight_line")
    known = scenario.controller_setup(STEP_S)
    form = linear_controller(controller, known, 25.0)
    made = load_controller(controller, known)
    # Small against the limits of the controller, large against its band.
    front_rad, yaw_rate_radps, state = 0.02, 0.02, np.zeros(4)
    command, demand = ActuatorCommand(), np.zeros(2)
    for _ in range(300):
        demand = form.c @ state + form.d @ (front_rad, yaw_rate_radps)
        command = made.step(steering(front_rad), measured(yaw_rate_radps, 25.0))
        state = form.a @ state + form.b @ (front_rad, yaw_rate_radps)
    assert getattr(command, output) == pytest.approx(demand[0 if controller == "ars" else 1], rel=1e-9)
    assert abs(demand).max() > 1e-3


def test_damping_and_remaining_distance_belong_to_the_curve_of_the_run():
    time_s = np.arange(0.0, DURATION_S, 0.01)
    swing = np.cos(2.0 * time_s) + 0.4 * np.sin(2.0 * time_s)
    for y_m, damping, rest_m in (
        (0.4 * (1.0 - np.exp(-2.0 * time_s)), 1.0, 0.1),  # stops short of the path
        (STEP_M * (1.0 - np.exp(-0.8 * time_s) * swing), 0.8 / math.hypot(0.8, 2.0), 0.0),
    ):
        row = LoopAtSpeed(72.0, "none", loop(), SyntheticRun(time_s, {"y_m": y_m})).to_json()
        assert row["damping_in_run"] == pytest.approx(damping, abs=1e-3)
        assert row["rest_in_run_m"] == pytest.approx(rest_m, abs=3e-3)


def test_what_has_no_linear_form_is_answered():
    class Mine:
        def step(self, *_):
            raise AssertionError

    with raises(ControllerError, value="mine.py:Mine"):
        linear_controller("mine.py:Mine", setup(), 20.0)
    with raises(DriverError, value=Mine):
        driver_loops(Mine)

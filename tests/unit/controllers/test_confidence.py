"""Confidence: authority over the driver, and the hand-over to the driver."""

from __future__ import annotations

import math

import pytest

from activesteer.controllers.confidence import ConfidenceMonitor, bounded
from activesteer.scenario import resolve
from activesteer.signals import Estimate

LIMIT_RAD, AGAINST_RAD = math.radians(3.0), math.radians(1.0)


class Watched:
    """An estimator with a constant innovation."""

    innovation = 0.0


@pytest.fixture
def watched():
    estimator = Watched()
    setup = resolve("straight_line").controller_setup(0.005)
    return estimator, ConfidenceMonitor(setup, estimator)  # pyright: ignore[reportArgumentType]


def moving(friction_std: float) -> Estimate:
    return Estimate(25.0, 0.0, 0.0, 0.0, 0.9, 0.0, 0.0, 0.0, 0.0, friction_std)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_against_the_driver_less_is_allowed_than_with_him(side: float):
    driver = side * 0.1
    assert bounded(-side * 0.05, driver, AGAINST_RAD, LIMIT_RAD) == -side * AGAINST_RAD
    assert bounded(side * 0.1, driver, AGAINST_RAD, LIMIT_RAD) == side * LIMIT_RAD
    assert bounded(-side * 0.01, driver, AGAINST_RAD, LIMIT_RAD) == -side * 0.01
    assert bounded(-side * 0.1, 0.0, AGAINST_RAD, LIMIT_RAD) == -side * LIMIT_RAD


def test_friction_is_certain_as_far_as_its_variance_has_fallen(watched):
    _, monitor = watched
    assert monitor.step(moving(0.25)).friction == pytest.approx(0.0)
    assert monitor.step(moving(0.125)).friction == pytest.approx(0.75)
    assert monitor.step(moving(0.5)).friction == 0.0


def test_a_model_that_does_not_explain_the_car_hands_over_to_the_driver_and_comes_back_slowly(watched):
    estimator, monitor = watched
    estimator.innovation = 4.7  # the largest mean of ordinary runs
    assert {monitor.step(moving(0.1)).authority for _ in range(400)} == {1.0}
    estimator.innovation = 100.0
    fading = [monitor.step(moving(0.1)).authority for _ in range(200)]
    assert fading[-1] == 0.0
    assert fading[20] > 0.5  # not in one step
    estimator.innovation = 1.0
    back = [monitor.step(moving(0.1)).authority for _ in range(800)]
    assert back[100] < 0.5
    assert back[-1] == 1.0

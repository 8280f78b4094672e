"""Confidence: authority over the driver, and the hand-over to the driver."""

from __future__ import annotations

import math

import pytest

from activesteer.controllers.allocation import angle_range
from activesteer.controllers.turn_reference import ConfidenceMonitor, confidence
from activesteer.scenario import resolve

LIMIT_RAD = math.radians(3.0)


@pytest.fixture
def monitor():
    return ConfidenceMonitor(resolve("straight_line").controller_setup(0.005))


def test_angles_are_limited_by_what_the_actuator_reaches_and_a_failed_one_stays():
    both = -LIMIT_RAD, LIMIT_RAD
    assert angle_range(0.01, both, 0.02, True) == pytest.approx((-0.01, 0.03))
    assert angle_range(0.04, both, 0.02, True) == pytest.approx((0.02, LIMIT_RAD))
    assert angle_range(0.07, both, 0.02, False) == (0.07, 0.07)
    # An angle beyond a limit that has shrunk comes back within its rate at once.
    assert angle_range(-0.03, (0.0, LIMIT_RAD), 0.02, True) == pytest.approx((0.0, 0.0))


def test_friction_is_certain_as_far_as_its_variance_has_fallen(monitor):
    assert confidence(monitor, 0.0, 0.25)[0] == pytest.approx(0.0)
    assert confidence(monitor, 0.0, 0.125)[0] == pytest.approx(0.75)
    assert confidence(monitor, 0.0, 0.5)[0] == 0.0


def test_a_model_that_does_not_explain_the_car_hands_over_to_the_driver_and_comes_back_slowly(monitor):
    def authorities(innovation: float, calls: int) -> list[float]:
        return [confidence(monitor, innovation, 0.1)[1] for _ in range(calls)]

    assert set(authorities(4.7, 400)) == {1.0}  # the largest mean of ordinary runs
    fading = authorities(100.0, 200)
    assert fading[-1] == 0.0
    assert fading[20] > 0.5  # not in one step
    back = authorities(1.0, 800)
    assert back[100] < 0.5
    assert back[-1] == 1.0

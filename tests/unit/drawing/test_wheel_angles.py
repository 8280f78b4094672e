from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.core.signals import Channel
from activesteer.drawing.wheel_angles import (
    CHANNELS,
    RADIUS_M,
    factors,
    plan,
    tips_beside,
    wedges,
    wheel_centres,
    words,
)  # fmt: skip
from activesteer.recording import Recording
from activesteer.road.course import Footprint

SIZE = Footprint(1.8, 2.6, (0.2, 0.2))


def steered(front_deg: float, rear_deg: float) -> Recording:
    values = np.radians([[0.0] * 4, [front_deg, -front_deg, rear_deg, 0.0]])
    return Recording([Channel(name, "rad", "", "corners") for name in CHANNELS], [0.0, 1.0], values)


def test_a_wedge_is_as_wide_as_ten_times_the_angle_and_opens_to_its_side():
    for angle_deg in (1.7, -1.7, 0.0):
        shape = wedges(np.radians([angle_deg]), (10,))[0]
        tip, ahead, turned = shape[0], shape[1], shape[-1]
        assert tip == pytest.approx([0.0, 0.0])
        assert ahead == pytest.approx([RADIUS_M, 0.0])  # straight ahead, x forward
        assert math.degrees(math.atan2(turned[1], turned[0])) == pytest.approx(10.0 * angle_deg)  # left is positive
        assert np.hypot(*shape[1:].T) == pytest.approx(RADIUS_M)


def test_angles_are_drawn_ten_times_larger_unless_a_wedge_would_be_wider_than_a_right_angle():
    assert factors([steered(4.0, 3.0)]) == (10, 10, 10, 10)
    assert factors([steered(9.1, 3.0)]) == (5, 5, 10, 10)
    assert factors([steered(35.0, 1.0)]) == (2, 2, 10, 10)
    assert factors([steered(80.0, 1.0)]) == (1, 1, 10, 10)
    assert factors([steered(4.0, 1.0), steered(15.0, 1.0)]) == (5, 5, 10, 10)  # the same for all that are compared
    assert factors([steered(math.nan, 1.0)]) == (10, 10, 10, 10)


def test_tips_stand_beside_the_body_and_the_wheels_of_the_plan_below_it():
    assert np.abs(tips_beside(SIZE)[:, 1]).min() > 0.5 * SIZE.width_m
    assert np.abs(wheel_centres(SIZE)[:, 1]).max() < 0.5 * SIZE.width_m
    for places in (tips_beside(SIZE), wheel_centres(SIZE)):
        assert places[:, 0].tolist() == [0.0, 0.0, -2.6, -2.6]
        assert (np.sign(places[:, 1]) == [1, -1, 1, -1]).all()  # fl, fr, rl, rr


def test_wheels_of_the_plan_turn_with_their_wedges():
    angles = np.radians([2.0, 2.0, -1.7, 0.0])
    drawn = plan(SIZE, angles, (10, 10, 10, 10))
    along = drawn.wheels[:, 0] - drawn.wheels[:, 3]
    assert np.arctan2(along[:, 1], along[:, 0]) == pytest.approx(10.0 * angles)
    assert drawn.wheels.mean(axis=1) == pytest.approx(wheel_centres(SIZE))
    assert drawn.wedges[:, 0] == pytest.approx(wheel_centres(SIZE))
    assert drawn.body[:, 0].max() == SIZE.front_m
    assert drawn.body[:, 0].min() == SIZE.rear_m
    assert np.ptp(drawn.body[:, 1]) == pytest.approx(SIZE.width_m)


def test_words_say_the_true_angle_and_its_side():
    assert words(math.radians(1.7)) == "1.7 deg left"
    assert words(math.radians(-0.3)) == "0.3 deg right"
    assert words(math.radians(-0.04)) == ""
    assert words(math.nan) == ""

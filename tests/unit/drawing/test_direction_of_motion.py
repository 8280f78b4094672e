"""The direction that cameras follow: that of the velocity, whatever the heading."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.core.conventions import Array
from activesteer.drawing.cars import direction_of_motion

TIME_S: Array = np.linspace(0.0, 10.0, 1001)


def found(places_m: object, heading_rad: object) -> Array:
    return direction_of_motion(TIME_S, np.asarray(places_m, np.float64), np.asarray(heading_rad, np.float64))


def test_a_car_that_spins_on_a_straight_way_leaves_the_direction_as_it_is():
    places = np.column_stack([20.0 * TIME_S, 0.0 * TIME_S])
    assert np.abs(found(places, 3.0 * TIME_S)).max() < 1e-9


def test_direction_follows_a_bend_without_lag_and_ignores_a_twitch():
    rate, radius = 0.3, 50.0
    bend = radius * np.column_stack([np.sin(rate * TIME_S), 1.0 - np.cos(rate * TIME_S)])
    assert found(bend, rate * TIME_S)[500] == pytest.approx(1.5, abs=1e-3)
    side = 0.1 * 20.0 / (4.0 * math.pi) * np.sin(4.0 * math.pi * TIME_S)  # 0.1 rad at 2 Hz
    twitch = found(np.column_stack([20.0 * TIME_S, side]), 0.0 * TIME_S)
    assert np.abs(twitch[300:700]).max() < 0.01


def test_a_car_at_rest_keeps_its_direction_and_begins_with_its_heading():
    x = np.interp(TIME_S, [0.0, 3.0, 6.0, 10.0], [0.0, 0.0, -30.0, -30.0])
    direction = found(np.column_stack([x, 0.0 * x]), np.full_like(x, math.pi - 0.1))
    assert direction[0] == pytest.approx(math.pi - 0.1, abs=1e-3)
    assert direction[-1] == pytest.approx(math.pi, abs=1e-3)

"""Decision table and corrector (Dorsch 2012, Fig. 10, Table I)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.controllers.corrector import Corrector, rear_direction
from activesteer.controllers.parameters import CorrectorParameters
from activesteer.theory.tolerance import tolerance

OFF, FULL = 0.01, 0.05


def corrector(timestep_s: float = 0.001, **gains: float) -> Corrector:
    return Corrector(CorrectorParameters(deadband_start_radps=OFF, deadband_end_radps=FULL, **gains), timestep_s)


@pytest.mark.parametrize(
    ("yaw_rate", "error", "oversteer", "rear"),
    [
        # Table I: rear with the front wheels (the way the car turns) on oversteer, against them on understeer.
        (0.3, -0.1, True, 1),
        (0.3, 0.1, False, -1),
        (-0.3, 0.1, True, -1),
        (-0.3, -0.1, False, 1),
    ],
)
def test_decision_table(yaw_rate, error, oversteer, rear):
    assert rear_direction(error) == rear
    assert (math.copysign(1, yaw_rate) == rear) is oversteer


def test_without_an_error_the_wheels_do_not_turn():
    assert rear_direction(0.0) == 0


def test_proportional_corrector_is_gain_times_error_times_tolerance():
    block = corrector(proportional_gain_s=0.4)
    for error in np.linspace(-0.1, 0.1, 41):
        assert block.step(error) == pytest.approx(0.4 * error * tolerance(error, OFF, FULL), rel=1e-15)


def test_proportional_corrector_has_no_memory():
    fresh, used = corrector(), corrector()
    for error in (0.2, -0.3, 0.1):
        used.step(error)
    assert used.step(0.07) == fresh.step(0.07)


def test_integral_grows_with_the_error():
    block = corrector(proportional_gain_s=0.0, integral_gain=2.0)
    angles = [block.step(0.06) for _ in range(500)]
    assert angles[-1] == pytest.approx(2.0 * 0.06 * 0.5, rel=1e-12)


def test_integral_does_not_depend_on_the_step_size():
    coarse, fine = (
        corrector(timestep_s, proportional_gain_s=0.0, integral_gain=2.0) for timestep_s in (0.001, 0.00025)
    )
    slow = [coarse.step(0.06) for _ in range(100)]
    quick = [fine.step(0.06) for _ in range(400)]
    assert quick[3::4] == pytest.approx(slow, rel=1e-12)


def test_integral_does_not_grow_inside_the_band():
    block = corrector(proportional_gain_s=0.0, integral_gain=2.0)
    for _ in range(1000):
        assert block.step(0.9 * OFF) == 0.0
    assert block.step(0.06) == pytest.approx(2.0 * 0.06 * 0.001, rel=1e-12)


@pytest.mark.parametrize("side", [1, -1])
def test_integral_does_not_wind_up_at_a_limit_but_comes_back_from_it(side):
    block = corrector(proportional_gain_s=0.0, integral_gain=2.0)
    before = block.step(side * 0.06)
    for _ in range(1000):
        assert block.step(side * 0.06, saturated=side) == before
    # An error to the other side takes the angle away from the limit: that must work while the limit is active.
    after = [block.step(-side * 0.06, saturated=side) for _ in range(3)]
    assert side * before > side * after[0] > side * after[1] > side * after[2]


def test_derivative_answers_to_a_ramp_with_its_slope():
    block = corrector(proportional_gain_s=0.0, derivative_gain_s2=0.01, derivative_filter_s=0.02)
    slope = 1.5
    angles = [block.step(0.06 + slope * 0.001 * count) for count in range(500)]
    assert angles[0] == 0.0
    assert angles[-1] == pytest.approx(0.01 * slope, rel=1e-9)
    assert angles[20] == pytest.approx(0.01 * slope * (1.0 - math.exp(-1.0)), rel=1e-2)


def test_first_error_gives_no_derivative_kick():
    block = corrector(proportional_gain_s=0.0, derivative_gain_s2=0.01)
    assert block.step(0.5) == 0.0


def test_reset_forgets_everything():
    gains = {"integral_gain": 2.0, "derivative_gain_s2": 0.01}
    fresh, used = corrector(**gains), corrector(**gains)
    for count in range(50):
        used.step(0.01 * count)
    used.reset()
    assert [used.step(error) for error in (0.1, 0.2)] == [fresh.step(error) for error in (0.1, 0.2)]


def test_corrector_is_odd_to_the_bit(rng):
    gains = {"proportional_gain_s": 0.3, "integral_gain": 1.0, "derivative_gain_s2": 0.01}
    left, right = corrector(**gains), corrector(**gains)
    for error in 0.1 * rng.standard_normal(200):
        assert left.step(error) == -right.step(-error)

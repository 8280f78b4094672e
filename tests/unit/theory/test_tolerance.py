"""The tolerance function (Dorsch 2012, Fig. 9)."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.theory.tolerance import tolerance

OFF, FULL = 0.01, 0.05


def test_tolerance_is_zero_inside_the_band_and_one_outside():
    assert [tolerance(error, OFF, FULL) for error in (0.0, 0.005, OFF)] == [0.0, 0.0, 0.0]
    assert [tolerance(error, OFF, FULL) for error in (FULL, 0.06, 100.0)] == [1.0, 1.0, 1.0]


def test_tolerance_is_a_half_in_the_middle_and_rises_all_the_way():
    errors = np.linspace(OFF, FULL, 201)
    values = np.array([tolerance(error, OFF, FULL) for error in errors])
    assert values[100] == pytest.approx(0.5, rel=1e-12)
    assert np.all(np.diff(values) > 0.0)
    assert values + values[::-1] == pytest.approx(1.0, rel=1e-12)


def test_tolerance_has_no_kink():
    """The slope is continuous: second differences shrink with the square of the distance."""

    def roughest(count: int) -> float:
        values = [tolerance(error, OFF, FULL) for error in np.linspace(0.0, 2.0 * FULL, count)]
        return float(np.abs(np.diff(values, 2)).max())

    assert roughest(4001) == pytest.approx(roughest(1001) / 16.0, rel=0.05)


def test_tolerance_does_not_know_left_from_right():
    for error in np.linspace(0.0, 0.1, 101):
        assert tolerance(-error, OFF, FULL) == tolerance(error, OFF, FULL)


def test_tolerance_without_a_band_is_a_switch():
    assert tolerance(0.02, 0.02, 0.02) == 0.0
    assert tolerance(0.020001, 0.02, 0.02) == 1.0

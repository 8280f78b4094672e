"""The smoothest path through bounds, against closed forms and its optimality."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.lane_changes import Bound, least_jerk
from tests.raising import raises


def jerk(path) -> float:
    """Integral of y'''^2."""
    x = np.linspace(path.t[0], path.t[-1], 20001)
    return float(np.trapezoid(path(x, 3) ** 2, x))


def test_without_bounds_it_is_the_quintic_of_minimum_jerk():
    path = least_jerk(10.0, 60.0, 3.5, [])
    x = np.linspace(10.0, 60.0, 101)
    share = (x - 10.0) / 50.0
    assert path(x) == pytest.approx(3.5 * (10.0 * share**3 - 15.0 * share**4 + 6.0 * share**5), abs=1e-9)
    assert jerk(path) == pytest.approx(720.0 * 3.5**2 / 50.0**5, rel=1e-4)


def test_both_ends_are_straight():
    path = least_jerk(0.0, 80.0, 0.0, [Bound(40.0, 0.0, 3.0, 4.0)])
    for end in (0.0, 80.0):
        assert [path(end, order) for order in (0, 1, 2)] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_it_goes_no_further_than_it_must():
    path = least_jerk(0.0, 80.0, 0.0, [Bound(40.0, 0.0, 3.0, 4.0)])
    assert path(40.0) == pytest.approx(3.0, abs=1e-9)
    # By symmetry the way there and back is twice that of rest to rest but with the curvature free in the middle.
    x = np.linspace(0.0, 40.0, 41)
    assert path(x) == pytest.approx(path(80.0 - x), abs=1e-8)


def test_points_ahead_and_behind_are_within_their_bounds():
    bounds = [Bound(x - ahead, ahead, 2.8, 3.6) for x in np.arange(35.0, 46.0, 0.5).tolist() for ahead in (1.3, -1.3)]
    path = least_jerk(0.0, 80.0, 0.0, bounds)
    values = [float(path(bound.x_m) + bound.ahead_m * path(bound.x_m, 1)) for bound in bounds]
    assert min(values) == pytest.approx(2.8, abs=1e-7)
    assert max(values) <= 3.6 + 1e-7


def test_no_other_path_within_the_bounds_has_less_jerk(rng):
    bounds = [Bound(x, 0.0, 2.8, 3.6) for x in np.arange(35.0, 46.0, 0.5).tolist()]
    bounds += [Bound(x, 0.0, -0.2, 0.2) for x in np.arange(0.0, 11.0, 0.5).tolist()]
    path = least_jerk(0.0, 80.0, 0.0, bounds)
    minimum, tried = jerk(path), 0
    # Between this path and one well inside the bounds, so that some of what is tried keeps them.
    inside = least_jerk(0.0, 80.0, 0.0, [b._replace(low_m=b.low_m + 0.15, high_m=b.high_m - 0.15) for b in bounds])
    for _ in range(200):
        other = type(path)(path.t, path.c + 0.5 * (inside.c - path.c), path.k)
        other.c[3:-3] += 0.03 * rng.standard_normal(len(path.c) - 6)
        if all(bound.low_m <= other(bound.x_m) <= bound.high_m for bound in bounds):
            tried += 1
            assert jerk(other) > minimum
    assert tried > 20


def test_bounds_that_contradict_each_other_are_answered():
    with raises(ManeuverError):
        least_jerk(0.0, 50.0, 0.0, [Bound(20.0, 0.0, 1.0, 2.0), Bound(20.0, 0.0, 3.0, 4.0)])

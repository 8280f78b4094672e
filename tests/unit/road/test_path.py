"""Paths: arc length, curvature, straight ends, the nearest point."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.core.path import SPACING_M, Path
from activesteer.errors import ManeuverError
from activesteer.road.native_path import PathSearch
from tests.raising import raises


def arc(radius_m: float, degrees: float, points: int = 60) -> Path:
    """Return a turn about (0, radius), from the origin."""
    angle = np.radians(np.linspace(0.0, degrees, points)) * math.copysign(1.0, radius_m)
    return Path.through(radius_m * np.sin(angle), radius_m * (1.0 - np.cos(angle)))


@pytest.mark.parametrize("radius_m", [40.0, -40.0])
def test_an_arc_has_its_length_heading_and_curvature(radius_m: float) -> None:
    path = arc(radius_m, 90.0)
    assert path.length_m == pytest.approx(abs(radius_m) * math.pi / 2, rel=1e-5)
    assert np.ptp(path.heading_rad) == pytest.approx(math.pi / 2, abs=0.01)
    assert path.heading_rad[-1] * radius_m > 0.0
    middle = slice(path.s_m.size // 4, 3 * path.s_m.size // 4)
    assert path.curvature_1pm[middle] == pytest.approx(1.0 / radius_m, rel=0.02)


def test_points_are_evenly_spaced() -> None:
    path = arc(30.0, 180.0)
    assert np.diff(path.s_m) == pytest.approx(SPACING_M, rel=0.02)
    assert np.hypot(np.diff(path.x_m), np.diff(path.y_m)) == pytest.approx(np.diff(path.s_m), rel=1e-3)


def test_heading_counts_on_beyond_half_a_turn() -> None:
    assert arc(30.0, 340.0).heading_rad[-1] == pytest.approx(math.radians(340.0), abs=0.02)


def test_it_goes_on_straight_at_both_ends() -> None:
    path = Path.through([0.0, 10.0, 20.0], [0.0, 10.0, 20.0])
    x, y = PathSearch(path).at(np.array([-math.sqrt(2.0), path.length_m + math.sqrt(2.0)]))
    assert x == pytest.approx([-1.0, 21.0])
    assert y == pytest.approx([-1.0, 21.0])


def test_the_nearest_point_is_found_between_the_samples() -> None:
    path = Path.through([0.0, 100.0], [0.0, 0.0])
    for x in (17.13, -3.2, 104.4):
        assert PathSearch(path).nearest(x, 2.0, x + 3.0, 5.0) == pytest.approx(x, abs=1e-9)


def test_the_nearest_point_stays_on_its_own_branch() -> None:
    # A figure that crosses itself: at the crossing, only the place where the car was before tells the branches apart.
    angle = np.linspace(0.0, 2.0 * math.pi, 200)
    path = Path.through(50.0 * np.sin(2.0 * angle), 50.0 * np.sin(angle))
    middle = path.length_m / 2
    assert PathSearch(path).nearest(0.0, 0.0, middle - 3.0, 6.0) == pytest.approx(middle, abs=0.05)


@pytest.mark.parametrize(
    ("x_m", "y_m", "value"),
    [
        ([0.0], [0.0], (1, 1)),
        ([0.0, 1.0], [0.0], (2, 1)),
        ([0.0, 1.0, math.nan], [0.0, 0.0, 0.0], 3),
        ([0.0, 1.0, 1.0], [0.0, 0.0, 0.0], 2),
    ],
)
def test_what_is_no_path_is_told(x_m: list[float], y_m: list[float], value: object) -> None:
    with raises(ManeuverError, value=value):
        Path.through(x_m, y_m)

"""Distance from a path, and between tracks."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.lanes import first_at, largest_difference, path_distance, track_over_x
from tests.unit.analysis.synthetic import along_path


def distance(x: float, y: float, path: list[tuple[float, float]]) -> float:
    px, py = np.array(path, dtype=float).T
    return float(path_distance(np.array([x]), np.array([y]), px, py)[0])


@pytest.mark.parametrize(
    ("x", "y", "expected"),
    [
        (3.3, 2.0, 2.0),  # beside a piece, left
        (3.3, -2.0, -2.0),  # right
        (-50.0, 1.0, 1.0),  # before the beginning the path goes on straight
        (12.0, 40.0, -2.0),  # beyond the end too
        (13.0, -4.0, -5.0),  # outside a corner, the distance is that to its point
        (9.0, 0.3, 0.3),  # inside the corner, the nearer piece counts
    ],
)
def test_signed_distance_from_a_bent_path(x, y, expected):
    assert distance(x, y, [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]) == pytest.approx(expected)


def test_distance_from_a_circle_of_points_is_that_from_the_circle():
    angle = np.linspace(0.0, math.pi, 400)
    distances = path_distance(
        9.0 * np.cos(angle[3:-3:7]), 9.0 * np.sin(angle[3:-3:7]), 10.0 * np.cos(angle), 10.0 * np.sin(angle)
    )
    np.testing.assert_allclose(distances, 1.0, atol=1e-3)


def test_difference_of_two_tracks_is_lateral_at_the_same_x_and_within_the_gates():
    one = along_path(np.zeros_like)
    other = along_path(lambda x: np.where(x < 50.0, 0.3 * np.sin(x / 5.0), 5.0))
    assert largest_difference(one, other, 0.0, 49.0) == pytest.approx(0.3, rel=1e-3)
    assert largest_difference(other, one, 0.0, 60.0) == pytest.approx(5.0)


def test_a_car_that_does_not_get_there_has_no_difference():
    stopped = along_path(stops_m=100.0)
    assert math.isnan(largest_difference(along_path(), stopped, 30.0, 150.0))
    assert first_at(stopped, 150.0) is None


def test_a_car_that_turns_back_counts_where_it_was_first():
    run = along_path(np.zeros_like, duration_s=4.0)
    x = run["front_axle_x_m"]
    run.channels["front_axle_y_m"] = np.where(run.time_s < 2.0, 0.0, 3.0)
    run.channels["front_axle_x_m"] = np.where(run.time_s < 2.0, x, 2.0 * x[2000] - x)
    np.testing.assert_allclose(track_over_x(run, np.array([10.0, 30.0, 39.0])), 0.0)

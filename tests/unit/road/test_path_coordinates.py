"""Distance along a path of any place on the road."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.core.path import Path
from activesteer.errors import ManeuverError
from activesteer.road.course import Course
from activesteer.road.native_path import PathGrid, along_path
from activesteer.road.obstacles import Obstacle
from activesteer.road.road import Road, RoadPatch


def _along(x_m: float, y_m: float, grid: PathGrid) -> tuple[float, float]:
    # Called without a compiled function of this file, whose kept code would not follow a change of the kernel.
    return along_path(x_m, y_m, *grid)[:2]


def test_on_a_circle_the_distance_is_the_arc_and_the_offset_points_to_its_centre() -> None:
    radius = 60.0
    turn = np.linspace(0.0, math.pi, 200)
    path = Path.through(radius * np.sin(turn), radius * (1.0 - np.cos(turn)))
    grid = PathGrid.of(path)
    for angle in (0.1, 1.0, 3.0):
        for left in (-15.0, 0.0, 15.0):
            place = (radius - left) * math.sin(angle), radius - (radius - left) * math.cos(angle)
            # Half a metre of chord on 60 m radius has 0.5 mm of sagitta; beside the path the normals fan out.
            fan = 0.25 * abs(left) / radius
            along, beside = _along(*place, grid)
            assert along == pytest.approx(radius * angle, abs=2e-3 + fan)
            assert beside == pytest.approx(left, abs=2e-3)


def test_direction_and_curvature_on_a_circle_are_those_of_the_circle() -> None:
    radius = 60.0
    turn = np.linspace(0.0, math.pi, 200)
    grid = PathGrid.of(Path.through(radius * np.sin(turn), radius * (1.0 - np.cos(turn))))
    for angle in turn[5:-5:20]:
        for beyond in (0.0, 0.3 * turn[1]):
            at = angle + beyond
            found = along_path(radius * math.sin(at), radius * (1.0 - math.cos(at)), *grid)
            assert found[2:] == pytest.approx((math.cos(at), math.sin(at), 1.0 / radius), abs=2e-4)


def test_beyond_both_ends_and_off_the_grid_the_path_goes_on_straight() -> None:
    grid = PathGrid.of(Path.through([0.0, 30.0, 60.0], [0.0, 0.0, 0.0]))
    assert _along(-50.0, 3.0, grid) == pytest.approx((-50.0, 3.0))
    assert _along(500.0, -100.0, grid) == pytest.approx((500.0, -100.0))


def test_where_the_path_crosses_itself_each_branch_keeps_its_distance() -> None:
    turn = np.linspace(0.0, 1.5 * math.pi, 300)
    # The loop ends at (20, 40), heading down, and crosses the straight at (20, 0).
    x = np.concatenate([[0.0, 20.0, 40.0], 60.0 + 40.0 * np.sin(turn), [20.0] * 4])
    y = np.concatenate([[0.0, 0.0, 0.0], 40.0 - 40.0 * np.cos(turn), [20.0, 0.0, -20.0, -40.0]])
    path = Path.through(x, y)
    grid = PathGrid.of(path)
    assert _along(15.0, 0.0, grid)[0] == pytest.approx(15.0, abs=0.2)
    s, n = _along(20.5, -6.0, grid)
    assert s > 200.0
    assert abs(n) < 2.0


def test_on_a_second_lap_the_first_lap_s_distance_counts() -> None:
    turn = np.linspace(0.0, 4.0 * math.pi, 800)
    path = Path.through(30.0 * np.sin(turn), 30.0 * (1.0 - np.cos(turn)))
    grid = PathGrid.of(path)
    found = [_along(30.0 * math.sin(angle), 30.0 * (1.0 - math.cos(angle)), grid)[0] for angle in (1.0, 2.0, 5.0)]
    assert found == pytest.approx([30.0, 60.0, 150.0], abs=0.1)


def test_a_ramp_is_linear_and_drawn_in_steps() -> None:
    road = Road(0.9, patches=(RoadPatch(10.0, 30.0, 0.9, mu_end=0.5),))
    (area,) = road.areas()
    clipped = area.clipped(20.0, 30.0, -1.0, 1.0)
    assert clipped is not None
    assert clipped.mu == pytest.approx(0.7)
    pieces = road.pieces(-100.0, 100.0, -5.0, 5.0)
    assert [pieces[0].mu, pieces[-1].mu] == pytest.approx([0.89, 0.51])


def test_patches_along_a_path_are_drawn_along_it_and_need_one() -> None:
    turn = np.linspace(0.0, math.pi, 100)
    course = Course(Path.through(50.0 * np.sin(turn), 50.0 * (1.0 - np.cos(turn))))
    road = Road(0.9, patches=(RoadPatch(70.0, 80.0, 0.3, side="left"),), along="path").laid(course)
    corners = np.concatenate([piece.corners_m for piece in road.pieces(0.0, 1.0, 0.0, 1.0)])
    radii = np.hypot(corners[:, 0], corners[:, 1] - 50.0)
    assert np.all((radii > 45.9) & (radii < 50.1))  # left is inside
    with pytest.raises(ManeuverError, match="no path"):
        Road(0.9, mu_left=0.5, along="path").laid(None)
    with pytest.raises(ManeuverError, match="no effect"):
        Road(0.9, along="path")


def test_a_kerb_is_drawn_at_its_angle_and_a_cleat_along_the_path() -> None:
    kerb = Obstacle("kerb", 8.0, height_m=0.06, angle_rad=math.radians(-70.0))
    ((words, corners),) = Road(0.9, obstacle=(kerb,)).outlines(0.0, 30.0, -2.5, 3.0)
    assert words == "kerb of 60 mm"
    x, y = corners.T
    edge = y[x < 29.9], x[x < 29.9]
    assert np.polyfit(*edge, 1) == pytest.approx([math.tan(math.radians(70.0)), 8.0])
    assert (x.max(), y.min(), y.max()) == (30.0, -2.5, 3.0)
    turn = np.linspace(0.0, math.pi, 100)
    course = Course(Path.through(50.0 * np.sin(turn), 50.0 * (1.0 - np.cos(turn))))
    cleat = Obstacle("cleat", 25.0 * math.pi, length_m=0.4, height_m=0.02)
    ((_, corners),) = Road(0.9, obstacle=(cleat,), along="path").laid(course).outlines(0.0, 1.0, 0.0, 1.0)
    assert corners[0] == pytest.approx([54.0, 50.0], abs=0.02)  # across the path, which goes to the left there

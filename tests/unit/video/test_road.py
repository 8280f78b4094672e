"""Lines, marks and posts of a film's road, against their places and sizes."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.road.course import Course
from activesteer.video.road import add_course, add_edges
from tests.unit.video.test_render_scene import COURSE


def boxes(spec: mujoco.MjSpec) -> np.ndarray:
    """Return all boxes along an axis as low x, high x, low y, high y and height, shape (n, 5)."""
    geoms = [geom for geom in spec.worldbody.geoms if geom.type == mujoco.mjtGeom.mjGEOM_BOX]
    rows = [
        (*sorted((geom.pos[0] - geom.size[0], geom.pos[0] + geom.size[0])),
         geom.pos[1] - geom.size[1], geom.pos[1] + geom.size[1], geom.size[2])
        for geom in geoms if abs(geom.quat[3]) < 1e-9
    ]  # fmt: skip
    return np.array(rows).round(6)


def test_edges_run_on_both_sides_with_marks_inside_and_posts_outside() -> None:
    """A car on the x axis from 0 to 100 m: edges 3.75 m beside it, from -60 to 160 m."""
    spec = mujoco.MjSpec()
    add_edges(spec, [np.column_stack([np.linspace(0.0, 100.0, 50), np.zeros(50)])])
    found = boxes(spec)
    edges = found[found[:, 1] - found[:, 0] > 1.0]
    assert edges.tolist() == [[-60.0, 160.0, y - 0.06, y + 0.06, 0.012] for y in (-3.75, 3.75)]
    posts = found[found[:, 4] == 0.9]
    assert sorted(posts[:, 0] + 0.06) == pytest.approx(sorted(2 * [-50.0, 0.0, 50.0, 100.0, 150.0]))
    assert set(np.abs(posts[:, 2:4].mean(axis=1)).round(6)) == {3.75 + 0.6}
    marks = found[(found[:, 1] - found[:, 0] < 1.0) & (found[:, 4] < 0.9)]
    assert sorted(marks[:, 0] + 0.06) == pytest.approx(sorted(2 * [10.0 * number for number in range(-6, 17)]))
    # From the edge to the inside.
    for side in (-1.0, 1.0):
        own = marks[np.sign(marks[:, 2]) == side]
        np.testing.assert_allclose(own[:, 2:4], [sorted((side * 3.15, side * 3.75))] * len(own))


@pytest.mark.parametrize(("beside_m", "half_m"), [(3.0, 5.5), (22.0, 24.5), (23.0, None)])
def test_edges_leave_room_beside_a_car_until_the_surface_is_open(beside_m: float, half_m: float | None) -> None:
    spec = mujoco.MjSpec()
    add_edges(spec, [np.array([(0.0, 0.0), (10.0, -beside_m)])])
    if half_m is None:
        assert not spec.worldbody.geoms
    else:
        assert boxes(spec)[:, 2].min() == pytest.approx(-half_m - 0.66)


def test_the_lines_of_a_lane_are_its_borders() -> None:
    """The lane goes from 10 to 30 m and is 3 m wide; its lines are 0.12 m wide."""
    spec = mujoco.MjSpec()
    add_course(spec, Course.from_table({**COURSE, "cones": []}))
    found = {tuple(row[:4]) for row in boxes(spec) if row[4] == 0.012}
    assert found == {
        (10.0, 30.0, -1.56, -1.44), (10.0, 30.0, 1.44, 1.56),
        (9.94, 10.06, -1.5, 1.5), (29.94, 30.06, -1.5, 1.5),
    }  # fmt: skip

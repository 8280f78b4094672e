"""Lanes and cones against the formulas of ISO 3888."""

from __future__ import annotations

from itertools import pairwise

import pytest

from activesteer.maneuver.lane_changes import LaneLayout, cones, lanes

WIDTHS = (1.6, 1.8, 2.0)


@pytest.mark.parametrize("b", WIDTHS)
def test_lanes_of_part_1(b):
    entry, aside, back = lanes(LaneLayout(), b, 1.0)
    assert [(lane.start_x_m, lane.end_x_m) for lane in (entry, aside, back)] == [(30, 45), (75, 100), (125, 155)]
    widths = [lane.left_y_m - lane.right_y_m for lane in (entry, aside, back)]
    assert widths == pytest.approx([1.1 * b + 0.25, 1.2 * b + 0.25, 1.3 * b + 0.25])
    assert [0.5 * (lane.left_y_m + lane.right_y_m) for lane in (entry, aside, back)] == pytest.approx([0, 3.5, 0])


def test_a_course_that_resembles_the_standard_is_scaled():
    entry, aside, back = lanes(LaneLayout(length_factor=0.8, offset_factor=0.5), 2.0, 1.0)
    assert [lane.start_x_m for lane in (entry, aside, back)] == [30.0, 66.0, 106.0]
    assert aside.end_x_m - aside.start_x_m == pytest.approx(20.0)
    assert 0.5 * (aside.left_y_m + aside.right_y_m) == pytest.approx(1.75)
    assert aside.left_y_m - aside.right_y_m == pytest.approx(2.65)  # the width is the car's


@pytest.mark.parametrize("b", WIDTHS)
def test_lanes_of_part_2(b):
    entry, aside, back = lanes(LaneLayout(standard="iso_3888_2", entry_m=10.0), b, 1.0)
    assert [(lane.start_x_m, lane.end_x_m) for lane in (entry, aside, back)] == [(10, 22), (35.5, 46.5), (59, 71)]
    assert back.end_x_m - entry.start_x_m == 61.0
    widths = [lane.left_y_m - lane.right_y_m for lane in (entry, aside, back)]
    assert widths == pytest.approx([1.1 * b + 0.25, b + 1.0, 3.0])
    assert entry.left_y_m == -entry.right_y_m
    assert aside.right_y_m - entry.left_y_m == pytest.approx(1.0)
    assert back.right_y_m == pytest.approx(entry.right_y_m)


@pytest.mark.parametrize("standard", ["iso_3888_1", "iso_3888_2"])
def test_lanes_to_the_right_are_mirrored(standard):
    layout = LaneLayout(standard=standard)
    for left, right in zip(lanes(layout, 1.8, 1.0), lanes(layout, 1.8, -1.0), strict=True):
        assert right == left._replace(right_y_m=-left.left_y_m, left_y_m=-left.right_y_m)


@pytest.mark.parametrize("standard", ["iso_3888_1", "iso_3888_2"])
def test_cones_stand_in_pairs_on_the_edges_from_end_to_end(standard):
    course = lanes(LaneLayout(standard=standard), 1.8, 1.0)
    points = [tuple(point) for point in cones(course).tolist()]
    assert len(points) == len(set(points))
    for lane in course:
        for edge in (lane.right_y_m, lane.left_y_m):
            places = sorted(x for x, y in points if y == edge and lane.start_x_m <= x <= lane.end_x_m)
            assert places[0] == lane.start_x_m
            assert places[-1] == lane.end_x_m
            gaps = [after - before for before, after in pairwise(places)]
            assert max(gaps) <= 5.0
            assert min(gaps) == pytest.approx(max(gaps))
    assert sum(lane.start_x_m <= x <= lane.end_x_m for x, _ in points for lane in course) == len(points)

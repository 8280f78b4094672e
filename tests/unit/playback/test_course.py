"""Shapes on the road and on the map, against their sizes."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.playback.course import CONE_HEIGHT_M, CONE_RADIUS_M, _cones, _outline, map_bounds
from activesteer.playback.runs import PLOT_RATE_HZ, runs_of
from activesteer.road.course import Footprint
from tests.unit.playback.synthetic import RADIUS_M, SPEED_MPS, STEER_RAD, WHEELS, circle


def arrays(mesh, *names: str) -> list[np.ndarray]:
    return [np.array(getattr(mesh, name).as_arrow_array().to_pylist()) for name in names]


@pytest.mark.parametrize("time_s", [0.0, 2.0])
def test_the_car_on_the_map_has_its_outline_and_its_steered_wheels(time_s: float) -> None:
    """The map shows y to the left as up, so its second axis is -y."""
    (run,) = runs_of({"ars": circle()})
    size, row = Footprint(), round(100 * time_s)
    strokes = _outline(run)[row] * (1.0, -1.0)
    yaw = SPEED_MPS / RADIUS_M * time_s
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    at = RADIUS_M * np.array([np.sin(yaw), 1.0 - np.cos(yaw)])
    body = {tuple(point) for point in ((strokes[:4] - at) @ turn).round(6).reshape(-1, 2)}
    half = round(0.5 * size.width_m, 6)
    assert body == {(x, y) for x in (round(size.front_m, 6), round(size.rear_m, 6)) for y in (half, -half)}
    for stroke, (corner, place) in zip(strokes[4:], WHEELS.items(), strict=True):
        np.testing.assert_allclose(stroke.mean(axis=0), at + turn @ place, atol=1e-9)
        along = stroke[1] - stroke[0]
        assert np.hypot(*along) == pytest.approx(0.64)
        heading = yaw + (STEER_RAD if corner[0] == "f" else 0.0)
        assert np.arctan2(along[1], along[0]) == pytest.approx(heading)


def test_cones_are_closed_and_stand_in_their_places() -> None:
    places = np.array([(10.0, -1.5), (25.0, 3.0)])
    vertices, normals, faces = arrays(_cones(places), "vertex_positions", "vertex_normals", "triangle_indices")
    for place, own in zip(places, np.split(vertices, 2), strict=True):
        ring, tip = own[:-1] - (*place, 0.0), own[-1] - (*place, 0.0)
        # Single precision at 25 m.
        np.testing.assert_allclose(np.hypot(ring[:, 0], ring[:, 1]), CONE_RADIUS_M, atol=1e-5)
        np.testing.assert_allclose(ring[:, 2], 0.0)
        np.testing.assert_allclose(tip, (0.0, 0.0, CONE_HEIGHT_M), atol=1e-5)
    sides = len(vertices) // 2 - 1
    assert len(faces) == 2 * sides
    for number, own in enumerate(np.split(faces, 2)):
        # Each side of the ring belongs to one triangle with the tip, counter-clockwise from outside.
        assert sorted(map(tuple, own - number * (sides + 1))) == [
            (side, (side + 1) % sides, sides) for side in range(sides)
        ]
    # A normal points away from the axis.
    away = (vertices - np.repeat(np.column_stack([places, [0.0, 0.0]]), sides + 1, axis=0)) * (1.0, 1.0, 0.0)
    assert (np.sum(away * normals, axis=1)[np.any(away, axis=1)] > 0.0).all()


def test_the_map_has_room_around_the_cars() -> None:
    (run,) = runs_of({"ars": circle()})
    yaw = SPEED_MPS / RADIUS_M * 3.0
    (low_x, high_x), (low_y, high_y) = map_bounds([run])
    assert (low_x, high_x) == pytest.approx((-8.0, RADIUS_M * np.sin(yaw) + 8.0), abs=0.02)
    assert (low_y, high_y) == pytest.approx((-RADIUS_M * (1.0 - np.cos(yaw)) - 8.0, 8.0), abs=0.02)


def test_plots_have_their_rate_and_the_last_row() -> None:
    (run,) = runs_of({"ars": circle(duration_s=3.0)})
    time_s = run.recording.time_s
    assert np.diff(time_s)[:-1] == pytest.approx(1.0 / PLOT_RATE_HZ)
    assert (time_s[0], time_s[-1]) == (0.0, pytest.approx(2.999))

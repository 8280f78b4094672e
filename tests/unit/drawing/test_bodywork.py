"""Bodies for drawings: closed, of the size of the car, and equal to the tool's output file."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.drawing.cars import BodySurface, dressed
from activesteer.recording import Link, Primitive
from activesteer.road.course import Footprint
from tests.unit.playback.synthetic import scene

COMPACT = Footprint(1.8, 2.637, (0.2, 0.2))
SALOON = Footprint(1.86, 2.78, (0.2, 0.2))


def panels_of(size: Footprint) -> dict[tuple[str, str], BodySurface]:
    return {(panel.body, panel.name): panel for panel in dressed(scene(), size)[1]}


@pytest.mark.parametrize("size", [COMPACT, SALOON])
def test_the_body_is_as_large_as_the_car(size):
    paint = panels_of(size)["chassis", "paint"].vertices_m
    low, high = paint.min(axis=0), paint.max(axis=0)
    assert low[0] == pytest.approx(size.rear_m, abs=0.02)
    assert high[0] == pytest.approx(size.front_m, abs=0.02)
    body = paint[(paint[:, 0] < -1.0) & (paint[:, 2] < 0.9)]  # without the mirrors
    assert np.ptp(body[:, 1]) == pytest.approx(size.width_m, abs=0.05)
    assert 1.35 < high[2] < 1.55


@pytest.mark.parametrize("size", [COMPACT, SALOON])
def test_it_has_windows_lamps_and_arches_for_its_wheels_and_is_the_same_on_both_sides(size):
    panels = panels_of(size)
    assert {"paint", "glass", "trim", "lamp", "tail", "plate"} == {name for body, name in panels if body == "chassis"}
    assert panels["chassis", "lamp"].vertices_m[:, 0].min() > 0.4
    assert panels["chassis", "tail"].vertices_m[:, 0].max() < -size.wheelbase_m - 0.3
    assert panels["chassis", "glass"].vertices_m[:, 2].min() > 0.85
    paint = panels["chassis", "paint"].vertices_m
    for axle_m in (0.0, -size.wheelbase_m):
        away = np.hypot(paint[:, 0] - axle_m, paint[:, 2] - 0.31)
        assert away[np.abs(paint[:, 1]) > 0.6].min() > 0.34
    for panel in panels.values():
        assert np.abs(panel.vertices_m[:, 1].sum()) < 1e-3 * len(panel.vertices_m)


def test_surfaces_face_outwards():
    panels = panels_of(COMPACT)
    for key, away in ((("chassis", "paint"), (-1.3, 0.0, 0.7)), (("fl_wheel", "tyre"), (0.0, 0.0, 0.0))):
        panel = panels[key]
        a, b, c = (panel.vertices_m[panel.faces[:, number]] for number in range(3))
        outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), (a + b + c) / 3.0 - np.array(away))
        assert (outward > -1e-6).mean() > 0.9, key
        assert np.einsum("ij,ij->i", panel.normals[panel.faces[:, 0]], np.cross(b - a, c - a)).min() > -1e-3


def test_wheels_have_the_size_of_their_tyres_and_one_marked_spoke():
    panels = panels_of(COMPACT)
    tyre, mark = panels["rl_wheel", "tyre"].vertices_m, panels["rl_wheel", "mark"].vertices_m
    assert np.ptp(tyre, axis=0) == pytest.approx([0.6, 0.2, 0.6], rel=1e-2)
    assert mark[:, 2].min() > 0.0  # on one side of the axis: a turn is seen


def test_what_the_body_replaces_is_left_out_and_the_rest_stays():
    kept, _ = dressed(scene(), COMPACT)
    assert [part for part in kept if isinstance(part, Primitive)] == []
    assert [part for part in kept if isinstance(part, Link)] == [part for part in scene() if isinstance(part, Link)]
    assert dressed(scene(), None) == (tuple(scene()), ())

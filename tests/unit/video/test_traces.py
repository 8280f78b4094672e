from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import Channel
from activesteer.recording import Poses, Recording
from activesteer.road.course import Footprint
from activesteer.video.track import Traces, Track

SPEED_MPS = 20.0
CHANNELS = ("slip_angle_rad", "slip_ratio", "tyre_fz_N", "contact_x_m", "contact_y_m")


def straight(slides_from_s: float, load_N: float = 4000.0) -> Recording:
    """Return a car that drives 3 s along x and whose rear left tyre slides from an instant on."""
    time_s = np.linspace(0.0, 3.0, 301)
    columns = {}
    for corner in CORNERS:
        slip = np.where((time_s >= slides_from_s) & (corner == "rl"), 0.4, 0.03)
        side = 0.8 if corner[1] == "l" else -0.8
        values = (slip, 0.0, load_N, SPEED_MPS * time_s - (2.6 if corner[0] == "r" else 0.0), side)
        columns |= {f"{corner}_{name}": value + 0.0 * time_s for name, value in zip(CHANNELS, values, strict=True)}
    places = np.zeros((len(time_s), 1, 3))
    places[:, 0, 0] = SPEED_MPS * time_s
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (len(time_s), 1, 1))
    poses = Poses(time_s, ("chassis",), places, turned)
    table = [Channel(name, "", "", "vehicle") for name in columns]
    return Recording(table, time_s, np.column_stack(list(columns.values())), poses=poses)


def drawn(run: Recording, time_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the centres of the pieces of the path and of the skid marks [m]."""
    scene = mujoco.MjvScene(mujoco.MjModel.from_xml_string("<mujoco/>"), 2000)
    Traces(run, Track(run, "run"), Footprint(), "#ff0000").add(scene, time_s)
    solids = scene.geoms[: scene.ngeom]
    red = np.array([geom.rgba[0] > 0.9 for geom in solids], bool)
    places = np.array([geom.pos for geom in solids]).reshape(-1, 3)
    return places[red], places[~red]


def test_path_grows_with_the_car():
    run = straight(9.0)
    early, late = drawn(run, 1.0)[0], drawn(run, 2.0)[0]
    assert early[:, 0].max() == pytest.approx(SPEED_MPS * 1.0 - 0.5 * 2.7, abs=1.0)
    assert late[:, 0].max() - early[:, 0].max() == pytest.approx(SPEED_MPS, abs=1.0)
    assert len(drawn(run, -1.0)[0]) == 0


def test_tyre_leaves_a_mark_where_it_slides_and_only_there():
    _, skids = drawn(straight(1.0), 3.0)
    assert np.allclose(skids[:, 1], 0.8)  # the left side
    assert skids[:, 0].min() == pytest.approx(SPEED_MPS * 1.0 - 2.6, abs=1.0)
    assert skids[:, 0].max() == pytest.approx(SPEED_MPS * 3.0 - 2.6, abs=1.0)
    assert len(drawn(straight(9.0), 3.0)[1]) == 0

"""scene.xml: the car on a road in any viewer, without our callback."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from tests.mjcf.car import FOLDER, TENDONS, names, warnings


@pytest.fixture(scope="module")
def scene() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(FOLDER / "scene.xml"))


def test_cameras_and_contact_pairs(scene: mujoco.MjModel) -> None:
    assert names(scene, mujoco.mjtObj.mjOBJ_CAMERA, scene.ncam) == ["chase", "top", "wheel"]
    assert names(scene, mujoco.mjtObj.mjOBJ_TENDON, scene.ntendon)[: len(TENDONS)] == TENDONS
    tyres = {scene.geom(f"{c}_tyre").id for c in CORNERS}
    pairs = {frozenset((int(a), int(b))) for a, b in zip(scene.pair_geom1, scene.pair_geom2, strict=True)}
    assert pairs == {frozenset((scene.geom("road").id, tyre)) for tyre in tyres}


def test_nothing_but_the_tyres_touches_the_road(scene: mujoco.MjModel) -> None:
    bodies = [i for i in range(scene.ngeom) if scene.geom_bodyid[i] != 0]
    assert not scene.geom_contype[bodies].any()
    assert not scene.geom_conaffinity[bodies].any()


def test_car_stands_on_the_road(scene: mujoco.MjModel) -> None:
    data = mujoco.MjData(scene)
    for _ in range(1000):
        mujoco.mj_step(scene, data)
    assert warnings(data) == 0
    assert np.isfinite(data.qpos).all()
    assert data.ncon >= 4
    assert np.abs(data.qpos[:3]).max() < 0.02
    roll, pitch, yaw = 2 * data.qpos[4:7]
    assert max(abs(roll), abs(pitch), abs(yaw)) < np.radians(0.5)
    assert np.abs(data.qvel[:6]).max() < 0.05


def test_wheels_links_and_springs_can_be_seen(scene: mujoco.MjModel) -> None:
    option = mujoco.MjvOption()
    for corner in CORNERS:
        tyre = scene.geom(f"{corner}_tyre")
        assert option.geomgroup[tyre.group[0]]
        # The front ones are fixed tendons, which have no shape: the scene draws them.
        front = corner[0] == "f"
        for kind in ("viewer_spring", "viewer_damper") if front else ("spring", "damper"):
            tendon = scene.tendon(f"{corner}_{kind}")
            assert option.tendongroup[scene.tendon_group[tendon.id]]
            assert scene.tendon_rgba[tendon.id][3] > 0.3

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.video.labels import Labels, pixel_of
from activesteer.video.markings import Label, _hides

SIZE = (640, 480)


@pytest.fixture
def scene() -> mujoco.MjvScene:
    """A view from 10 m above the origin, x to the right and y up."""
    model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.elevation, camera.azimuth = (0.0, 0.0, 0.0), 10.0, -90.0, 90.0
    made = mujoco.MjvScene(model, 10)
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, int(mujoco.mjtCatBit.mjCAT_ALL), made)
    return made


def test_places_are_found_in_the_picture(scene):
    assert pixel_of(scene, np.zeros(3), SIZE) == pytest.approx((320.0, 240.0), abs=0.5)
    right, up = (pixel_of(scene, np.array(place), SIZE) for place in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    assert right is not None
    assert up is not None
    # Half the height is seen under 22.5 deg.
    per_m = 240.0 / (10.0 * np.tan(np.radians(22.5)))
    assert right == pytest.approx((320.0 + per_m, 240.0), abs=1.0)
    assert up == pytest.approx((320.0, 240.0 - per_m), abs=1.0)


def test_what_is_behind_the_camera_is_nowhere(scene):
    assert pixel_of(scene, np.array([0.0, 0.0, 11.0]), SIZE) is None


def test_a_label_at_an_edge_is_seen_whole_and_one_of_a_place_beyond_it_is_not_written(scene):
    def written(x_m: float) -> np.ndarray:
        label = Label("2.0 deg left, x10", np.array([x_m, 0.0, 0.0]), np.array([x_m + 1.0, 0.0, 0.0]))
        grey = np.full((SIZE[1], SIZE[0], 3), 128, np.uint8)
        return np.argwhere((Labels(SIZE).draw(grey, scene, [label]) != grey).any(axis=2))

    inside, edge = written(0.0), written(5.4)
    assert edge[:, 1].max() == SIZE[0] - 1
    assert np.ptp(edge[:, 1]) == np.ptp(inside[:, 1])
    assert len(written(6.0)) == 0


def test_a_line_leads_from_a_label_to_its_place(scene):
    grey = np.full((SIZE[1], SIZE[0], 3), 128, np.uint8)
    place, pointed = np.array([1.0, 0.0, 0.0]), np.array([-2.0, 0.0, 0.0])
    label = Label("2.0 deg", place, place + np.array([1.0, 0.0, 0.0]))
    without, with_line = (
        np.argwhere((Labels(SIZE).draw(grey, scene, [one]) != grey).any(axis=2))
        for one in (label, label._replace(leads_to_m=pointed))
    )
    at = pixel_of(scene, pointed, SIZE)
    assert at is not None
    assert with_line[:, 1].min() == pytest.approx(at[0], abs=2.0)
    assert without[:, 1].min() > at[0] + 20.0
    assert (Labels(SIZE).draw(grey, scene, [label._replace(far_m=5.0)]) == grey).all()


def test_a_car_hides_a_place_on_its_far_side_only():
    low, high, eye = np.array([-3.5, -0.9, 0.2]), np.array([0.85, 0.9, 1.4]), np.array([-9.0, 3.0, 3.0])
    assert _hides(low, high, eye, np.array([-1.0, -1.3, 0.05]))
    assert not _hides(low, high, eye, np.array([-2.6, 1.3, 0.05]))

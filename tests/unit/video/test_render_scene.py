from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from activesteer.errors import PlaybackError, RecordingError
from activesteer.recording import Primitive
from activesteer.road.course import Course
from activesteer.video import Film, FilmedCar, RenderScene, Settings
from activesteer.video.track import Track
from tests.raising import raises
from tests.unit.playback.synthetic import circle

COURSE = {
    "path": {"x_m": [0.0, 50.0, 100.0], "y_m": [0.0, 0.0, 20.0]},
    "lanes": [{"name": "a", "start_x_m": 10.0, "end_x_m": 30.0, "right_y_m": -1.5, "left_y_m": 1.5}],
    "cones": [[10.0, -1.5], [10.0, 1.5]],
}


def stage(*cars: FilmedCar, **more) -> RenderScene:
    run = circle()
    return RenderScene(cars or [FilmedCar(run.scene, run.poses.names)], **more)


def test_bodies_are_where_they_are_put():
    run = circle()
    track, built = Track(run, "circle"), stage()
    positions, quaternions = track.poses(1.0)
    built.place(0, positions, quaternions)
    built.update()
    for number, body in enumerate(run.poses.names):
        placed = built.data.body(f"0/{body}")
        np.testing.assert_allclose(placed.xpos, positions[number], atol=1e-12)
        assert abs(np.dot(placed.xquat, quaternions[number])) == pytest.approx(1.0)


def test_links_run_from_body_to_body():
    run = circle()
    track, built = Track(run, "circle"), stage()
    positions, quaternions = track.poses(2.0)
    built.place(0, positions, quaternions)
    built.update()
    tendon = built.model.tendon("0/rl_arm").id
    first = built.data.ten_wrapadr[tendon]
    ends = built.data.wrap_xpos.reshape(-1, 3)[first : first + 2]
    np.testing.assert_allclose(ends[1], positions[run.poses.names.index("rl_wheel")], atol=1e-9)
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(math.hypot(0.38, 0.05), abs=0.1)


def test_shadow_turns_with_the_car_but_stays_on_the_road():
    built = stage()
    positions, quaternions = Track(circle(), "circle").poses(0.0)
    up = positions + np.array([0.0, 0.0, 2.0])
    rolled = np.array([0.9, 0.2, 0.0, 0.3])
    quaternions = np.tile(rolled / np.linalg.norm(rolled), (len(quaternions), 1))
    built.place(0, up, quaternions)
    built.update()
    shadow = built.data.body("0/shadow")
    assert shadow.xpos[2] == 0.0
    assert shadow.xmat.reshape(3, 3)[2] == pytest.approx([0.0, 0.0, 1.0])


def test_a_ghost_in_the_place_of_a_car_is_not_drawn():
    run = circle()
    cars = [FilmedCar(run.scene, run.poses.names), FilmedCar(run.scene, run.poses.names, ghost=True)]
    built = stage(*cars)
    positions, quaternions = Track(run, "circle").poses(1.0)
    ghost = built.model.body("1/chassis").geomadr[0]
    opacity = []
    for beside_m in (0.0, 0.6, 3.0):
        built.place(0, positions, quaternions)
        built.place(1, positions + np.array([0.0, beside_m, 0.0]), quaternions)
        built.update()
        opacity.append(built.model.geom_rgba[ghost, 3])
    assert opacity[0] == 0.0 < opacity[1] < opacity[2]


def test_solids_have_the_size_of_the_recording():
    parts = (
        Primitive("chassis", "box", (4.0, 2.0, 1.0)),
        Primitive("chassis", "cylinder", (0.6, 0.6, 0.2)),
        Primitive("chassis", "sphere", (3.0, 2.0, 1.0)),
        Primitive("nowhere", "box", (1.0, 1.0, 1.0)),
    )
    model = stage(FilmedCar(parts, ("chassis",))).model
    first = int(model.body("0/chassis").geomadr[0])
    assert model.body("0/chassis").geomnum[0] == 3
    expected = [[2.0, 1.0, 0.5], [0.3, 0.1, 0.0], [1.5, 1.0, 0.5]]
    np.testing.assert_allclose(model.geom_size[first : first + 3], expected)


def test_course_has_its_cones_and_lanes():
    bare, built = stage().model, stage(course=Course.from_table(COURSE)).model
    meshes = built.geom_type == mujoco.mjtGeom.mjGEOM_MESH
    meshes &= built.geom_bodyid == 0  # without the sky
    assert meshes.sum() == 3 * 2  # three rings a cone
    places = {tuple(np.round(place[:2], 6)) for place in built.geom_pos[meshes]}
    assert places == {(10.0, -1.5), (10.0, 1.5)}
    # Feet of the cones, four lines, and a dash of the path every 4 m of 104.
    assert built.ngeom - bare.ngeom == 6 + 2 + 4 + 26


@pytest.mark.parametrize(
    ("more", "key"),
    [
        ({"course": {"lanes": [], "cones": []}}, "course.path"),
        ({"course": {**COURSE, "lanes": [{"name": "a"}]}}, "course.lanes.0.start_x_m"),
        ({"maneuver": {"road": {"patches": [{"mu": 0.3}]}}}, "maneuver.road.patches.0.start_m"),
    ],
)
def test_a_recording_with_a_damaged_course_or_road_says_so(more, key):
    with raises(RecordingError, key=key):
        Film({"circle": circle(metadata=more)}, Settings())


def test_a_car_that_cannot_be_drawn_says_so():
    with raises(PlaybackError, cause=KeyError):
        stage(FilmedCar((Primitive("chassis", "cone", (1.0, 1.0, 1.0)),), ("chassis",)))


def test_a_course_without_end_is_drawn_as_far_as_a_picture_can_hold():
    far = {"path": {"x_m": [0.0, 1e6], "y_m": [0.0, 0.0]}, "cones": [[float(x), 0.0] for x in range(5000)]}
    assert stage(course=Course.from_table(far)).model.ngeom < 20000

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from activesteer.errors import ParameterError
from activesteer.recording import Recording
from activesteer.video.film import Settings, aim
from activesteer.video.track import Track
from tests.raising import raises
from tests.unit.playback.synthetic import RADIUS_M, SPEED_MPS, circle


def eye(name: str, time_s: float, corner: str = "fl") -> tuple[np.ndarray, np.ndarray]:
    """Return position and target of the camera."""
    camera = mujoco.MjvCamera()
    aim(camera, name, [Track(circle(), "circle")], time_s, corner)
    azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
    forward = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    return camera.lookat - camera.distance * forward, forward


def local(point: np.ndarray, time_s: float) -> np.ndarray:
    """Return a point of the world in axes of the car."""
    yaw = SPEED_MPS / RADIUS_M * time_s
    x, y = point[0] - RADIUS_M * math.sin(yaw), point[1] - RADIUS_M * (1.0 - math.cos(yaw))
    return np.array([math.cos(yaw) * x + math.sin(yaw) * y, -math.sin(yaw) * x + math.cos(yaw) * y, point[2]])


def test_chase_camera_is_behind_and_above_and_looks_ahead():
    at, forward = eye("chase", 1.5)
    x, y, z = local(at, 1.5)
    assert -12.0 < x < -6.0
    assert abs(y) < 0.5
    assert 1.5 < z < 4.0
    yaw = SPEED_MPS / RADIUS_M * 1.5
    assert np.dot(forward, [math.cos(yaw), math.sin(yaw), 0.0]) > 0.9


def test_top_camera_looks_straight_down_on_the_middle_of_the_car():
    at, forward = eye("top", 1.5)
    assert local(at, 1.5)[:2] == pytest.approx([-1.35, 0.0], abs=0.01)
    assert forward == pytest.approx([0.0, 0.0, -1.0])


@pytest.mark.parametrize("name", ["chase", "top"])
@pytest.mark.parametrize(("apart_m", "seen"), [(12.0, 2), (200.0, 1)])
def test_all_cars_stay_in_the_picture_unless_they_are_far_apart(name, apart_m, seen):
    run = circle()
    moved = run.poses._replace(positions_m=run.poses.positions_m + np.array([-apart_m, 0.5 * apart_m, 0.0]))
    other = Recording(run.channels, run.time_s, run.values, poses=moved)
    tracks, camera = [Track(run, "one"), Track(other, "other")], mujoco.MjvCamera()
    aim(camera, name, tracks, 1.5)
    azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
    flat, rise = math.cos(elevation), math.sin(elevation)
    ahead = np.array([flat * math.cos(azimuth), flat * math.sin(azimuth), rise])
    left = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    within = 0
    for track in tracks:
        place = track.middle(1.5) - (camera.lookat - camera.distance * ahead)
        depth, across, up = place @ ahead, place @ left, place @ np.cross(ahead, left)
        within += abs(up) < depth * math.tan(math.radians(22.5)) and abs(across) < 16 / 9 * depth * math.tan(
            math.radians(22.5)
        )
    assert within == seen


@pytest.mark.parametrize("corner", ["fl", "fr", "rl", "rr"])
def test_wheel_camera_sees_the_inner_side_of_its_wheel(corner):
    at, _ = eye("wheel", 1.0, corner)
    wheel = local(Track(circle(), "circle").wheel_centre(corner, 1.0), 1.0)
    x, y, _ = local(at, 1.0)
    assert (x - wheel[0]) * (1 if corner[0] == "f" else -1) > 1.0  # from the end of the car
    assert abs(y) < abs(wheel[1])
    assert math.dist((x, y), wheel[:2]) < 2.5


def test_unknown_names_are_told_with_those_that_exist():
    with raises(ParameterError, value="chse"):
        Settings(camera="chse")
    with raises(ParameterError, value="lf"):
        Settings(camera="wheel", corner="lf")

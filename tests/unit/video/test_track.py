from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.core.signals import Channel
from activesteer.errors import PlaybackError
from activesteer.recording import Poses, Recording
from activesteer.video.track import Track
from tests.raising import raises
from tests.unit.playback.synthetic import RADIUS_M, SPEED_MPS, WHEELS, circle

CHANNEL = [Channel("x_m", "m", "", "vehicle")]


def turning(angle_rad: np.ndarray, interval_s: float = 0.01) -> Recording:
    """Return a chassis that stands and turns."""
    time_s = np.asarray(np.arange(len(angle_rad)) * interval_s, np.float64)
    turn = np.stack([np.cos(angle_rad / 2), 0 * angle_rad, 0 * angle_rad, np.sin(angle_rad / 2)], axis=1)
    poses = Poses(time_s, ("chassis",), np.zeros((len(time_s), 1, 3)), turn[:, None])
    return Recording(CHANNEL, time_s, np.zeros((len(time_s), 1)), poses=poses)


def test_car_is_on_its_way_between_two_poses():
    track = Track(circle(), "circle")
    for time_s in (0.0, 0.004, 1.237, 2.5):
        positions, _ = track.poses(time_s)
        yaw = SPEED_MPS / RADIUS_M * time_s
        assert positions[0, :2] == pytest.approx([RADIUS_M * math.sin(yaw), RADIUS_M * (1 - math.cos(yaw))], abs=1e-4)
        assert track.heading(time_s) == pytest.approx(yaw, abs=1e-6)


def test_poses_beyond_the_ends_are_those_of_the_ends():
    track = Track(circle(1.0), "circle")
    np.testing.assert_array_equal(track.poses(-1.0)[0], track.poses(track.start_s)[0])
    np.testing.assert_array_equal(track.poses(9.0)[0], track.poses(track.end_s)[0])


def test_orientations_between_poses_are_turns_and_take_the_short_way():
    angle = np.array([0.0, 0.5, 1.0])
    recording = turning(angle)
    poses = recording.poses
    flipped = poses.quaternions * np.array([1.0, -1.0, 1.0])[:, None, None]
    other = Recording(CHANNEL, poses.time_s, np.zeros((3, 1)), poses=poses._replace(quaternions=flipped))
    for track in (Track(recording, "a"), Track(other, "b")):
        _, turn = track.poses(0.005)
        assert np.linalg.norm(turn) == pytest.approx(1.0, abs=1e-12)
        assert 2.0 * math.atan2(abs(turn[0, 3]), abs(turn[0, 0])) == pytest.approx(0.25, abs=1e-3)


def test_heading_counts_turns():
    track = Track(turning(np.linspace(0.0, 9.0 * math.pi, 901)), "spin")
    assert track.heading(9.0) == pytest.approx(9.0 * math.pi)


def test_wheel_place_is_in_the_frame_of_the_car():
    track = Track(circle(), "circle")
    for corner, (x, y) in WHEELS.items():
        for time_s in (0.0, 1.0):
            place = track.turn(time_s).T @ (track.wheel_centre(corner, time_s) - track.chassis(time_s))
            assert place[:2] == pytest.approx([x, y], abs=1e-6)


def test_missing_wheel_is_named_with_the_bodies_there_are():
    with raises(PlaybackError, value="fl_wheel", allowed=("chassis",)):
        Track(turning(np.zeros(3)), "x").wheel_centre("fl", 0.0)


def test_poses_that_are_not_finite_are_left_out():
    recording = circle(1.0)
    at = recording.poses.positions_m.copy()
    at[60:] = np.nan
    broken = Recording(
        recording.channels, recording.time_s, recording.values, poses=recording.poses._replace(positions_m=at)
    )
    assert Track(broken, "diverged").end_s == pytest.approx(0.59)


@pytest.mark.parametrize("count", [0, 3])
def test_recording_without_a_car_is_refused(count):
    poses = Poses(np.arange(count) * 0.01, ("table",), np.zeros((count, 1, 3)), np.ones((count, 1, 4)))
    with raises(PlaybackError, value="mine"):
        Track(Recording(CHANNEL, [0.0], [[0.0]], poses=poses), "mine")


def test_single_pose_is_enough():
    track = Track(turning(np.array([0.7])), "one")
    assert track.direction(0.0) == pytest.approx(0.7)
    assert track.poses(0.0)[0].shape == (1, 3)

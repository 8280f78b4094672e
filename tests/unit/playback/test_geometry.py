"""Rotations, against scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from activesteer.core.conventions import yaw_of
from activesteer.playback.car import about_vertical, between, rotated, xyzw


def test_rotated_against_scipy(rng: np.random.Generator) -> None:
    turns = Rotation.random(50, rng=rng)
    point = (0.3, -1.2, 0.7)
    assert np.allclose(rotated(turns.as_quat(scalar_first=True), point), turns.apply(point), atol=1e-14)


def test_heading_is_the_yaw_of_a_rolled_and_pitched_body() -> None:
    yaw = np.linspace(-3.0, 3.0, 13)
    turns = Rotation.from_euler("ZYX", np.column_stack([yaw, np.full(13, 0.05), np.full(13, -0.1)]))
    assert np.allclose(yaw_of(turns.as_quat(scalar_first=True)), yaw)
    assert np.allclose(Rotation.from_quat(about_vertical(yaw)).as_rotvec()[:, 2], yaw)


def test_quaternions_are_given_in_the_viewers_order() -> None:
    assert xyzw([(1.0, 2.0, 3.0, 4.0)]).tolist() == [[2.0, 3.0, 4.0, 1.0]]


@pytest.mark.parametrize("down", [False, True])
def test_a_part_reaches_from_one_point_to_the_other(rng: np.random.Generator, *, down: bool) -> None:
    start = rng.normal(size=(40, 3))
    end = start + rng.normal(size=(40, 3)) * 0.1 + (0.0, 0.0, -1.0 if down else 1.0)
    length, centre, turn = between(start, end)
    half = Rotation.from_quat(turn).apply((0.0, 0.0, 1.0)) * 0.5 * length[:, None]
    ends = {0: centre - half, 1: centre + half}
    assert np.allclose(ends[int(down)], start, atol=1e-12)
    assert np.allclose(ends[1 - int(down)], end, atol=1e-12)


def test_a_part_straight_down_does_not_flip_over() -> None:
    """The shortest rotation from up to down has no definite axis, so a coil could jump."""
    start = np.zeros((3, 3))
    end = np.array([(1e-4, 0.0, -1.0), (0.0, 0.0, -1.0), (-1e-4, 1e-4, -1.0)])
    _, _, turn = between(start, end)
    assert np.abs(np.diff(turn, axis=0)).max() < 1e-3


def test_a_part_of_no_length_or_straight_down_later_is_drawn_too() -> None:
    start = np.zeros((2, 3))
    end = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, -1.0)])
    length, _, turn = between(start, end)
    assert length.tolist() == [0.0, 1.0]
    assert np.allclose(np.linalg.norm(turn, axis=1), 1.0)
    assert np.allclose(Rotation.from_quat(turn[1]).apply((0.0, 0.0, 1.0)), (0.0, 0.0, -1.0))

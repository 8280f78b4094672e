from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.recording import Recording
from activesteer.signals import Channel
from activesteer.video.gauges import Dials, Gauges

SIZE = (640, 480)
NAMES = ("speed_mps", "steering_wheel_rad", "sideslip_rad", "rear_steer_rad", "superposition_rad", "front_steer_rad")


def recording(**values: float) -> Recording:
    everything = {"speed_mps": 20.0} | values
    table = [Channel(name, "", "", "vehicle") for name in everything]
    return Recording(table, [0.0, 1.0], [list(everything.values())] * 2)


def drawn(*runs: Recording, title: str = "", size: tuple[int, int] = SIZE, note: str = "") -> np.ndarray:
    gauges = Gauges([Dials(run, "2 active rear steering", "#d55e00") for run in runs], title, size)
    return gauges.draw(np.full((size[1], size[0], 3), 100, np.uint8), 0.5, note).astype(int)


def changed(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Columns and rows where two pictures differ."""
    return np.argwhere((one != other).any(axis=2))


def test_middle_of_the_picture_is_left_alone():
    picture = drawn(recording())
    assert (picture[40:400] == 100).all()
    assert (picture[-60:] != 100).all(axis=2).mean() > 0.9


def test_two_runs_have_two_rows():
    assert (drawn(recording(), recording())[350:] == 100).all(axis=2).mean() < 0.2
    assert (drawn(recording())[350:410] == 100).all()


@pytest.mark.parametrize(
    "change", [{"speed_mps": 30.0}, {"steering_wheel_rad": 1.0}, {"sideslip_rad": 0.1}, {"rear_steer_rad": 0.04}]
)
def test_each_value_is_seen(change):
    values = {"steering_wheel_rad": 0.0, "sideslip_rad": 0.0, "rear_steer_rad": 0.01}
    where = changed(drawn(recording(**values)), drawn(recording(**(values | change))))
    assert len(where) > 20
    assert where[:, 0].min() > 410


def test_wheel_and_arrow_turn_to_the_side_of_their_sign():
    def middle_of_change(**change: float) -> float:
        """Which side of its upright mark the mark of a gauge went to, in pixels; left is negative."""
        still = {"steering_wheel_rad": 0.0, "sideslip_rad": 0.0}
        before, after = drawn(recording(**still)), drawn(recording(**(still | change)))
        icons = changed(before, after)
        icons = icons[icons[:, 1] > 530]  # right of the numbers
        yellow = [pixel[1] for pixel in icons if _yellow(after[tuple(pixel)]) and not _yellow(before[tuple(pixel)])]
        gone = [pixel[1] for pixel in icons if _yellow(before[tuple(pixel)]) and not _yellow(after[tuple(pixel)])]
        return float(np.mean(yellow) - np.mean(gone))

    assert middle_of_change(steering_wheel_rad=math.radians(60)) < -5.0
    assert middle_of_change(steering_wheel_rad=math.radians(-60)) > 5.0
    assert middle_of_change(sideslip_rad=math.radians(30)) < -2.0
    assert middle_of_change(sideslip_rad=math.radians(-30)) > 2.0


def _yellow(pixel: np.ndarray) -> bool:
    return bool(pixel[0] > 180 and pixel[1] > 140 and pixel[2] < 110)


def test_added_angle_that_is_never_used_takes_no_place():
    without = drawn(recording(steering_wheel_rad=0.0, superposition_rad=1e-6))
    assert (without == drawn(recording(steering_wheel_rad=0.0))).all()
    assert len(changed(without, drawn(recording(steering_wheel_rad=0.0, superposition_rad=0.01)))) > 100


def test_car_that_stands_has_no_sideslip():
    stands = {"speed_mps": 0.0, "sideslip_rad": 0.1}
    assert (drawn(recording(**stands)) == drawn(recording(**(stands | {"sideslip_rad": 1.5})))).all()


def test_channels_that_are_missing_or_not_finite_are_no_error():
    bare = Recording([Channel("x_m", "m", "", "vehicle")], [0.0], [[0.0]])
    assert drawn(bare).shape == (480, 640, 3)
    assert drawn(recording(**dict.fromkeys(NAMES, math.nan))).shape == (480, 640, 3)


def test_long_title_leaves_room_for_the_time():
    short, long = drawn(recording(), title="A"), drawn(recording(), title="A manoeuvre " * 30)
    assert (short[:26, 590:] == long[:26, 590:]).all()
    assert len(changed(short[:26], long[:26])) > 500


@pytest.mark.parametrize("size", [(16, 16), (64, 480), (480, 64), (1920, 1080)])
def test_any_size_can_be_drawn_on(size):
    assert drawn(recording(), title="Title", size=size, note="x 0.25").shape == (size[1], size[0], 3)

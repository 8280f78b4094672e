from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.core.signals import Channel
from activesteer.drawing.wheel_angles import CHANNELS
from activesteer.recording import Recording
from activesteer.video.gauges import LARGEST_SHARE, Dials, Gauges, LargeSideslip

SIZE = (1280, 720)
NAMES = ("speed_mps", "steering_wheel_rad", "sideslip_rad", "rear_steer_rad", "superposition_rad", *CHANNELS)
ORANGE = "#f0843c"


def recording(**values: float) -> Recording:
    everything = {"speed_mps": 20.0} | values
    table = [Channel(name, "", "", "vehicle") for name in everything]
    return Recording(table, [0.0, 1.0], [list(everything.values())] * 2)


def drawn(*runs: Recording, title: str = "", size: tuple[int, int] = SIZE, note: str = "") -> np.ndarray:
    gauges = Gauges([[Dials(run, "2 active rear steering", ORANGE) for run in runs]], title, size, note)
    return gauges.draw(np.full((size[1], size[0], 3), 100, np.uint8), 0.5).astype(int)


def changed(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the rows and columns where two pictures differ."""
    return np.argwhere((one != other).any(axis=2))


@pytest.mark.parametrize("runs", [1, 2, 3])
@pytest.mark.parametrize("size", [(1280, 720), (640, 480), (640, 720), (1920, 1080)])
def test_gauges_cover_at_most_a_tenth_of_the_picture(runs, size):
    full = recording(**dict.fromkeys(NAMES, 0.05))
    picture = drawn(*[full] * runs, title="Double lane change ISO 3888-1, 80 km/h", note="speed x 0.25", size=size)
    assert (picture != 100).any(axis=2).mean() <= LARGEST_SHARE
    assert (picture[size[1] // 4 : size[1] // 2] == 100).all()


@pytest.mark.parametrize(
    "change", [{"speed_mps": 30.0}, {"steering_wheel_rad": 1.0}, {"sideslip_rad": 0.1}, {"rear_steer_rad": 0.04}]
)
def test_each_value_is_seen(change):
    values = {"steering_wheel_rad": 0.0, "sideslip_rad": 0.0, "rear_steer_rad": 0.01}
    where = changed(drawn(recording(**values)), drawn(recording(**(values | change))))
    assert len(where) > 20
    assert where[:, 0].min() > 500


def test_a_negative_value_has_a_flat_sign_and_a_title_no_character_without_a_glyph():
    # Pillow's own font draws a box for a character that it lacks: the typographic minus, a raised 2.
    sign = changed(drawn(recording(sideslip_rad=0.1)), drawn(recording(sideslip_rad=-0.1)))
    assert 1 <= np.ptp(sign[:, 0]) + 1 <= 4
    assert (drawn(recording(), title="5 m/s²") == drawn(recording(), title="5 m/s2")).all()
    assert (drawn(recording(), title="\N{MINUS SIGN}4 %") == drawn(recording(), title="-4 %")).all()


def test_car_that_stands_has_no_sideslip():
    stands = {"speed_mps": 0.0, "sideslip_rad": 0.1}
    assert (drawn(recording(**stands)) == drawn(recording(**(stands | {"sideslip_rad": 1.5})))).all()


def test_channels_that_are_missing_or_not_finite_are_no_error():
    bare = Recording([Channel("x_m", "m", "", "vehicle")], [0.0], [[0.0]])
    assert drawn(bare).shape == (720, 1280, 3)
    assert drawn(recording(**dict.fromkeys(NAMES, math.nan))).shape == (720, 1280, 3)


@pytest.mark.parametrize("size", [(16, 16), (64, 480), (480, 64), (1920, 1080)])
def test_any_size_can_be_drawn_on(size):
    assert drawn(recording(), title="Title", size=size, note="x 0.25").shape == (size[1], size[0], 3)


def test_large_sideslip_changes_with_the_angle_and_is_left_out_at_rest():
    def shown(**values: float) -> np.ndarray:
        dial = Dials(recording(**values), "2 active rear steering", ORANGE)
        return LargeSideslip([[dial]], (283, 340)).draw(np.full((340, 283, 3), 100, np.uint8), 0.5).astype(int)

    small, large = shown(sideslip_rad=0.02), shown(sideslip_rad=0.7)
    assert len(changed(small, large)) > 100
    assert (small[:200] == 100).all()
    at_rest = {"speed_mps": 0.0}
    assert (shown(sideslip_rad=0.02, **at_rest) == shown(sideslip_rad=0.7, **at_rest)).all()

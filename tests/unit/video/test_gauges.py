from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.core.signals import Channel
from activesteer.drawing.wheel_angles import CHANNELS
from activesteer.recording import Recording
from activesteer.video.gauges import LARGEST_SHARE, Dials, Gauges, LargeSideslip

SIZE, LARGE = (1280, 720), (1920, 1080)
NAMES = ("speed_mps", "steering_wheel_rad", "sideslip_rad", "rear_steer_rad", "superposition_rad", *CHANNELS)
ORANGE = "#f0843c"


def recording(**values: float) -> Recording:
    everything = {"speed_mps": 20.0} | values
    table = [Channel(name, "", "", "vehicle") for name in everything]
    return Recording(table, [0.0, 1.0], [list(everything.values())] * 2)


def drawn(
    *runs: Recording, title: str = "", size: tuple[int, int] = SIZE, note: str = "", colour: str = ORANGE
) -> np.ndarray:
    gauges = Gauges([Dials(run, "2 active rear steering", colour) for run in runs], title, size, note)
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


def wedges(rear_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows and columns of the wedges at the rear wheels of the plan."""
    steer = dict.fromkeys(CHANNELS, 0.0)
    straight = drawn(recording(**steer), size=LARGE)
    turned = drawn(recording(**(steer | dict.fromkeys(CHANNELS[2:], math.radians(rear_deg)))), size=LARGE)
    red, green, blue = np.moveaxis(turned, 2, 0)
    rows, columns = np.nonzero(
        (red > 200) & (abs(green - 132) < 45) & (blue < 110) & (np.abs(turned - straight).max(axis=2) > 60)
    )
    return rows, columns


@pytest.mark.parametrize("angle_deg", [1.7, -1.7])
def test_the_plan_shows_side_and_size_of_rear_steering(angle_deg):
    rows, columns = wedges(angle_deg)
    assert len(rows) > 40
    assert rows.min() > 900  # the rear end of a plan whose nose is up
    # Wedges have their tips below and open to the side of their sign: left is positive, and left in the picture.
    top, bottom = columns[rows < np.median(rows)], columns[rows > np.median(rows)]
    assert np.sign(top.mean() - bottom.mean()) == -np.sign(angle_deg)
    # Twice the angle, twice the area.
    assert len(wedges(2.0 * angle_deg)[0]) / len(rows) == pytest.approx(2.0, abs=0.5)


def test_arrow_shows_where_the_car_goes():
    still = {"sideslip_rad": 0.0}
    before, after = drawn(recording(**still)), drawn(recording(sideslip_rad=math.radians(30)))
    where = [pixel[1] for pixel in changed(before, after) if pixel[1] > 1000]
    yellow = [column for row, column in changed(before, after) if column > 1000 and _yellow(after[row, column])]
    assert np.mean(yellow) < np.mean(where) + 2.0
    assert np.mean(yellow) < np.mean([c for r, c in np.argwhere(_yellow(before)) if c > 1000]) - 3.0  # to the left


def _yellow(pixels: np.ndarray) -> np.ndarray:
    return (pixels[..., 0] > 180) & (pixels[..., 1] > 140) & (pixels[..., 2] < 110)


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


def test_steering_wheel_turns_to_the_side_of_the_drivers_angle():
    def mark(angle_rad: float) -> tuple[float, float]:
        """Return column and row of the coloured mark, which other angles leave uncoloured."""
        turned, upside_down = (
            drawn(recording(steering_wheel_rad=angle), size=LARGE, colour="#00ff00") for angle in (angle_rad, np.pi)
        )
        rows, columns = np.nonzero(
            (turned[..., 1] > 200) & (turned[..., 0] < 60) & (upside_down[..., 0] != turned[..., 0])
        )
        return columns.mean(), rows.mean()

    (right, low), (middle, high), (left, low_too) = (mark(angle) for angle in (-1.0, 0.0, 1.0))
    assert left < middle - 10 < right - 20  # the mark is at the top of the wheel; left is positive
    assert low == pytest.approx(low_too, abs=4)
    assert high < low - 4


def test_large_sideslip_changes_with_the_angle_and_is_left_out_at_rest():
    def shown(**values: float) -> np.ndarray:
        dial = Dials(recording(**values), "2 active rear steering", ORANGE)
        return LargeSideslip([dial], (283, 340)).draw(np.full((340, 283, 3), 100, np.uint8), 0.5).astype(int)

    small, large = shown(sideslip_rad=0.02), shown(sideslip_rad=0.7)
    assert len(changed(small, large)) > 100
    assert (small[:200] == 100).all()
    at_rest = {"speed_mps": 0.0}
    assert (shown(sideslip_rad=0.02, **at_rest) == shown(sideslip_rad=0.7, **at_rest)).all()

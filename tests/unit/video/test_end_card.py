from __future__ import annotations

import numpy as np

from activesteer.video.end_card import end_card

SIZE = (640, 480)
GREY = np.full((SIZE[1], SIZE[0], 3), 100, np.uint8)


def test_title_and_a_line_in_the_colour_of_each_run_stand_over_the_picture():
    bare = end_card("", ["none: a", "ars: b"], ["#c9ccd1", "#f0843c"], SIZE)(GREY).astype(int)
    titled = end_card("Slalom", ["none: a", "ars: b"], ["#c9ccd1", "#f0843c"], SIZE)(GREY).astype(int)
    assert (np.abs(bare - titled).max(axis=2) > 60).sum() > 100
    red, green, blue = np.moveaxis(titled, 2, 0)
    orange, grey = (red > 200) & (abs(green - 132) < 20) & (blue < 90), (red == 201) & (green == 204) & (blue == 209)
    assert orange.sum() > 50
    assert np.nonzero(grey)[0].mean() < np.nonzero(orange)[0].mean()  # in the order of the runs
    assert (titled[:60] == 100).all()  # the picture is seen above and below
    assert (titled[-60:] == 100).all()


def test_a_long_line_is_broken_not_cut():
    short, long = (end_card("T", [" ".join(["word"] * n)], ["#c9ccd1"], SIZE)(GREY) for n in (5, 60))
    height = [int((picture != 100).any(axis=(1, 2)).sum()) for picture in (short, long)]
    assert height[1] > height[0] + 30


def test_a_long_title_is_broken_not_cut():
    one, other = (end_card("A manoeuvre " * 9 + last, ["none: a"], ["#c9ccd1"], SIZE)(GREY) for last in ("end", "car"))
    assert (one != other).any()
    short = end_card("A manoeuvre", ["none: a"], ["#c9ccd1"], SIZE)(GREY)
    assert ((one != 100).any(axis=(1, 2)).sum()) > (short != 100).any(axis=(1, 2)).sum() + 10


def test_nothing_is_said_of_nothing():
    assert end_card("", [], [], (16, 16))(GREY[:16, :16]).shape == (16, 16, 3)

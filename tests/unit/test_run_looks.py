"""Appearance of runs shown together: order, colours, dashes."""

from __future__ import annotations

import pytest

from activesteer.core.conventions import RUN_COLOURS, RUN_COLOURS_ON_DARK, run_looks
from tests.contrast import contrast


def test_systems_keep_order_and_colour_whatever_stands_beside_them():
    looks = run_looks(["esc", "afs", "mine", "none"])
    assert list(looks) == ["none", "afs", "esc", "mine"]
    assert looks["afs"].colour == run_looks(["afs"])["afs"].colour == RUN_COLOURS[2]
    assert [look.label for look in looks.values()] == list(looks)
    assert run_looks(["afs", "none"])["none"].label == "1 no control"


def test_runs_that_are_shown_together_differ_in_colour_and_dashes():
    looks = run_looks(["none", *(f"mine{number}" for number in range(5))]).values()
    assert len({look.colour for look in looks}) == len({look.dashes for look in looks}) == 6
    assert len({look.on_dark for look in looks}) == 6


@pytest.mark.parametrize(("colours", "paper"), [(RUN_COLOURS[:5], "#ffffff"), (RUN_COLOURS_ON_DARK, "#16181b")])
def test_curves_stand_out_from_the_paper(colours, paper):
    # What WCAG 2.1 (1.4.11) asks of graphics; the yellow of the sixth is a colour of last resort.
    assert min(contrast(colour, paper) for colour in colours) >= 3.0

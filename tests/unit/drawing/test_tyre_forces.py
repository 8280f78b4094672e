from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.core.signals import Channel
from activesteer.drawing.tyre_forces import force_arrows, force_scale
from activesteer.recording import Recording
from tests.unit.playback import synthetic
from tests.unit.playback.synthetic import circle


def on(mu: float) -> Recording:
    """Return the same car on a road where it uses that share of its forces."""
    run = circle(0.1)
    columns = [Channel(f"{corner}_mu", "-", "", "corners") for corner in CORNERS]
    values = np.column_stack([run.values, np.full((len(run), 4), mu)])
    for number, channel in enumerate(run.channels):
        if "_tyre_f" in channel.name:
            values[:, number] *= mu
    return Recording([*run.channels, *columns], run.time_s, values)


def test_arrows_on_ice_are_as_long_as_on_a_dry_road_where_as_much_of_the_friction_is_used():
    lengths = [np.linalg.norm(force_arrows(run, force_scale([run]))[1], axis=-1) for run in (on(1.0), on(0.1))]
    assert lengths[0] == pytest.approx(1.0, rel=1e-5)  # 1.5 kN
    assert lengths[1] == pytest.approx(lengths[0], rel=1e-5)


def test_runs_that_are_shown_together_have_one_scale_that_of_the_most_friction():
    assert force_scale([on(0.1), on(0.8)]) == pytest.approx(8.0 * force_scale([on(0.1)]))
    assert force_scale([circle(0.1)]) == pytest.approx(1500.0)  # nothing is known of the friction


def test_arrows_stand_at_the_contact_points_and_turn_with_the_wheels():
    run = circle()
    origins, vectors = force_arrows(run, 1500.0)
    assert np.allclose(origins[:, 1, 0], run["fr_contact_x_m"], atol=1e-5)
    # A side force points a quarter turn to the left of where the wheel points.
    for wheel, steer in ((0, synthetic.STEER_RAD), (3, 0.0)):
        angle = np.unwrap(np.arctan2(vectors[:, wheel, 1], vectors[:, wheel, 0]))
        assert np.allclose(angle, run["yaw_rad"] + steer + 0.5 * math.pi, atol=1e-5)

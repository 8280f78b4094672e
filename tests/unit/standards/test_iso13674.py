"""Loops of one sine over another, whose gradient and dead bands are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.errors import RecordingError
from activesteer.standards.iso13674 import loop, slope
from tests.raising import raises

PHASE_RAD = 2.0 * math.pi * 0.2 * np.arange(2000) * 0.01


def test_an_ellipse_has_the_dead_bands_of_its_phase():
    lag_rad = math.radians(10.0)
    found = loop(3.0 * np.sin(PHASE_RAD), 2.0 * np.sin(PHASE_RAD - lag_rad))
    assert found["ordinate_dead_band"] == pytest.approx(2.0 * 2.0 * math.sin(lag_rad), rel=1e-3)
    assert found["abscissa_dead_band"] == pytest.approx(2.0 * 3.0 * math.sin(lag_rad), rel=1e-3)
    assert found["gradient"] == pytest.approx(2.0 / 3.0 * math.cos(lag_rad), rel=1e-3)


def test_a_signal_that_leads_has_negative_dead_bands():
    found = loop(np.sin(PHASE_RAD), np.sin(PHASE_RAD + 0.2))
    assert found["ordinate_dead_band"] < 0.0
    assert found["abscissa_dead_band"] < 0.0


def test_dry_friction_is_the_ordinate_dead_band():
    angle = np.sin(PHASE_RAD)
    torque = 4.0 * angle + 0.5 * np.sign(np.cos(PHASE_RAD))
    # Friction is ahead: it holds against the motion, the torque is higher while the angle rises.
    assert loop(angle, torque)["ordinate_dead_band"] == pytest.approx(-1.0, abs=0.02)
    assert loop(angle, torque)["gradient"] == pytest.approx(4.0, rel=0.01)


def test_signals_that_do_not_pass_through_zero_make_no_loop():
    with raises(RecordingError):
        loop(np.sin(PHASE_RAD), 3.0 + np.sin(PHASE_RAD))


def test_the_slope_of_two_points_is_not_defined():
    x = np.linspace(-2.0, 2.0, 401)
    assert slope(x, 3.0 * x + 1.0) == pytest.approx(3.0)
    assert math.isnan(slope(x[:2], x[:2]))

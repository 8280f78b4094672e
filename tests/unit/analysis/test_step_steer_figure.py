"""The figure of the step steer."""

from __future__ import annotations

import builtins
import sys

import numpy as np
import pytest

from activesteer.analysis.figures import figure_for
from activesteer.errors import ParameterError
from tests.raising import raises
from tests.unit.analysis.synthetic import step_steer

step_steer_figure = figure_for("step_steer")


def three():
    return {
        "afs": step_steer(superposition_rad=0.01),
        "none": step_steer(),
        "ars": step_steer(rear_rad=-0.01),
    }


@pytest.fixture
def saved(figures, tmp_path):
    """Return the saved Figure, to check its curves."""
    step_steer_figure(three(), tmp_path / "figure.png")
    return figures[0]


def test_figure_is_a_png_of_readable_size_and_pyplot_is_left_alone(tmp_path):
    image = pytest.importorskip("matplotlib.image")
    before = "matplotlib.pyplot" in sys.modules
    path = step_steer_figure(three(), tmp_path / "figure.png")
    assert ("matplotlib.pyplot" in sys.modules) == before
    pixels = image.imread(path)
    assert pixels.shape[0] > 1000
    assert pixels.shape[1] > 800
    assert pixels[..., :3].min() < 0.5 < pixels[..., :3].max()


def test_angles_are_in_degrees_and_only_those_that_exist(saved):
    lines = [line for line in saved.get_axes()[1].get_lines() if len(line.get_xdata())]
    ends = sorted(round(float(line.get_ydata()[-1]), 3) for line in lines)
    front = round(float(np.degrees(1.0 / 16.0)), 3)
    assert ends == [pytest.approx(np.degrees(-0.01), abs=1e-3), pytest.approx(np.degrees(0.01), abs=1e-3)] + [front] * 3


def test_without_matplotlib_the_extra_is_named(tmp_path, monkeypatch):
    imported = builtins.__import__

    def without(name, *args, **words):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return imported(name, *args, **words)

    monkeypatch.setattr(builtins, "__import__", without)
    with raises(ParameterError, cause=ImportError, value="matplotlib", allowed="plot"):
        step_steer_figure(three(), tmp_path / "figure.png")

"""Pictures of linear cars, and figure 2."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from markupsafe import Markup

from activesteer.analysis.figures import figure_2
from activesteer.errors import ParameterError
from activesteer.pages import render_page
from activesteer.plotting import Panel, Picture, draw
from activesteer.studies.linear.driver_loop import conclusion
from activesteer.studies.linear.linearisation import (
    DAMPING_RAYS,
    LOCUS_LIMIT_Hz,
    bode_picture,
    linear_car,
    modes_page,
    root_locus_picture,
)
from activesteer.vehicle.linear_state import Mode
from tests.unit.analysis.synthetic import step_steer

OUTPUTS = ("yaw_rate_radps", "ay_mps2", "roll_rad", "sideslip_rad")


def system(speed_mps: float = 20.0) -> control.StateSpace:
    """A synthetic oscillator in modal form, whose damping falls with speed."""
    real, turn = -100.0 / speed_mps, 81.0 - (100.0 / speed_mps) ** 2
    if turn < 0.0:  # two real poles
        poles = real + math.sqrt(-turn), real - math.sqrt(-turn)
        a, names = np.diag(poles), ["roll", "roll_2"]
    else:
        a, names = np.array([[real, -math.sqrt(turn)], [math.sqrt(turn), real]]), ["roll_re", "roll_im"]
    return control.StateSpace(
        a, [[0.0], [81.0]], np.tile([1.0, 0.0], (4, 1)), np.zeros((4, 1)),
        inputs=["steering_wheel_rad"], outputs=list(OUTPUTS), states=names,
    )  # fmt: skip


@pytest.mark.parametrize("speed_kmh", [5.0, 500.0, math.nan])
def test_a_speed_out_of_range_is_rejected_in_the_unit_of_the_command(speed_kmh: float):
    with pytest.raises(ParameterError, match=rf"{speed_kmh:g} km/h\); allowed: .* \(10.8 to 360 km/h\)"):
        linear_car(speed_mps=speed_kmh / 3.6)


def test_bode_diagram_shows_gain_and_phase_of_every_output():
    axes = draw(bode_picture("a", system())).get_axes()
    assert len(axes) == 2 * len(OUTPUTS)
    assert [len(axis.get_lines()) for axis in axes] == [1] * len(axes)
    curve = axes[0].get_lines()[0]
    expected = np.abs(system()(2j * np.pi * np.asarray(curve.get_xdata()))[0])
    assert np.asarray(curve.get_ydata()) == pytest.approx(np.ravel(expected))


def test_root_locus_has_the_poles_of_every_speed():
    speeds = [10.0, 20.0, 40.0]
    axes = draw(root_locus_picture([system(speed) for speed in speeds], speeds)).get_axes()
    colormaps = pytest.importorskip("matplotlib").colormaps
    dots = [line for line in axes[0].get_lines() if line.get_marker() == "o"]
    for speed, line, shade in zip(speeds, dots, (0.0, 1.0 / 3.0, 1.0), strict=True):
        assert line.get_color() == colormaps["viridis"](shade)
        shown = np.asarray(line.get_xdata()) + 1j * np.asarray(line.get_ydata())
        for pole in system(speed).poles():
            if pole.imag > 0 and speed > 10.0:
                assert np.abs(shown - pole).min() < 1e-9
    assert "roll" in [text.get_text() for text in axes[0].texts]
    low, high = axes[1].get_ylim()
    assert (low, high) == pytest.approx((36.0, 144.0))


def test_names_of_rays_stand_beyond_every_pole_that_is_drawn():
    (panel,), limit_1ps = root_locus_picture([system()], [20.0]).panels, 2.0 * math.pi * LOCUS_LIMIT_Hz
    assert isinstance(panel, Panel)
    rays = [(x, y) for x, y, text in panel.notes if text in {f"{ray:g}" for ray in DAMPING_RAYS}]
    assert len(rays) == len(DAMPING_RAYS)
    # A name hangs below its point, by up to 7 % of the limit on a phone.
    assert all(math.hypot(x, y - 0.07 * limit_1ps) > limit_1ps for x, y in rays)
    assert max(y for _, y in rays) < draw(Picture("", [panel])).get_axes()[0].get_ylim()[1]


def test_poles_are_joined_to_the_nearest_ones_of_the_next_speed():
    speeds = [20.0, 25.0, 40.0]
    panel = root_locus_picture([system(speed) for speed in speeds], speeds).panels[0]
    assert isinstance(panel, Panel)
    (path,) = [curve for curve in panel.curves if curve.colour == "#888888"]
    expected = [complex(max(system(speed).poles(), key=np.imag)) for speed in speeds]
    assert np.asarray(path.x) + 1j * np.asarray(path.y) == pytest.approx(expected)


def test_page_has_a_row_for_each_mode_and_all_panels():
    modes = [
        Mode(
            "yaw/sideslip", complex(-3.0, 4.0), {"yaw": 0.99, "drive": 0.001}, np.ones(1, complex), np.ones(1, complex)
        )
    ]
    pictures = bode_picture("a", system()), root_locus_picture([system()], [20.0])
    page = modes_page("car", modes, *pictures)
    assert page.sections[-1].tables[0].rows == [
        ["yaw/sideslip", "0.80", "0.60", "-3.00 \N{PLUS-MINUS SIGN} 4.00i", "yaw 99 %"]
    ]
    assert render_page(page).count('class="plots"') == 2
    verdict, least, _ = page.lead
    assert "stable" in verdict
    assert least.startswith(
        "The least damped mode is yaw/sideslip, with a natural frequency of 0.80 Hz and a damping ratio"
    )


def test_a_page_begins_with_what_is_unstable():
    grows = Mode("yaw/sideslip", complex(0.1, 4.0), {"yaw": 1.0}, np.ones(1, complex), np.ones(1, complex))
    page = modes_page("car", [grows], bode_picture("a", system()), root_locus_picture([system()], [20.0]))
    assert "unstable: yaw/sideslip" in page.lead[0]


def test_the_loop_of_the_driver_is_judged_by_what_is_asked():
    rows = [
        {"controller": name, "speed_kmh": 80.0, "phase_margin_deg": margin, "damping": 0.4, "damping_in_run": damping}
        for name, margin, damping in (("none", 41.0, 1.0), ("ars", 27.2, 0.3), ("afs", float("nan"), 0.24))
    ]
    margin, linear, in_run = map(Markup.striptags, map(Markup, conclusion(rows)))
    least = "The smallest phase margin is \N{BALLOT X} 27 deg with ars at 80 km/h"
    assert margin == f"{least}; the typical driver must reach 30 deg."
    assert "\N{CHECK MARK} 0.40" in linear
    assert "\N{BALLOT X} 0.24 with afs" in in_run
    # A damping is asked from 80 to 100 km/h only.
    _, linear, _ = conclusion([*rows, rows[0] | {"speed_kmh": 140.0, "damping": 0.1}])
    assert "The smallest damping ratio of the linear loop from 80 to 100 km/h is " in linear
    assert "\N{CHECK MARK} 0.40" in linear


@pytest.mark.parametrize(("rest_m", "mark"), [(0.0212, "\N{CHECK MARK}"), (0.12, "\N{BALLOT X}")])
def test_runs_that_stop_short_of_the_path_are_not_said_to_reach_it(rest_m, mark):
    row = {"controller": "none", "speed_kmh": 80.0, "phase_margin_deg": 41.0, "damping": 0.4, "damping_in_run": 1.0}
    *_, in_run = conclusion([row | {"rest_in_run_m": 0.001}, row | {"rest_in_run_m": rest_m}])
    words = "After a step of the path by 0.5 m, no run crosses the path. The cars end "
    assert Markup(in_run).striptags() == f"{words}{mark} at most {rest_m:.2f} m from it after 7 s."


def test_figure_2_draws_a_model_only_where_it_has_the_channel(figures, tmp_path):
    run = step_steer()
    figure_2(run, tmp_path / "f.png", {"single-track model": {"yaw_rate_radps": 0.2 * np.ones(len(run.time_s))}})
    yaw, roll = figures[0].get_axes()
    assert [line.get_label() for line in yaw.get_lines()] == ["multibody car", "single-track model"]
    assert [line.get_label() for line in roll.get_lines()] == ["multibody car"]
    assert float(yaw.get_lines()[1].get_ydata()[-1]) == pytest.approx(np.degrees(0.2))
    assert float(roll.get_lines()[0].get_ydata()[-1]) == pytest.approx(np.degrees(0.04), rel=1e-3)

"""The paper's figures: their list, their content, and their files."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

from activesteer.analysis import figures
from activesteer.analysis.figures import (
    BY_SCENARIO,
    draw_all,
    figure_11,
    figure_for,
    over_time,
    tracks,
)
from activesteer.core.conventions import run_looks
from activesteer.errors import ParameterError, RecordingError
from activesteer.road.course import CONE_RADIUS_M
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters
from activesteer.theory.tolerance import tolerance
from tests.raising import raises
from tests.unit.analysis.synthetic import (
    COMPLETION_S,
    LANES,
    VEHICLE,
    along_path,
    offset_track,
    sine_with_dwell,
    step_steer,
)

pytest.importorskip("matplotlib")

from matplotlib.patches import Ellipse, Polygon, Rectangle

FIGURE_13 = BY_SCENARIO["sine_with_dwell"]["figure_13_sine_with_dwell"]
LATERAL_RESPONSE = BY_SCENARIO["slalom"]["figure_21_slalom_response"]
CONES = tuple((x, y) for _, start, end, right, left in LANES for x in (start, end) for y in (right, left))


def lane_changes(**words):
    return {
        "none": along_path(lambda x: 1.2 * offset_track(x), path=offset_track, cones=CONES, **words),
        "ars": along_path(cones=CONES, **words),
        "afs": along_path(lambda x: 0.9 * offset_track(x), path=offset_track, cones=CONES, **words),
    }


def sines():
    return {"none": sine_with_dwell(), "ars": sine_with_dwell(rear_rad=0.02), "afs": sine_with_dwell()}


@pytest.mark.usefixtures("figures")
def test_only_the_figures_that_there_are_runs_for_are_drawn(tmp_path):
    paths = draw_all({"step_steer": {"ars": step_steer()}, "parking": {"none": step_steer()}}, tmp_path)
    assert [path.name[:9] for path in paths[::3]] == ["figure_07", "figure_09", "figure_11"]


@pytest.mark.parametrize("recordings", [{}, {"parking": {"none": step_steer()}}, {"slalom": {}}])
def test_nothing_to_draw_is_an_error(recordings, tmp_path):
    with raises(ParameterError, allowed=tuple(BY_SCENARIO)):
        draw_all(recordings, tmp_path)


def test_tracks_are_those_of_the_front_axle_with_cones_lanes_and_a_stated_scale():
    runs = lane_changes()
    axis = tracks.track_figure(runs).get_axes()[0]
    lines = {line.get_label(): line for line in axis.get_lines()}
    for label, system in (("1 no control", "none"), ("3 active front steering", "afs")):
        drawn = np.asarray(lines[label].get_xydata())
        assert drawn[:, 1].max() == pytest.approx(runs[system]["front_axle_y_m"].max())
    assert sum(isinstance(patch, Rectangle) for patch in axis.patches) == len(LANES)
    # A lane is measured between its cones: they stand outside it.
    cones = {patch.center: (patch.width, patch.height) for patch in axis.patches if isinstance(patch, Ellipse)}
    outside = [
        (x, y + (CONE_RADIUS_M if y == left else -CONE_RADIUS_M))
        for _, start, end, right, left in LANES
        for x in (start, end)
        for y in (right, left)
    ]
    assert sorted(cones) == [pytest.approx(place) for place in sorted(outside)]
    assert set(cones.values()) == {(2.0 * CONE_RADIUS_M, 2.0 * CONE_RADIUS_M)}
    assert f"stretched {axis.get_aspect():.0f} times" in axis.get_ylabel()


def test_bodies_cover_the_road_in_their_width_along_their_tracks_and_cones_they_hit_are_crossed_out():
    runs = {"none": along_path(cones=((45.0, 0.5), (45.0, 3.0)))}
    axis = tracks.track_figure(runs).get_axes()[0]
    (covered,) = [patch.get_xy()[:-1] for patch in axis.patches if isinstance(patch, Polygon)]
    left, right = covered[: len(covered) // 2], covered[: len(covered) // 2 - 1 : -1]
    assert np.linalg.norm(left - right, axis=1) == pytest.approx(1.8)
    # The front of the body is 0.85 m ahead of the front axle, whose centre runs along the track.
    track = np.asarray(axis.get_lines()[0].get_xydata())
    assert np.linalg.norm(0.5 * (left + right) - track, axis=1) == pytest.approx(0.85)
    (struck,) = [line for line in axis.get_lines() if line.get_marker() == "x"]
    assert np.asarray(struck.get_xydata()).tolist() == [[45.0, 0.5]]


@pytest.mark.parametrize("draw", [FIGURE_13, LATERAL_RESPONSE, tracks.track_figure])
def test_curves_are_told_apart_in_grey_by_their_dashes(draw):
    runs = sines() if draw is FIGURE_13 else lane_changes()
    axis = draw(runs).get_axes()[0]
    styles = {line.get_label(): str(line._unscaled_dash_pattern) for line in axis.get_lines()}
    assert len({styles[look.label] for look in run_looks(runs).values()}) == 3


def test_a_car_that_spins_is_shown_whole_in_an_inset_and_does_not_set_the_scale():
    runs = sines() | {"none": sine_with_dwell(sideslip_rad=math.radians(60.0))}
    (sideslip,) = [axis for axis in FIGURE_13(runs).get_axes() if "sideslip" in axis.get_ylabel()]
    low, high = sideslip.get_ylim()
    assert math.degrees(0.05) < high - low < 25.0
    (inset,) = sideslip.child_axes
    assert max(float(np.max(np.asarray(line.get_ydata()))) for line in inset.get_lines()) == pytest.approx(
        60.0, rel=0.01
    )
    others = {"ars": runs["ars"], "afs": runs["afs"]}
    assert all(not axis.child_axes for axis in FIGURE_13(others).get_axes())


def test_panels_over_time_are_in_degrees_with_units_at_the_axes():
    figure = BY_SCENARIO["slalom"]["figure_20_slalom_steering"](lane_changes(yaw_rate=0.2))
    steering, yaw_rate = figure.get_axes()
    assert "[deg]" in steering.get_ylabel()
    assert "[deg/s]" in yaw_rate.get_ylabel()
    assert "[s]" in yaw_rate.get_xlabel()
    assert np.max(np.asarray(yaw_rate.get_lines()[0].get_ydata())) == pytest.approx(np.degrees(0.2), rel=1e-3)
    assert [text.get_text()[0] for text in figure.legends[0].get_texts()] == ["1", "2", "3"]


def test_added_angles_are_drawn_of_systems_that_add_any_and_not_at_all_where_none_does():
    assert len(FIGURE_13(sines()).get_axes()) == 4
    alone = FIGURE_13({"none": sine_with_dwell()})
    assert [axis.get_ylabel() for axis in alone.get_axes() if "added" in axis.get_ylabel()] == []


def test_the_instants_of_the_standard_are_marked_from_the_completion_of_steer():
    axis = FIGURE_13(sines()).get_axes()[0]
    lines = [np.asarray(line.get_xdata(), dtype=float) for line in axis.get_lines()]
    marks = sorted(float(x[0]) for x in lines if x.size == 2)
    assert marks == pytest.approx([COMPLETION_S, COMPLETION_S + 1.0, COMPLETION_S + 1.75], abs=0.02)


@pytest.mark.parametrize("kind", ["step_steer", "sine_with_dwell", "lane_change", "slalom", "follow_path", "parking"])
def test_every_kind_has_a_figure(kind, figures, tmp_path):
    runs = {"none": sine_with_dwell()} if kind in {"sine_with_dwell", "parking"} else lane_changes()
    if kind == "step_steer":
        runs = {"none": step_steer()}
    assert figure_for(kind)(runs, tmp_path / "figure.png").exists()
    assert all(axis.get_lines() for axis in figures[0].get_axes())


@pytest.mark.usefixtures("figures")
def test_a_path_without_gates_can_be_drawn(tmp_path):
    run = along_path(kind="follow_path", lanes=(), last_gate_m=None)
    assert figure_for("follow_path")({"none": run}, tmp_path / "figure.png").exists()


def test_figure_7_shows_the_predicted_angle_and_how_much_of_it_is_used():
    axis = figures.figure_7(step_steer()).get_axes()[0]
    speed_kmh = np.asarray(axis.get_lines()[1].get_xdata())
    predicted, used = (np.asarray(line.get_ydata()) for line in axis.get_lines()[1:3])
    single_track = SingleTrack(SingleTrackParameters(**VEHICLE["single_track"]))
    np.testing.assert_allclose(predicted, [single_track.rear_prediction(v / 3.6)[0] for v in speed_kmh])
    np.testing.assert_allclose(used, 0.1 * predicted)
    assert predicted[0] < 0.0 < predicted[-1]


def test_figure_9_shows_the_tolerance_function_of_the_controllers():
    line = figures.figure_9(step_steer()).get_axes()[0].get_lines()[0]
    errors = np.radians(np.asarray(line.get_xdata()))
    np.testing.assert_allclose(
        np.asarray(line.get_ydata()), [tolerance(error, 0.002, 0.005) for error in errors], atol=1e-9
    )


@pytest.mark.parametrize(
    ("draw", "keys", "value"),
    [
        (figures.figure_7, ("single_track", "mass_kg"), "heavy"),
        (figures.figure_7, ("single_track", "mass_kg"), -1.0),
        (figures.figure_7, ("single_track", "rear_stiffness_Nprad"), 1.0),  # a car that oversteers
        (figures.figure_7, ("controllers", "ars", "prediction_gain"), "all"),
        (figures.figure_9, ("controllers", "afs", "corrector", "deadband_start_radps"), math.nan),
        (figures.figure_9, ("controllers", "afs", "corrector"), [0.1, 0.2]),
    ],
)
def test_damaged_parameters_are_refused(draw, keys, value):
    run = step_steer()
    vehicle = run.metadata["vehicle"] = copy.deepcopy(VEHICLE)
    table = vehicle
    for key in keys[:-1]:
        table = table[key]
    table[keys[-1]] = value
    with pytest.raises(RecordingError):
        draw(run)


@pytest.mark.parametrize(("draw", "key"), [(figures.figure_7, "single_track"), (figures.figure_9, "controllers")])
def test_missing_parameters_are_named(draw, key):
    run = step_steer()
    run.metadata["vehicle"] = {name: table for name, table in VEHICLE.items() if name != key}
    with raises(RecordingError, file="the metadata", key=f"vehicle.{key}"):
        draw(run)


def named(figure):
    """Return the texts of the legend above all axes."""
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def both_angles():
    run = step_steer(rear_rad=-0.01)
    for name in ("superposition_rad", "superposition_demand_rad"):
        run.channels[name] = -0.5 * run["rear_steer_rad"]
    return run


@pytest.mark.parametrize("draw", [figure_11, over_time.time_figure])
def test_angles_added_at_both_axles_are_two_kinds_of_line(draw):
    run = both_angles()
    figure = draw({"lqr": run})
    peaks = {}
    for axis in figure.get_axes():
        for line in axis.get_lines():
            values = np.abs(np.asarray(line.get_ydata()))
            for name in ("rear_steer_rad", "superposition_rad"):
                if values.max() == pytest.approx(math.degrees(np.abs(run[name]).max())):
                    peaks[name] = str(line._unscaled_dash_pattern)
    assert len(set(peaks.values())) == 2
    assert "added in front" in named(figure)
    assert "added in front" not in named(draw({"ars": step_steer(rear_rad=-0.01)}))


def test_phases_have_borders_and_names():
    runs = {"none": step_steer(), "ars": step_steer(rear_rad=-0.01)}
    for run, later_s in zip(runs.values(), (1.4, 1.6), strict=True):
        phases = (("straight", 0.0), ("turn", 1.0), ("brake", later_s))
        run.metadata["events"] = [{"time_s": at, "kind": "phase", "what": name} for name, at in phases]
    figure = over_time.time_figure(runs)
    for axis in figure.get_axes():
        upright = [line for line in axis.get_lines() if np.ptp(np.asarray(line.get_xdata())) == 0.0]
        # The border that both runs share is one line, the other border has the colour of each run.
        assert sorted(float(np.asarray(line.get_xdata())[0]) for line in upright) == [1.0, 1.4, 1.6]
        assert len({line.get_color() for line in upright}) == 3
    texts = [text.get_text() for text in figure.get_axes()[0].texts]
    assert texts == ["straight", "turn", "brake"]


def test_the_beginning_of_braking_has_a_border():
    run = step_steer()
    run.metadata["maneuver"]["brake"] = {"pedal": 0.4}
    run.channels["brake_pedal"] = np.where(run.time_s >= 2.0, 0.4, 0.0)
    axis = over_time.time_figure({"none": run}).get_axes()[0]
    (border,) = [line for line in axis.get_lines() if np.ptp(np.asarray(line.get_xdata())) == 0.0]
    assert float(np.asarray(border.get_xdata())[0]) == pytest.approx(2.0, abs=0.011)
    assert [text.get_text() for text in axis.texts] == ["brake"]


def test_rounding_noise_does_not_fill_a_panel():
    run = step_steer()
    run.channels["roll_rad"] = 1e-14 * np.sin(50.0 * run.time_s)
    (roll,) = [axis for axis in over_time.time_figure({"none": run}).get_axes() if "roll" in axis.get_ylabel()]
    low, high = roll.get_ylim()
    assert high - low == pytest.approx(over_time.PANELS["roll"].quantity.min_span)


def test_another_friction_on_the_way_is_shaded_and_named():
    run = step_steer()
    for corner in ("fl", "fr", "rl", "rr"):
        run.channels[f"{corner}_mu"] = np.where((run.time_s > 1.0) & (run.time_s < 1.5), 0.3, 0.9)
    figure = over_time.time_figure({"none": run})
    for axis in figure.get_axes():
        (shade,) = axis.patches
        box = shade.get_extents().transformed(axis.transData.inverted())
        assert (box.x0, box.x1) == pytest.approx((1.0, 1.5), abs=0.02)
    assert "friction 0.3" in named(figure)


def test_a_track_shows_the_places_with_another_friction():
    run = along_path()
    run.metadata["maneuver"]["road"] = {"mu": 0.9, "patches": [{"start_m": 20.0, "end_m": 30.0, "mu": 0.3}]}
    figure = tracks.track_figure({"none": run})
    (patch,) = [patch for patch in figure.get_axes()[0].patches if patch.get_label() == "_friction 0.3"]
    assert isinstance(patch, Polygon)
    assert set(patch.get_xy()[:, 0].tolist()) == {20.0, 30.0}
    assert "friction 0.3" in named(figure)

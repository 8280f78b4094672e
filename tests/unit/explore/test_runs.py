"""Runs for the sliders: equal to the command that the page shows, and dropped when a newer choice waits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer.analysis.report.run_page import report_page
from activesteer.errors import ParameterError
from activesteer.explore.choice import Folder
from activesteer.explore.messages import Describe, RunRequest
from activesteer.explore.runs import Reply, Runs
from activesteer.resources import find_maneuver, list_maneuvers

OWN = (Path(__file__).parents[3] / "examples" / "own_controller.py").read_text("utf-8")
SEARCHING = ("brake_in_turn", "fishhook", "sine_with_dwell", "step_steer", "split_mu_braking")
"""A manoeuvre of each kind with a search, and one on a road of two sides."""
CHOICE: dict[str, Any] = {"maneuver": "step_steer", "controllers": ("none", "ars")}


def test_a_run_of_the_page_is_the_run_of_its_command(tmp_path: Path) -> None:
    runs = Runs(Folder(tmp_path))
    replies = list(runs.run(RunRequest(**CHOICE, values={"speed_kmh": 90.0}), lambda: False))
    assert [reply.header["kind"] for reply in replies] == ["run", "run", "finished"]
    assert replies[-1].header["command"] == "activesteer run step_steer -c none -c ars --set speed_kmh=90"
    again = activesteer.simulate("step_steer", "ars", overrides={"speed_kmh": 90.0})
    runs.save()
    saved = activesteer.Recording.open(tmp_path / "step_steer-ars.mcap")
    assert replies[0].header["title"] == saved.metadata["maneuver"]["title"] == "Step steer, 90 km/h, 0.4 g, dry"
    np.testing.assert_allclose(saved["yaw_rate_radps"], again["yaw_rate_radps"], atol=1e-6)  # stored with 32 bits
    yaw = next(panel for panel in replies[1].header["plots"]["panels"] if panel["title"] == "Yaw rate")
    assert yaw["series"][0]["values"][-1] == pytest.approx(math.degrees(again["yaw_rate_radps"][-1]), abs=0.05)


def test_a_moving_slider_holds_the_amplitude_and_a_resting_one_searches_it(tmp_path: Path) -> None:
    runs, amplitudes, titles = Runs(Folder(tmp_path)), [], []
    for speed, dragging in ((80.0, False), (100.0, True), (100.0, False)):
        (run, _) = runs.run(
            RunRequest(maneuver="step_steer", dragging=dragging, values={"speed_kmh": speed}), lambda: False
        )
        wheel = next(panel for panel in run.header["plots"]["panels"] if panel["title"].startswith("Steering wheel"))
        amplitudes.append(wheel["series"][0]["values"][-1])
        titles.append(run.header["title"])
    assert amplitudes[1] == pytest.approx(amplitudes[0], rel=1e-3)  # the column twists a little
    assert amplitudes[2] < 0.9 * amplitudes[0]  # 0.4 g needs less steering at a higher speed
    assert ["amplitude as before" in title for title in titles] == [False, True, False]


def test_a_run_has_the_times_on_a_slippery_patch(tmp_path: Path) -> None:
    runs = Runs(Folder(tmp_path))
    (jump, _) = runs.run(RunRequest(maneuver="mu_jump"), lambda: False)
    ((begin_s, end_s),) = jump.header["patches_s"]
    (recording,) = runs.driven().values()
    on = recording.time_s[recording["fr_mu"] < 0.5]
    assert begin_s == pytest.approx(on[0], abs=1e-3)
    assert end_s > on[-1]  # the rear wheels leave it later
    (step, _) = runs.run(RunRequest(maneuver="step_steer"), lambda: False)
    assert step.header["patches_s"] == []


def test_a_car_that_does_not_follow_a_step_has_no_response_times_and_a_remark(tmp_path: Path) -> None:
    runs = Runs(Folder(tmp_path))
    for values, turns in (({"road.mu": 0.1, "speed_kmh": 160.0}, False), ({}, True)):
        (run, _) = runs.run(RunRequest(maneuver="step_steer", values=values), lambda: False)
        figures = {figure["title"]: figure["value"] for figure in run.header["figures"]}
        for title in ("Yaw rate response time", "Yaw rate overshoot"):
            assert (figures[title] is not None) == turns
        assert figures["Steady-state yaw rate"] is not None
        assert (run.header["remark"] == "") == turns
        page = report_page(runs.driven())
        assert ("does not follow the steering" in page) == (not turns)
        assert ("yaw rate overshoot</span>" in page) == turns  # rows that no run has are left out


@pytest.mark.parametrize(
    ("maneuver", "key", "values"),
    [
        ("sine_with_dwell", "steer.steering_wheel_deg", {"road.mu": 0.35, "steer.amplitude_factor": 4.0}),
        pytest.param("step_steer", "steer.steering_wheel_deg", {"road.mu": 0.2}, marks=pytest.mark.slow),
        ("fishhook", "reference_angle_deg", {"road.mu": 0.3}),
        ("brake_in_turn", "turn.steering_wheel_deg", {"road.mu": 0.3}),
    ],
)
def test_a_search_that_fails_keeps_the_amplitude_which_command_and_title_give(
    maneuver: str, key: str, values: dict[str, float], tmp_path: Path
) -> None:
    def steering(run: Reply) -> Any:
        wheel = next(panel for panel in run.header["plots"]["panels"] if panel["title"].startswith("Steering wheel"))
        return wheel["series"][0]["values"]

    runs = Runs(Folder(tmp_path))
    choice = {"maneuver": maneuver, "controllers": ("none",)}
    (dry, _) = runs.run(RunRequest(**choice), lambda: False)
    (held, _) = runs.run(RunRequest(**choice, values=values, dragging=True), lambda: False)
    (kept, done) = runs.run(RunRequest(**choice, values=values), lambda: False)
    assert steering(kept) == pytest.approx(steering(held), abs=0.02)
    assert "search for the amplitude fails" in kept.header["note"]
    assert dry.header["note"] == held.header["note"] == ""
    angle = float(done.header["command"].partition(f"{key}=")[2].split()[0])
    assert "dry" not in kept.header["title"]
    if maneuver != "fishhook":  # its title is in words
        assert f"{angle:.3g} deg" in kept.header["title"]
        assert f" {angle:.0f} deg" in kept.header["note"]
    if factor := values.get("steer.amplitude_factor"):  # the slider of the factor still moves the amplitude
        assert f"A, the steering wheel angle at 0.3 g, stays at {angle / factor:.1f} deg" in kept.header["note"]
        assert held.header["a_deg"] == pytest.approx(angle / factor, rel=1e-5)
        more = {**values, "steer.amplitude_factor": factor + 1.0}
        (run, done) = runs.run(RunRequest(**choice, values=more), lambda: False)
        now = float(done.header["command"].partition(f"{key}=")[2].split()[0])
        assert now == pytest.approx(angle * (factor + 1.0) / factor, rel=1e-5)  # the command gives six digits
        assert f"stays at {angle / factor:.1f} deg" in run.header["note"]
    repeated = {**values, key: angle}
    repeated.pop("steer.amplitude_factor", None)
    again = activesteer.simulate(maneuver, "none", overrides=repeated)
    assert math.degrees(np.abs(again["steering_wheel_rad"]).max()) == pytest.approx(
        np.abs(np.array(steering(kept), float)).max(), abs=0.05
    )


@pytest.mark.parametrize(
    "maneuver",
    [pytest.param(name, marks=[] if name in SEARCHING else pytest.mark.slow) for name in list_maneuvers()],
)
def test_every_manoeuvre_starts_and_holds_what_its_search_found_while_a_slider_moves(maneuver: str, tmp_path: Path):
    runs = Runs(Folder(tmp_path))
    sliders = {slider["key"]: slider for slider in runs.describe(Describe(maneuver=maneuver)).header["sliders"]}
    # The run itself is dropped: a newer choice waits.
    for dragging in (False, True):
        assert list(runs.run(RunRequest(maneuver=maneuver, dragging=dragging), lambda: True)) == []
    # No slider that can only fail: a road of two sides has its friction there.
    for key in [key for key in sliders if key.startswith("road.mu")]:
        assert list(runs.run(RunRequest(maneuver=maneuver, values={key: 0.55}), lambda: True)) == []
    assert ("road.mu" in sliders) != ("road.mu_left" in sliders)


def test_what_has_failed_leaves_nothing_to_save_and_a_command_names_the_controllers_that_drove(tmp_path: Path) -> None:
    runs = Runs(Folder(tmp_path))
    *_, done = runs.run(RunRequest(maneuver="step_steer", controllers=("none", "tv"), driver="novice"), lambda: False)
    assert "-c none" in done.header["command"]
    assert "tv" not in done.header["command"]  # this car has no electric axle
    assert len(runs.save().header["files"]) == 1
    with pytest.raises(ParameterError, match="must be"):
        list(runs.run(RunRequest(maneuver="step_steer", values={"road.mu": 9.0}), lambda: False))
    with pytest.raises(ParameterError, match="no run to save"):
        runs.save()


def test_a_driver_is_offered_where_one_steers(tmp_path: Path) -> None:
    runs = Runs(Folder(tmp_path))
    assert runs.describe(Describe(maneuver="sine_with_dwell")).header["steered"]
    assert not runs.describe(Describe(maneuver="slalom")).header["steered"]


def test_a_run_that_is_lost_says_so_beside_its_figures(tmp_path: Path) -> None:
    choice = RunRequest(maneuver="sine_with_dwell", controllers=("none", "ars"))
    lost, held, _ = (reply.header for reply in Runs(Folder(tmp_path)).run(choice, lambda: False))
    assert lost["losses"] == ["lost with a sideslip angle of 45 deg"]
    assert held["losses"] == []


def test_a_car_that_turns_round_has_its_sideslip_within_half_a_turn_and_no_figures(tmp_path: Path) -> None:
    choice = RunRequest(maneuver="sine_with_dwell", controllers=("none",), values={"steer.amplitude_factor": 8.0})
    runs = Runs(Folder(tmp_path))
    run, _ = runs.run(choice, lambda: False)
    runs.save()
    recorded_deg = np.degrees(activesteer.Recording.open(tmp_path / "sine_with_dwell-none.mcap")["sideslip_rad"])
    assert np.abs(np.unwrap(recorded_deg, period=360.0)).max() > 185.0  # it turns round
    panel = next(panel for panel in run.header["plots"]["panels"] if panel["title"] == "Sideslip angle")
    drawn = np.array(panel["series"][0]["values"], float)
    assert np.nanmax(np.abs(drawn)) <= 180.0
    assert drawn[0] == pytest.approx(recorded_deg[0], abs=0.1)
    assert drawn[-1] == pytest.approx(recorded_deg[-1], abs=0.5)  # the last one that is drawn
    assert 0 < np.isnan(drawn).sum() <= 3  # a gap, and not a line across the plot
    figures = {figure["title"]: figure for figure in run.header["figures"]}
    assert figures["Largest sideslip angle"]["lost"]
    assert figures["Largest sideslip angle"]["value"] is None


def test_runs_are_saved_once_until_they_change_or_their_file_is_gone(tmp_path: Path) -> None:
    runs, choice = Runs(Folder(tmp_path)), RunRequest(maneuver="step_steer", controllers=("none",))
    list(runs.run(choice, lambda: False))
    assert runs.save().header["files"] == ["step_steer-none.mcap"]
    again = runs.save().header
    assert (again["files"], again["exist"]) == ([], ["step_steer-none.mcap"])
    (tmp_path / "step_steer-none.mcap").unlink()
    assert runs.save().header["files"] == ["step_steer-none.mcap"]
    list(runs.run(choice, lambda: False))
    assert runs.save().header["files"] == ["step_steer-none_2.mcap"]


def test_room_to_the_edge_of_the_lane_is_positive_inside(tmp_path: Path) -> None:
    runs = Runs(Folder(tmp_path))
    run, _ = runs.run(RunRequest(maneuver="double_lane_change", controllers=("ars",)), lambda: False)
    room = next(figure for figure in run.header["figures"] if figure["title"] == "Room to the edge of the lane")
    runs.save()
    (path,) = tmp_path.glob("*.mcap")
    assert room["value"] == pytest.approx(-activesteer.Recording.open(path).metrics["lane_overstep_m"])


def test_a_newer_choice_drops_the_rest_of_the_runs(tmp_path: Path) -> None:
    looks = iter([False] * 3 + [True] * 10)
    assert list(Runs(Folder(tmp_path)).run(RunRequest(**CHOICE), lambda: next(looks))) == []


def test_the_road_under_the_cars_is_the_one_that_they_drive_on(tmp_path: Path) -> None:
    """The kerb of 60 mm, sent once: not with the second run, nor while a slider moves, nor for a plane road."""

    def driven(*controllers: str, dragging: bool = False, maneuver: str = "kerb_strike") -> list[Reply]:
        choice = RunRequest(maneuver=maneuver, controllers=controllers, dragging=dragging)
        return [reply for reply in Runs(Folder(tmp_path)).run(choice, lambda: False) if reply.header["kind"] == "run"]

    first, second = driven("none", "ars")
    _, corners_m, factors, triangles = first.arrays
    assert corners_m[:, 2].min() == 0.0
    assert corners_m[:, 2].max() == pytest.approx(0.06)
    assert first.header["ground_m"] < 0.0
    top = corners_m[:, 2] > 0.05
    assert factors[~top & (corners_m[:, 2] == 0.0)] == pytest.approx(1.0)
    assert (factors[top] > 1.1).any(axis=1).all()
    assert triangles.max() == len(corners_m) - 1
    assert "ground_m" not in second.header
    assert len(second.arrays) == 1
    assert "ground_m" not in driven("none", dragging=True)[0].header
    plane = driven("none", maneuver="straight_line")[0]
    assert (plane.header["ground_m"], len(plane.arrays)) == (0.0, 1)


def test_the_shape_of_the_car_covers_its_length_and_stands_on_four_wheels(tmp_path: Path) -> None:
    reply = Runs(Folder(tmp_path)).describe(Describe(**CHOICE))
    panels, points = reply.header["shape"]["panels"], reply.arrays[::2]
    body = np.concatenate([at for panel, at in zip(panels, points, strict=True) if panel["body"] == "chassis"])
    assert 3.5 < np.ptp(body[:, 0]) < 5.2
    assert {panel["body"] for panel in panels} >= {"fl_wheel", "fr_wheel", "rl_wheel", "rr_wheel"}


def test_a_count_has_no_decimals_and_groups_of_gains_are_named_in_words(tmp_path: Path) -> None:
    choice: dict[str, Any] = {"maneuver": "slalom", "controllers": ("ars",)}
    runs = Runs(Folder(tmp_path))
    figures = next(iter(runs.run(RunRequest(**choice), lambda: False))).header["figures"]
    assert {figure["title"]: figure["digits"] for figure in figures}["Cones hit"] == 0
    assert {figure["title"]: figure["digits"] for figure in figures}["Largest sideslip angle"] is None
    sliders = {slider["key"]: slider for slider in runs.describe(Describe(**choice)).header["sliders"]}
    groups = {slider["group"] for slider in sliders.values()}
    assert {"ARS", "desired yaw rate", "control unit and bus"} <= groups
    assert not any("_" in group for group in groups)
    assert "controllers" not in groups
    # The heading of the group is not repeated in each label.
    assert sliders["controllers.ars.corrector.proportional_gain_s"]["label"] == "corrector: proportional gain"
    assert sliders["controllers.ars.prediction_gain"]["label"] == "prediction gain"


def test_a_quantity_has_one_slider_and_a_standing_start_none(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(find_maneuver("step_steer").read_text("utf-8"))
    (tmp_path / "damper.py").write_text(OWN)
    runs = Runs(Folder(tmp_path))
    choice = Describe(maneuver="own.toml", controllers=("damper.py:YawDamper",))
    sliders = {slider["key"]: slider for slider in runs.describe(choice).header["sliders"]}
    assert [key for key in sliders if "lateral_acceleration" in key and key.startswith("steer")] == [
        "steer.lateral_acceleration_mps2"
    ]
    assert sliders["controllers.YawDamper.gain_s"]["group"] == "yaw damper"
    assert sliders["controllers.YawDamper.gain_s"]["label"] == "gain"
    standing = runs.describe(Describe(maneuver="start_stop", controllers=("none",))).header["sliders"]
    assert "speed_kmh" not in {slider["key"] for slider in standing}


def test_the_first_patch_of_a_road_is_named_in_words(tmp_path: Path) -> None:
    described = Runs(Folder(tmp_path)).describe(Describe(maneuver="mu_jump", controllers=("none",)))
    sliders = {slider["key"]: slider for slider in described.header["sliders"]}
    assert sliders["road.patches.0.mu"]["label"] == "first road patch: friction coefficient"

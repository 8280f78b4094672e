"""None"""

from __future__ import annotations

import json
import math
import re
from datetime import date
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer import simulate
from activesteer.analysis.metrics import key_figures_of
from activesteer.analysis.report import open_all, report_page, write_report
from activesteer.analysis.report.curves import MAX_SAMPLES, plots, time_grid
from activesteer.analysis.report.groups import MAX_RUNS, Group, groups_of, judge, outcome
from activesteer.analysis.report.run_page import key_figures, parameters, results
from activesteer.analysis.tables import Change, difference_text, number
from activesteer.core.metric_table import recorded_metric
from activesteer.core.signals import Channel
from activesteer.drawing.panels import EXPLORE, REPORT
from activesteer.errors import ParameterError, RecordingError
from activesteer.recording import Recording
from activesteer.road.course import CONE_RADIUS_M
from tests.raising import raises
from tests.unit.analysis.synthetic import along_path, offset_track, step_steer
from tests.unit.analysis.synthetic_files import lane_changes, recording_of, sines, step_steers
from tests.unit.playback.synthetic import circle

MADE = date(2026, 1, 2)
VOID = {"meta", "link", "br"}


class Page(HTMLParser):
    """Parser of a page: its text, its links, and the order of its opened and closed elements."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.addresses: list[str] = []
        self.text: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(str(value))
            if name in {"src", "href", "srcset", "action", "data"}:
                self.addresses.append(str(value))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in {"script", "style"}:
            self.text.append(data)

    @property
    def words(self) -> str:
        plain = {"\N{NO-BREAK SPACE}": " ", "\N{MINUS SIGN}": "-", "\N{EN DASH}": "-"}
        return " ".join(" ".join(self.text).translate(str.maketrans(plain)).split())


def data_of(page: str) -> list[dict[str, Any]]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found

    def refuse(word: str) -> None:
        pytest.fail(f"{word} is not JSON")

    return json.loads(found[1], parse_constant=refuse)["groups"]


@pytest.fixture(scope="module")
def page() -> str:
    return report_page({**lane_changes(), **step_steers(), **sines()}, MADE)


def test_page_needs_nothing_but_itself(page):
    read = Page(page)
    assert all(address == "data:," or address.startswith("#") for address in read.addresses)
    assert {address[1:] for address in read.addresses if address.startswith("#")} <= set(read.ids)
    assert len(read.ids) == len(set(read.ids))
    styles = "".join(re.findall(r"<style>(.*?)</style>", page, re.DOTALL))
    assert "url(" not in styles
    assert "@import" not in styles
    assert "default-src 'none'" in page


def test_same_runs_give_the_same_page(page):
    assert report_page({**lane_changes(), **step_steers(), **sines()}, MADE) == page


def test_runs_are_grouped_by_manoeuvre_in_the_papers_order(page):
    words = Page(page).words
    assert "vehicle synthetic" in words
    assert "6 runs of 3 manoeuvres" in words
    data = data_of(page)
    assert [group["name"] for group in data] == ["step_steer", "sine_with_dwell", "cones"]
    assert [run["name"] for run in data[0]["runs"]] == ["none", "ars", "afs"]
    assert "Through <cones> & lanes" in words


def test_metrics_are_told_with_their_difference_to_the_first_run(page):
    words = Page(page).words
    # 0.25, 0.2 and 0.22 rad/s
    assert "peak yaw rate deg/s 14.32 11.46 -2.865 (-20 %) 12.61 -1.719 (-12 %)" in words


def told(group: Group) -> dict[str, dict[str, Any]]:
    return {found["run"].name: found for found in results(group)}


def through_cones(**metrics: dict[str, float]) -> Group:
    runs = {name: recording_of(step_steer(), name, metrics=values) for name, values in metrics.items()}
    return groups_of(runs)[0]


LANES_KEPT = {"stays_in_lanes": 1.0, "lane_overstep_m": -0.1, "cones_hit": 0.0, "sideslip_peak_abs_rad": 0.05}


def test_what_went_wrong_stands_at_the_top_in_words():
    lost = {"stays_in_lanes": 0.0, "lane_overstep_m": 1.324, "cones_hit": 1.0, "sideslip_peak_abs_rad": 0.8}
    found = told(through_cones(none=lost, ars=LANES_KEPT))
    assert found["none"]["losses"] == [
        "lost with a sideslip angle of 46 deg",
        "leaves the lane by 1.32 m",
        "hits 1 cone",
    ]
    assert found["ars"]["losses"] == []
    assert found["ars"]["kept"] == ["stays in the lanes", "hits no cone"]


def test_nothing_is_said_of_lanes_and_loss_where_the_manoeuvre_cannot_tell():
    found = told(through_cones(none={"stopping_distance_m": 40.0}))
    assert (found["none"]["losses"], found["none"]["kept"]) == ([], [])


def test_run_that_ended_early_is_a_loss():
    runs = {"a.mcap": recording_of(step_steer(), complete=False, error="SimulationDiverged: too much")}
    assert told(groups_of(runs)[0])["none"]["losses"] == ["incomplete"]


@pytest.mark.parametrize(
    ("metric", "first", "other", "change"),
    [
        ("cones_hit", 2.0, 1.0, Change.BETTER),
        ("sideslip_peak_rad", -0.02, 0.03, Change.WORSE),  # its magnitude counts
        ("sideslip_peak_rad", -0.0200, 0.0205, Change.SAME),  # 0.03 deg: no sensor could tell
        ("mean_deceleration_mps2", 5.0, 6.0, Change.BETTER),
        ("lane_overstep_m", -0.2, 0.2, Change.WORSE),
        ("yaw_rate_steady_state_radps", 0.2, 0.3, Change.OTHER),
    ],
)
def test_key_figures_are_better_or_worse_only_where_one_could_tell(metric, first, other, change):
    found = told(through_cones(none={metric: first}, ars={metric: other}))
    assert [figure["change"] for figure in found["ars"]["figures"]] == [change]
    assert found["none"]["figures"][0]["difference"] == ""


def test_an_exact_zero_is_no_difference_to_read():
    runs = {f"{name}.mcap": recording_of(step_steer(), name, metrics={"cones_hit": 2.0}) for name in ("none", "ars")}
    assert "\N{ALMOST EQUAL TO} 0" not in Page(report_page(runs)).words


def test_titles_of_key_figures_say_what_differs_from_the_metric():
    metrics = {"lane_overstep_m": -0.2, "yaw_rate_after_1750ms_share": -0.4, "heading_end_rad": -0.5}
    groups = through_cones(none=metrics)
    assert list(key_figures(groups)) == [
        "Room to the edge of the lane [m]", "Yaw rate remaining after 1.75 s, magnitude [%]",
        "Final heading, magnitude [deg]",
    ]  # fmt: skip
    assert [figure["text"] for figure in told(groups)["none"]["figures"]] == ["0.200", "40.00", "28.65"]
    assert list(key_figures(through_cones(none={"track_deviation_max_m": 1.0, "heading_end_rad": 0.1}))) == [
        "Largest track deviation [m]", "Final heading against the path, magnitude [deg]",
    ]  # fmt: skip
    assert list(key_figures(through_cones(none={"cones_hit": 1.0, "lap_time_s": math.nan}))) == ["Cones hit"]


def test_a_standing_car_has_no_key_figure_of_sideslip():
    rest = {"sideslip_peak_abs_rad": 0.0, "displacement_at_rest_m": 1e-5, "yaw_rate_peak_abs_radps": 0.0}
    assert list(key_figures_of(rest)) == ["Displacement at rest", "Largest yaw rate"]
    assert "Largest sideslip angle" in key_figures_of(["sideslip_peak_abs_rad", "yaw_rate_peak_abs_radps"])


def test_a_label_explains_the_name_that_a_run_has_in_all_tables():
    for names in (["ars"], ["none", "ars"]):
        runs = data_of(report_page({name: recording_of(step_steer(), name) for name in names}))[0]["runs"]
        assert runs[-1]["label"] == "ars: active rear steering"
    others = data_of(report_page({name: recording_of(step_steer(), name) for name in ("ars", "lqr")}))[0]["runs"]
    assert [run["label"] for run in others] == ["ars", "lqr"]


def test_no_change_is_good_or_bad_next_to_a_run_that_is_lost():
    lost, kept = {"sideslip_peak_rad": 0.9}, {"sideslip_peak_rad": 0.1}
    for runs in ({"none": lost, "ars": kept}, {"none": kept, "ars": lost}):
        (figure,) = told(through_cones(**runs))["ars"]["figures"]
        assert figure["difference"]
        assert figure["change"] is Change.OTHER


def test_no_change_is_good_or_bad_next_to_a_run_that_ended_early():
    runs = {
        "none.mcap": recording_of(step_steer(), "none", metrics={"yaw_rate_overshoot": 0.4}),
        "ars.mcap": recording_of(step_steer(), "ars", metrics={"yaw_rate_overshoot": 0.1}, complete=False, error="x"),
    }
    (figure,) = told(groups_of(runs)[0])["ars"]["figures"]
    assert figure["change"] is Change.OTHER


def test_numbers_are_whole_where_they_count_and_shares_are_of_something():
    assert number("cones_hit", 8.0) == "8"
    assert (number("stays_in_lanes", 1.0), number("stays_in_lanes", 0.0)) == ("yes", "no")
    assert (number("ay_peak_mps2", -1e-5), recorded_metric("ay_peak_mps2").text(-1e-5)) == ("0.000", "0.000")
    assert number("ay_peak_mps2", -3.0) == "\N{MINUS SIGN}3.000"
    assert difference_text("cones_hit", 10.0, 8.0) == ("+2", "")
    assert difference_text("sideslip_gates_rms_rad", 0.0002, 0.0001).percent == ""  # 0.006 deg are nearly nothing
    assert difference_text("yaw_rate_peak_radps", 0.2, 0.25).percent == "\N{MINUS SIGN}20\N{NO-BREAK SPACE}%"
    assert difference_text("yaw_rate_peak_radps", -0.2, -0.25).percent == ""  # 20 % more or less?
    assert difference_text("yaw_rate_overshoot", 0.12, 0.1) == ("+2.000", "")  # points, no percent of percent


def test_page_says_at_its_top_what_was_lost_and_what_was_driven_otherwise():
    runs = step_steers()
    runs["runs/step-none.mcap"].metadata["overrides"] = {"maneuver.speed_kmh": 95}
    runs["runs/step-none.mcap"].metrics["sideslip_peak_rad"] = 1.0
    top = Page(report_page(runs, date(2026, 1, 2))).words.partition("Metrics")[0]
    assert "2026-01-02" in top
    assert "lost with a sideslip angle of 57 deg" in top
    assert "Driven with none: speed 95 km/h (maneuver.speed_kmh) in place" in top  # not the other runs
    assert top.count("stays under control") == 2
    better = "\N{CHECK MARK} better"
    assert better not in top  # nothing is better or worse than a run that is lost
    assert "Small: difference from none, rated only between complete runs under control." in top
    for run in runs.values():
        run.metadata["overrides"] = {"maneuver.speed_kmh": 95}
        run.metrics["sideslip_peak_rad"] = 0.1
    top = Page(report_page(runs, date(2026, 1, 2))).words.partition("Metrics")[0]
    assert "Driven with speed 95 km/h (maneuver.speed_kmh) in place" in top
    assert better in top
    for run in runs.values():
        run.metadata["overrides"] = {"fault": [{"part": "rear", "kind": "stuck", "start_s": 2.0}]}
    assert "rear:stuck@2 (fault) in place" in Page(report_page(runs, date(2026, 1, 2))).words


def test_signals_of_a_standing_car_that_are_zero_are_named_but_not_drawn():
    def shown(view: str = REPORT, **channels: float) -> dict[str, Any]:
        run = step_steer()
        run.channels = {name: np.full_like(run.time_s, channels.get(name, 0.0)) for name in run.channels}
        return plots(groups_of({"a": recording_of(run)})[0], view)

    rest = shown(steering_wheel_rad=0.5)
    assert {"Yaw rate", "Roll angle", "Speed"} <= set(rest["zero"])
    assert [panel["title"] for panel in rest["panels"]] == ["Steering wheel angle", "Wheel load, lowest of four wheels"]
    assert shown(speed_mps=10.0)["zero"] == []  # a car that moves straight ahead shows that it does
    assert "Yaw rate" in shown(EXPLORE)["zero"]


def test_claims_are_judged_where_the_three_systems_are_there(page):
    words = Page(page).words
    for claim in ("S1", "S2", "S3", "S4", "S5"):
        assert f"{claim} " in words
    assert "Of 5 claims of the paper:" in words
    assert "The claims of the paper are not judged: no run of ars, afs" in words  # the sine with dwell


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            {"maneuver": {"name": "step_steer", "kind": "step_steer", "speed_mps": 9.0}},
            "differ in manoeuvre or vehicle",
        ),
        ({"complete": False}, "the run ars is not complete"),
    ],
)
def test_claims_are_not_judged_of_runs_that_cannot_be_compared(change, reason):
    runs = step_steers()
    runs["runs/step-ars.mcap"].metadata.update(change)
    judgement = judge(groups_of(runs)[0])
    assert judgement.judged == ()
    assert reason in judgement.obstacle


def test_parameters_that_differ_stand_beside_each_other():
    one = recording_of(step_steer(), "ars", {"speed_mps": 20.0, "road": {"mu": 0.9}})
    two = recording_of(step_steer(), "ars", {"speed_mps": 10.0, "road": {"mu": 0.9}})
    found = {row.key: row.values for row in parameters([one, two], "controller", "maneuver")}
    assert found["maneuver.speed_mps"] == ("20 (72 km/h)", "10 (36 km/h)")
    assert found["maneuver.road.mu"] == ("0.9",)
    assert found["controller"] == ("ars",)


def test_runs_of_one_controller_are_called_by_their_files():
    runs = {"a.mcap": recording_of(step_steer(), "ars"), "b.mcap": recording_of(step_steer(), "ars")}
    (group,) = groups_of(runs)
    assert [run.name for run in group.runs] == ["a", "b"]
    assert group.runs[0].look.colour != group.runs[1].look.colour
    again = {f"{folder}/a.mcap": run for folder, run in zip("xy", runs.values(), strict=True)}
    assert [run.name for run in groups_of(again)[0].runs] == ["x/a", "y/a"]


def test_curves_are_in_degrees_and_thinned(page):
    group = data_of(page)[0]
    yaw_rate = next(panel for panel in group["panels"] if panel["title"] == "Yaw rate")
    assert yaw_rate["unit"] == "deg/s"
    drawn = yaw_rate["series"][0]
    recording = next(iter(step_steers().values()))
    assert group["step_s"] == pytest.approx(0.005)
    assert len(drawn["values"]) == group["samples"] == 1401
    expected = np.degrees(recording["yaw_rate_radps"][::5])
    assert np.abs(np.array(drawn["values"]) - expected).max() < 1e-4 * np.ptp(expected)


def test_added_angles_are_those_of_the_systems_that_add_any(page):
    panel = next(panel for panel in data_of(page)[0]["panels"] if panel["title"].startswith("Added"))
    assert [(series["run"], series["dotted"]) for series in panel["series"]] == [
        (1, False),
        (2, True),
    ]  # rear wheels, dotted: front superposition


def test_what_sensors_say_is_drawn_with_the_truth_dotted_where_it_was_recorded():
    ideal = step_steer()
    real = step_steer()
    real.channels["measured_yaw_rate_radps"] = 1.1 * real.channels["yaw_rate_radps"]
    pages = {name: recording_of(run, metrics={}) for name, run in (("ideal.mcap", ideal), ("real.mcap", real))}
    panels = {panel["title"]: panel for panel in data_of(report_page(pages))[0]["panels"]}
    said, truth = panels["Measured yaw rate"]["series"]
    assert [(series["run"], series["dotted"]) for series in (said, truth)] == [(1, False), (1, True)]
    assert said["values"][-1] == pytest.approx(1.1 * truth["values"][-1], rel=1e-3)
    assert panels["Measured yaw rate"]["unit"] == "deg/s"
    assert "Measured lateral acceleration" not in panels


def test_track_has_lanes_cones_and_path(page):
    track = data_of(page)[2]["track"]
    assert [lane["name"] for lane in track["lanes"]] == ["entry", "offset", "exit"]
    # At (30, 1.2) and so on, inside the lane and so in their place; the car, 1.8 m wide, passes those.
    assert track["cones"] == [[30, 1.2, False], [45, 1.2, False], [30, -1.2, False], [45, -1.2, False]]
    assert track["path"]["x"][-2] == pytest.approx(299.5)
    assert (track["path"]["x"][-1] > 400.0, track["path"]["y"][-1]) == (True, 0)  # straight on
    assert track["tracks"][1]["run"] == 1
    assert track["view"]["x"] == [10.0, 205.0]


def test_the_track_of_a_car_that_leaves_its_course_is_shown_as_a_whole():
    away = recording_of(along_path(lambda x: 0.3 * x, path=offset_track), maneuver={"name": "lane_change"})
    stays = recording_of(along_path(), maneuver={"name": "lane_change"})
    alone = data_of(report_page({"a.mcap": away}))[0]["track"]
    assert alone["view"] is None
    assert alone["whole"]["y"][1] == pytest.approx(max(y for y in alone["tracks"][0]["y"] if y is not None), abs=0.1)
    assert alone["whole"]["x"][1] >= 205.0  # the course too
    both = data_of(report_page({"a.mcap": away, "b.mcap": stays}))[0]["track"]
    assert both["view"]["y"][1] < 15.0  # the other car keeps its details


def test_events_name_their_run_only_among_several():
    run, other = recording_of(step_steer()), recording_of(step_steer())
    run.metadata["events"] = [{"time_s": 1.0, "kind": "parameter", "what": "road.mu = 0.3"}]
    assert "Events: road.mu = 0.3 at 1 s" in Page(report_page({"a.mcap": run})).words
    page = report_page({"a.mcap": run, "b.mcap": other})
    assert f"Events: {data_of(page)[0]['runs'][0]['label']}: road.mu" in Page(page).words


def test_a_drive_by_hand_tells_its_lap_as_the_result_and_marks_its_changes():
    run, other = recording_of(step_steer()), recording_of(step_steer())
    for drive in (run, other):
        drive.metadata["driver"] = {"name": "by hand"}
    end_s = float(run.time_s[-1])
    run.metadata |= {
        "overrides": {"speed_kmh": 50.0},
        "events": [
            {"time_s": 0.0, "kind": "note", "what": "coarse"},
            {"time_s": 1.0, "kind": "set", "what": "road.mu = 0.3"},
            {"time_s": end_s, "kind": "note", "what": "last lap 18.57 s"},
        ],
    }
    page = report_page({"a.mcap": run})
    assert data_of(page)[0]["marks"] == [{"time_s": 1.0, "text": "road.mu = 0.3"}]
    words = Page(page).words
    assert "Result " in words
    assert "last lap 18.57 s" in words
    assert "last lap 18.57 s at" not in words
    assert "in place of the manoeuvre's own" not in words
    # Among several runs, a mark says whose change it is, unless all have it.
    names = [each["name"] for each in data_of(report_page({"a.mcap": run, "b.mcap": other}))[0]["runs"]]
    (mark,) = data_of(report_page({"a.mcap": run, "b.mcap": other}))[0]["marks"]
    assert mark["text"] == f"{names[0]}: road.mu = 0.3"
    other.metadata["events"] = run.metadata["events"]
    (mark,) = data_of(report_page({"a.mcap": run, "b.mcap": other}))[0]["marks"]
    assert mark["text"] == "road.mu = 0.3"


def test_track_shows_which_cones_are_hit_and_the_cars_in_their_size():
    cones = ((30.0, 1.6), (45.0, 0.5))
    page = report_page({"a.mcap": recording_of(along_path(cones=cones), maneuver={"name": "cones"})})
    track = data_of(page)[0]["track"]
    # The first stands on the side of the lane, and so outside it by its radius; the second in the way.
    assert track["cones"] == [[30, pytest.approx(1.6 + CONE_RADIUS_M), False], [45, 0.5, True]]
    assert track["cone_radius"] == CONE_RADIUS_M
    car = track["tracks"][0]["car"]
    assert (car["ends"], car["width"]) == ([pytest.approx(-2.6 - 0.75), 0.85], 1.8)
    assert [wheel[0] for wheel in car["wheels"]] == [0.0, 0.0, -2.6, -2.6]
    assert [np.sign(wheel[1]) for wheel in car["wheels"]] == [1.0, -1.0, 1.0, -1.0]


def test_wheels_of_the_cars_on_the_track_are_steered_axle_by_axle():
    run = along_path(cones=((30.0, 1.6),))
    run.channels |= {
        f"{corner}_steer_rad": np.full_like(run.time_s, angle)
        for corner, angle in (("fl", 0.06), ("fr", 0.05), ("rl", -0.02), ("rr", -0.03))
    }
    track = data_of(report_page({"a.mcap": recording_of(run, maneuver={"name": "cones"})}))[0]["track"]["tracks"][0]
    front, rear = track["steer"]
    assert np.allclose(front, 0.055)
    assert np.allclose(rear, -0.025)
    assert track["car"]["factors"] == [10, 10, 10, 10]


def test_instants_of_the_standard_are_marked(page):
    step, sine, cones = data_of(page)
    assert [mark["text"] for mark in sine["marks"]] == ["end of steer", "+1.00 s", "+1.75 s"]
    assert step["marks"] == cones["marks"] == []


def test_slip_angle_of_the_largest_side_force_is_one_throughout_the_runs():
    runs = {f"{name}.mcap": recording_of(step_steer(), name) for name in ("none", "ars")}
    none, ars = runs.values()

    def limit_deg() -> float | None:
        return plots(groups_of(runs)[0])["slip_limit_deg"]

    assert limit_deg() is None
    none.metadata["slip_limit_rad"] = math.radians(7.5)
    assert limit_deg() is None  # the other run has none
    ars.metadata["slip_limit_rad"] = math.radians(7.5)
    assert limit_deg() == 7.5
    ars.metadata["events"] = [{"time_s": 1.0, "kind": "set", "what": "road.mu = 0.3"}]
    assert limit_deg() is None


def test_phases_of_a_manoeuvre_are_marked():
    run = recording_of(step_steer())
    run.metadata["events"] = [
        {"time_s": at, "kind": "phase", "what": name} for name, at in (("go", 0.0), ("turn", 1.0))
    ]
    (shown,) = data_of(report_page({"a.mcap": run}))
    assert shown["marks"] == [{"time_s": 0.0, "text": "go"}, {"time_s": 1.0, "text": "turn"}]


def test_what_is_not_finite_is_left_out():
    run = step_steer()
    run.channels["yaw_rate_radps"] = np.where(run.time_s > 3.0, math.nan, run.channels["yaw_rate_radps"])
    page = report_page({"a.mcap": recording_of(run, metrics={"yaw_rate_peak_radps": math.nan})})
    values = data_of(page)[0]["panels"][1]["series"][0]["values"]
    assert values[600] is not None
    assert set(values[601:]) == {None}
    assert "peak yaw rate" not in Page(page).words


def test_a_run_has_the_times_on_another_friction_for_the_shading_of_its_curves():
    jump = simulate("mu_jump", "none")
    (run,) = data_of(report_page({"a.mcap": jump}))[0]["runs"]
    ((begin_s, end_s),) = run["patches_s"]
    on = jump.time_s[jump["fr_mu"] < 0.5]
    assert begin_s == pytest.approx(on[0], abs=1e-3)
    assert end_s > on[-1]  # the rear wheels leave the patch later
    (run,) = data_of(report_page({"a.mcap": simulate("step_steer", "none")}))[0]["runs"]
    assert run["patches_s"] == []


def test_runs_of_different_length_and_step_share_their_time():
    short = recording_of(step_steer(duration_s=3.0, timestep_s=0.002), "none")
    long = recording_of(step_steer(duration_s=6.0), "ars")
    shown = plots(groups_of({"a": short, "b": long})[0])
    assert shown["step_s"] == pytest.approx(0.006)
    assert shown["samples"] == 1001
    values = [series["values"] for series in shown["panels"][0]["series"]]
    assert values[0][500] is not None
    assert values[0][501] is None
    assert values[1][1000] is not None


def test_long_runs_keep_a_bounded_number_of_samples():
    grid = time_grid([np.linspace(0.0, 599.999, 600_000)])
    assert MAX_SAMPLES / 2 < len(grid) <= MAX_SAMPLES
    assert grid[-1] == pytest.approx(599.999, abs=grid[1])


def test_recording_that_lacks_channels_shows_the_others():
    time_s = np.arange(100) * 0.01
    run = Recording([Channel("ay_mps2", "m/s2", "", "vehicle")], time_s, np.sin(time_s)[:, None])
    page = report_page({"foreign": run})
    (group,) = data_of(page)
    assert [panel["title"] for panel in group["panels"]] == ["Lateral acceleration"]
    assert group["track"] is None


@pytest.mark.parametrize("peak", [5.0, -5.0])
def test_curve_of_a_long_run_keeps_every_peak(peak: float):
    time_s = np.arange(200_000) * 1e-3
    values = np.sin(0.1 * time_s)
    values[[0, 123_457, 199_999]] = peak
    run = Recording([Channel("ay_mps2", "m/s2", "", "vehicle")], time_s, values[:, None])
    (group,) = data_of(report_page({"long.mcap": run}))
    (panel,) = group["panels"]
    shown = panel["series"][0]["values"]
    assert len(shown) == group["samples"] <= MAX_SAMPLES
    found = np.flatnonzero(np.array(shown) == peak) * group["step_s"]
    assert found == pytest.approx([0.0, 123.457, 199.999], abs=2.0 * group["step_s"])
    plain = np.abs(np.array(shown)) < 2.0
    assert plain.sum() == len(shown) - 3
    times = np.arange(len(shown)) * group["step_s"]
    assert np.array(shown)[plain] == pytest.approx(np.sin(0.1 * times[plain]), abs=0.2 * group["step_s"] + 1e-3)


def test_text_of_a_recording_cannot_become_markup():
    evil = "</script><script>alert(1)</script>"
    run = recording_of(step_steer(), evil, {"title": evil, "name": evil, "note": evil}, overrides={evil: evil})
    run.metadata["vehicle"]["name"] = evil
    run.metadata |= {"complete": False, "error": evil}
    page = report_page({evil: run})
    assert evil not in page
    assert "alert(1)</script>" not in page
    assert data_of(page)[0]["name"] == evil
    Page(page)


def test_no_text_of_a_recording_opens_anything_inside_the_data():
    """`<!--<script>` prevents a browser from finding the end of the element, and all plots are missing."""
    page = report_page({"a.mcap": recording_of(step_steer(), "x:<!--<script>")})
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found
    assert "<" not in found[1]
    assert data_of(page)[0]["runs"][0]["name"] == "<!--<script>"


def test_run_that_did_not_end_properly_is_marked():
    run = recording_of(step_steer(), complete=False, error="SimulationDiverged: too much", overrides={"road.mu": 0.4})
    words = Page(report_page({"a.mcap": run})).words
    assert "Incomplete: a.mcap: SimulationDiverged: too much" in words
    assert "road: friction coefficient 0.4 (road.mu)" in words


def test_wrong_input_is_answered(tmp_path: Path):
    with raises(ParameterError, allowed=MAX_RUNS):
        report_page({})
    empty = Recording([Channel("ay_mps2", "m/s2", "", "vehicle")], [], np.empty((0, 1)))
    with raises(RecordingError, value="a.mcap"):
        report_page({"a.mcap": empty})
    with raises(ParameterError, cause=FileNotFoundError):
        write_report(sines(), tmp_path / "nowhere" / "report.html")
    next(iter(sines().values())).save(tmp_path / "a.mcap")
    with raises(ParameterError, value=tmp_path / "a.mcap"):
        open_all([tmp_path / "a.mcap", tmp_path / "a.mcap"])


def test_files_that_were_cut_short_are_shown_as_far_as_they_go(tmp_path: Path):
    path = tmp_path / "cut.mcap"
    next(iter(step_steers().values())).save(path)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    recordings = open_all([path])
    assert 1000 < len(recordings[str(path)]) < 7001
    assert "Incomplete" in Page(report_page(recordings)).words


def run(**metrics: float) -> Recording:
    made = circle(0.1)
    made.metrics.clear()
    made.metrics.update(metrics)
    return made


def test_lanes_cones_and_sideslip_are_said_with_their_sizes():
    good = run(stays_in_lanes=1.0, lane_overstep_m=-0.2, cones_hit=0.0, sideslip_peak_abs_rad=math.radians(1.5))
    assert outcome(good) == "stays in the lanes, hits no cone, largest sideslip angle 1.500 deg"
    bad = run(stays_in_lanes=0.0, lane_overstep_m=0.5, cones_hit=1.0, sideslip_peak_abs_rad=math.radians(50.0))
    assert outcome(bad) == (
        "lost with a sideslip angle of 50 deg, leaves the lane by 0.50 m, hits 1 cone, "
        "largest sideslip angle 50.000 deg"
    )


def test_a_run_that_broke_off_says_why():
    broken = circle(0.1, {"complete": False, "error": "boom"})
    assert outcome(broken) == "the run did not end properly: boom"

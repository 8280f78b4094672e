"""Harm: what counts, by its size, and what does not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.harm import (
    changes,
    failures,
    harms,
    has_spun,
    is_controlled,
    is_lost,
    kept,
    losses,
    severity,
    shown,
)
from activesteer.core.metric_table import CONES_MISSED, STAYS_IN_LANES
from activesteer.core.signals import Channel
from activesteer.recording import Recording

LANE = {
    "lane_overstep_m": 0.12, "cones_hit": 2.0, "sideslip_peak_abs_rad": 0.05, "heading_end_rad": 0.01,
    "yaw_rate_after_gates_rms_radps": 0.02, "steering_wheel_rms_rad": 0.5, "track_deviation_max_m": 1.0,
}  # fmt: skip


def test_a_car_that_leaves_its_lane_further_is_harmed_and_one_that_moves_within_it_is_not():
    worse = changes(LANE, LANE | {"lane_overstep_m": 2.45})
    assert harms(worse) == ["lane"]
    assert worse["lane"] == pytest.approx(2.33)
    assert severity(worse) == pytest.approx(2.33 / 0.05)
    inside = LANE | {"lane_overstep_m": -0.4}
    assert harms(changes(inside, LANE | {"lane_overstep_m": 0.049})) == []
    assert harms(changes(inside, LANE | {"lane_overstep_m": 0.051})) == ["lane"]
    assert "path" not in worse  # lanes limit the path


@pytest.mark.parametrize(
    ("key", "value", "harmed"),
    [
        ("cones_hit", 3.0, []),  # one cone, not more than one
        ("cones_hit", 4.0, ["cones"]),
        ("heading_end_rad", -math.radians(3.0), ["heading"]),
        ("yaw_rate_after_gates_rms_radps", 0.02 + math.radians(0.9), []),
        ("yaw_rate_after_gates_rms_radps", 0.02 + math.radians(1.1), ["yaw_rate"]),
        ("steering_wheel_rms_rad", 5.0, []),  # reported, not counted
        ("sideslip_peak_abs_rad", 0.4, ["lost"]),
        ("lane_overstep_m", math.nan, ["lane", "lost"]),  # it does not get through the lanes
    ],
)
def test_each_measure_has_its_size(key: str, value: float, harmed: list[str]):
    assert harms(changes(LANE, LANE | {key: value})) == harmed
    assert harms(changes(LANE | {key: value}, LANE)) == []


EARLY, LATE = "yaw_rate_after_1000ms_share", "yaw_rate_after_1750ms_share"
DWELL = {EARLY: 0.34, LATE: -0.19, "sideslip_peak_abs_rad": 0.3}


def test_a_car_that_keeps_turning_after_a_sine_with_dwell_is_not_controlled():
    assert is_controlled(DWELL)
    assert not is_controlled(DWELL | {LATE: -0.21})


@pytest.mark.parametrize(
    ("metrics", "lost", "met"),
    [
        ({"stays_in_lanes": 0.0, "lane_overstep_m": 0.3}, ["leaves the lane by 0.30 m"], []),
        ({"stays_in_lanes": 0.0, "lane_overstep_m": math.nan}, ["does not get through the lanes"], []),
        ({"stays_in_lanes": 1.0, "lane_overstep_m": -0.1}, [], ["stays in the lanes"]),
        ({"cones_hit": 0.0}, [], ["hits no cone"]),
        ({"cones_hit": 2.0}, ["hits 2 cones"], []),
        ({"cones_missed": 0.0}, [], ["passes all cones"]),
        ({"cones_missed": 1.0, "cones_hit": 0.0}, ["misses 1 cone"], ["hits no cone"]),
        (DWELL, [], []),
        (DWELL | {LATE: -0.76}, ["keeps turning: 76 % of the yaw rate remains after 1.75 s"], []),
        (DWELL | {EARLY: 0.36}, ["keeps turning: 36 % of the yaw rate remains after 1.00 s"], []),
        (DWELL | {LATE: 0.76, "sideslip_peak_abs_rad": 0.6}, ["lost with a sideslip angle of 34 deg"], []),
    ],
)
def test_a_verdict_says_what_failed_and_what_was_met(metrics: dict[str, float], lost: list[str], met: list[str]):
    assert list(losses(metrics)) == lost
    assert list(kept(metrics)) == met


PEAK = "sideslip_peak_abs_rad"
SMALL, LARGE = math.radians(5.0), math.radians(25.0)


@pytest.mark.parametrize(
    ("metrics", "lost"),
    [
        ({PEAK: math.radians(19.5)}, False),
        ({PEAK: math.radians(20.5)}, True),
        ({"sideslip_peak_rad": -LARGE}, True),
        ({"sideslip_peak_rad": -SMALL}, False),
        ({PEAK: SMALL, STAYS_IN_LANES: 1.0}, False),
        ({PEAK: SMALL, STAYS_IN_LANES: 0.0}, True),
        ({PEAK: SMALL, CONES_MISSED: 0.0, "cones_hit": 3.0}, False),
        ({PEAK: SMALL, CONES_MISSED: 1.0}, True),
    ],
)
def test_a_car_is_lost_that_spins_or_leaves_its_course(metrics: dict[str, float], lost: bool) -> None:
    assert is_lost(metrics) is lost
    assert is_controlled(metrics) is not lost


@pytest.mark.parametrize("missing", [None, math.nan])
def test_a_run_that_ended_before_it_could_be_said_is_lost(missing: float | None) -> None:
    assert is_lost({PEAK: missing})
    assert has_spun({PEAK: missing})
    assert is_lost({PEAK: SMALL, STAYS_IN_LANES: missing})
    assert is_lost({PEAK: SMALL, CONES_MISSED: missing})
    assert is_lost({})
    assert not is_controlled({PEAK: missing})


def test_a_run_without_a_metric_that_could_tell_counts_as_controlled() -> None:
    assert is_controlled({"stopping_distance_m": 40.0})
    assert not is_controlled({"heading_end_rad": LARGE})
    assert not is_controlled({CONES_MISSED: 1.0})


@pytest.mark.parametrize(("sideslip_deg", "text"), [(89.0, "3.2"), (91.0, "lost")])
def test_metrics_of_a_car_that_has_turned_round_say_nothing(sideslip_deg: float, text: str):
    metrics = {"sideslip_peak_abs_rad": math.radians(sideslip_deg), "track_deviation_max_m": 3.2}
    assert shown("track_deviation_max_m", metrics, "3.2") == text


def test_cones_that_are_hit_and_missed_add_up():
    slalom = {"cones_hit": 1.0, "cones_missed": 1.0, "sideslip_peak_abs_rad": 0.05}
    assert changes(slalom, slalom | {"cones_hit": 2.0, "cones_missed": 3.0})["cones"] == 3.0
    assert harms(changes(slalom, slalom | {"cones_missed": 3.0})) == ["cones"]


def test_a_run_that_fails_is_harm_and_two_that_fail_are_none():
    failed = dict.fromkeys(LANE)
    assert "lost" in harms(changes(LANE, failed))
    assert harms(changes(failed, failed)) == []
    assert harms(changes(failed, LANE)) == []


def test_a_car_that_does_not_turn_is_not_safe():
    dwell = {
        "yaw_rate_after_1750ms_share": 0.1, "yaw_rate_reversal_peak_radps": -0.5, "lateral_displacement_m": 2.5,
        "sideslip_peak_abs_rad": 0.1, "heading_end_rad": 0.3,
    }  # fmt: skip
    assert harms(changes(dwell, dwell | {"lateral_displacement_m": 1.84})) == []
    assert harms(changes(dwell, dwell | {"lateral_displacement_m": 1.72})) == ["displacement"]
    # 0.1 of 0.5 rad/s are left, then 0.15: 1.4 deg/s more.
    assert harms(changes(dwell, dwell | {"yaw_rate_after_1750ms_share": 0.15})) == ["yaw_rate"]
    assert harms(changes(dwell, dwell | {"heading_end_rad": 3.0})) == []


def test_a_path_without_lanes_leaves_the_free_side_of_a_lane():
    path = {"track_deviation_max_m": 0.3, "sideslip_peak_abs_rad": 0.02}
    assert harms(changes(path, path | {"track_deviation_max_m": 0.64})) == []
    assert harms(changes(path, path | {"track_deviation_max_m": 0.66})) == ["path"]


def test_a_car_that_drifts_onto_the_better_side_is_no_measure_of_a_stop():
    drifts = {"stopping_distance_m": 56.0, "lateral_deviation_max_m": 1.8, "heading_end_rad": 0.1}
    change = changes(drifts, drifts | {"stopping_distance_m": 89.0, "lateral_deviation_max_m": 0.7})
    assert harms(change) == []
    assert change["stopping_elsewhere"] == pytest.approx(33.0)


@pytest.mark.parametrize(
    ("without_m", "controlled_m", "name"), [(1.8, 0.2, "stopping_elsewhere"), (0.2, 1.8, "stopping")]
)
def test_the_path_of_the_car_without_control_decides_whether_a_stop_counts(without_m, controlled_m, name):
    stop = {"stopping_distance_m": 56.0, "lateral_deviation_max_m": without_m}
    change = changes(stop, {"stopping_distance_m": 89.0, "lateral_deviation_max_m": controlled_m})
    assert change[name] == pytest.approx(33.0)
    assert len({"stopping", "stopping_elsewhere"} & change.keys()) == 1


def test_the_worst_measure_is_the_severity():
    change = {"lane": 0.1, "path": 0.2, "cones": 3.0, "heading_open_loop": 9.0, "stopping": -5.0}
    assert severity(change) == pytest.approx(4.0)


def test_a_longer_stop_is_harm_and_no_stop_is_a_lost_car():
    stop = {"stopping_distance_m": 40.0, "lateral_deviation_max_m": 0.2, "heading_end_rad": 0.0}
    assert harms(changes(stop, stop | {"stopping_distance_m": 40.4})) == []
    assert harms(changes(stop, stop | {"stopping_distance_m": 40.6})) == ["stopping"]
    assert harms(changes(stop, stop | {"stopping_distance_m": math.nan})) == ["stopping", "lost"]


@pytest.mark.parametrize(
    ("sideslip_deg", "demand_rad", "said"),
    [
        (30.0, 0.05, ["with actuators at their limits before: rear steering for 0.4 s"]),
        (15.0, 0.05, []),  # under control
        (30.0, 0.0, []),  # not steered by the controller
    ],
)
def test_a_car_that_spins_says_for_how_long_its_actuators_were_at_their_limits(sideslip_deg, demand_rad, said):
    time_s = np.arange(0.0, 2.0, 0.01)
    channels = {
        "sideslip_rad": np.radians(sideslip_deg) * (time_s > 1.0),
        "rear_steer_demand_rad": np.full_like(time_s, demand_rad),
        "rl_steer_saturated": 1.0 * ((time_s > 0.395) & (time_s < 0.695)),
        "rr_steer_saturated": 1.0 * ((time_s > 0.495) & (time_s < 0.795) | (time_s > 1.2)),  # after the loss: no matter
    }
    made = [Channel(name, "", "", "vehicle", single=False) for name in channels]
    run = Recording(made, time_s, np.column_stack(list(channels.values())))
    assert list(failures(run)) == said


def test_a_recording_without_a_sideslip_angle_says_nothing_about_actuators():
    made = [Channel("yaw_rate_radps", "", "", "vehicle", single=False)]
    assert list(failures(Recording(made, [0.0, 0.1], [[0.1], [0.2]]))) == []

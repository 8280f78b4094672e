"""Conditions and requirements have the verdict of their inequality and a distance that grows with the gap."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pytest

from activesteer.analysis.requirement import (
    ANY,
    EvaluatedRun,
    Expression,
    Names,
    Requirement,
    distance,
)
from activesteer.config import Source
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.core.metric_table import METRICS
from activesteer.errors import StudyError
from tests.raising import raises
from tests.unit.analysis.good_runs import check, good


def test_the_distance_is_half_a_scale_away_and_one_if_undefined():
    assert distance(0.5) == 0.0
    assert distance(-1.0) == pytest.approx(0.5)
    assert distance(-2.0) == pytest.approx(2.0 / 3.0)
    assert distance(math.nan) == distance(-math.inf) == 1.0
    assert 0.0 < distance(-1e-12) < 1e-5


def test_a_claim_is_nearer_the_smaller_its_gap_and_at_zero_if_it_passes():
    arguments = good("slalom")
    distances = []
    for amplitude_m in (1.4, 1.6, 1.7, 2.0):
        arguments["ars"]["amplitude_m"] = amplitude_m
        distances.append(check("slalom", arguments)["Z1"].distance)
    assert distances[0] == pytest.approx(-1.0, abs=1e-4)  # graded: it nears -1
    assert sorted(distances) == distances
    assert distances[1] > 0.0


def test_delays_are_compared_at_the_level_of_the_car_without_control():
    """A system that answers as soon and turns further reaches 90 % of its own steady state later."""
    arguments = good("step_steer")
    s2 = check("step_steer", arguments)["S2"]
    assert s2.passed
    assert s2.values["none_yaw_rate_delay_s"] == pytest.approx(s2.values["none_yaw_rate_response_time_s"])


NAMES = Names(["lqr", "none", "my.py:Mine"], ["lane"], "lqr", {"S1": ("distance_S1", "lane")})
WHERE = Source("test.toml", error=StudyError), ("tune", "violate")


def margin(text: str, **runs: Mapping[str, float | None]) -> float:
    """Return the margin of a requirement for the metrics of the runs by controller."""
    return Requirement(text, NAMES, *WHERE)({EvaluatedRun(name, "lane"): metrics for name, metrics in runs.items()})


def test_the_margin_is_the_distance_to_the_limit_in_multiples_of_it():
    text = "max(0, lane_overstep_m(lqr)) - max(0, lane_overstep_m(none)) <= 0.05"
    assert margin(text, lqr={"lane_overstep_m": 2.45}, none={"lane_overstep_m": 0.12}) == pytest.approx(-45.6)
    assert margin(text, lqr={"lane_overstep_m": -0.4}, none={"lane_overstep_m": -0.9}) == pytest.approx(1.0)
    moved = {"lateral_displacement_m": 2.0}
    assert margin("lateral_displacement_m(controller) >= 2 * 0.8", lqr=moved) == pytest.approx(0.25)
    assert margin("1.6 <= lateral_displacement_m(lqr, lane)", lqr=moved) == pytest.approx(0.25)
    assert margin("lateral_displacement_m(lqr) <= 0", lqr=moved) == -2.0


@pytest.mark.parametrize(
    ("name", "limit", "value"),
    [
        ("sideslip_peak_abs_deg", 4.0, math.radians(2.0)),
        ("yaw_rate_peak_abs_degps", 40.0, math.radians(20.0)),
        ("speed_begin_kmh", 72.0, 10.0),
        ("ay_peak_abs_g", 1.0, 0.5 * GRAVITY_MPS2),
    ],
)
def test_a_metric_may_be_named_in_the_units_of_keys(name: str, limit: float, value: float):
    (metric,) = (one for one in METRICS if one.startswith(f"{name.rpartition('_')[0]}_"))
    assert margin(f"{name}(lqr) <= {limit}", lqr={metric: value}) == pytest.approx(0.5, rel=1e-5)


def test_requirements_are_joined_by_their_smallest_or_largest_margin():
    moved = {"lateral_displacement_m": 2.0}
    assert margin("1 <= lateral_displacement_m(lqr) <= 4", lqr=moved) == pytest.approx(0.5)
    two = "lateral_displacement_m(lqr) >= 4 {} lateral_displacement_m(lqr) <= 4"
    assert margin(two.format("and"), lqr=moved) == pytest.approx(-0.5)
    assert margin(two.format("or"), lqr=moved) == pytest.approx(0.5)


def test_a_metric_that_a_run_does_not_define_decides_nothing():
    text = "max(0, lane_overstep_m(lqr)) - min(0, lane_overstep_m(none)) <= 0"
    assert math.isnan(margin(text, lqr={"lane_overstep_m": None}, none={"lane_overstep_m": 0.1}))
    runs = {
        EvaluatedRun("lqr", "lane"): {"lane_overstep_m": math.nan},
        EvaluatedRun("none", "lane"): {"lane_overstep_m": 0.1},
    }
    assert Requirement(text, NAMES, *WHERE).undefined(runs) == {"lqr"}
    two = "lane_overstep_m(lqr) <= 0.1 {} lane_overstep_m(none) <= 0.1"
    for word, other_m, whole in (("and", 0.2, -1.0), ("and", 0.0, math.nan), ("or", 0.0, 1.0), ("or", 0.2, math.nan)):
        found = margin(two.format(word), lqr={}, none={"lane_overstep_m": other_m})
        assert found == pytest.approx(whole, nan_ok=True), (word, other_m)


def test_a_value_at_the_limit_breaks_a_strict_comparison():
    at = {"lateral_displacement_m": 2.0}
    assert margin("lateral_displacement_m(lqr) >= 2", lqr=at) == 0.0
    assert margin("lateral_displacement_m(lqr) > 2", lqr=at) < 0.0
    assert margin("lateral_displacement_m(lqr) < 2", lqr=at) < 0.0


def test_harm_is_the_growth_in_multiples_of_its_size():
    lane = {"lane_overstep_m": 0.1, "cones_hit": 1.0, "sideslip_peak_abs_rad": 0.1}
    assert margin("harm(controller) <= 1", none=lane, lqr=lane | {"lane_overstep_m": 0.2}) == pytest.approx(-1.0)


def test_a_claim_of_the_paper_has_its_own_distance():
    assert margin("claim(S1)", none={"distance_S1": -0.2}) == 0.2
    assert margin("claim(S1) and lane_overstep_m(none) <= 0", none={"distance_S1": 0.7, "lane_overstep_m": 0.0}) == -0.7


def test_an_expression_is_a_number_and_divides_by_zero():
    ratio = Expression("min(2, abs(ay_overshoot('my.py:Mine') / ay_overshoot(none)))", NAMES, *WHERE)
    mine, none = EvaluatedRun("my.py:Mine", "lane"), EvaluatedRun("none", "lane")
    assert list(ratio.metrics) == [("ay_overshoot", mine), ("ay_overshoot", none)]
    assert ratio({mine: {"ay_overshoot": -0.3}, none: {"ay_overshoot": 0.2}}) == pytest.approx(1.5)
    assert ratio({mine: {"ay_overshoot": -0.3}, none: {"ay_overshoot": 0.0}}) == 2.0
    assert math.isnan(ratio({mine: {"ay_overshoot": 0.0}, none: {"ay_overshoot": 0.0}}))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1 <= 2", "no metric"),
        ("lane_overstep_m(lqr)", "one of <=, >="),
        ("lane_overstep(lqr) <= 0", "lane_overstep_m"),
        ("lane_overstep_m(lqrr) <= 0", "'lqr'"),
        ("lane_overstep_m(lqr, lanes) <= 0", "'lane'"),
        ("claim(S2)", "'S1'"),
        ("__import__('os') <= 0", "__import__"),
        ("lane_overstep_m.x(lqr) <= 0", "is not a number"),
        ("lane_overstep_m(lqr) == 1", "one of <=, >="),
        ("max(1) <= lane_overstep_m(lqr)", "max has 1"),
        ("(" * 900, "cannot be read"),
        ("9" * 900 + " <= lane_overstep_m(lqr)", "cannot be read"),
        ("9" * 2000, "characters"),
        ("[lane_overstep_m(lqr)][0] <= 1", "is not a number"),
        ("True <= lane_overstep_m(lqr)", "is not a number"),
        ("not lane_overstep_m(lqr) <= 1", "one of <=, >="),
    ],
)
def test_a_text_that_is_no_requirement_is_refused(text: str, words: str):
    with raises(StudyError, file="test.toml", key="tune.violate") as told:
        Requirement(text, NAMES, *WHERE)
    assert words in str(told.value)


def test_the_examined_controller_is_named_only_where_there_is_one():
    with raises(StudyError, key="tune.violate") as told:
        Requirement("harm(controller) <= 1", NAMES._replace(examined=""), *WHERE)
    assert "controller is not a controller of the runs" in str(told.value)
    open_names = Names(None, [""], ANY)
    assert list(Requirement("harm(controller) <= 1", open_names, *WHERE).metrics)[1][1].controller == "none"

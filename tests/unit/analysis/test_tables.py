"""Metrics as text: the table of runs, and differences that count."""

from __future__ import annotations

import math

import pytest

from activesteer.analysis import step_response
from activesteer.analysis.metrics import KEY_FIGURES
from activesteer.analysis.tables import Change, comparison, notes, significance
from activesteer.core.metric_table import METRICS
from tests.unit.analysis.synthetic import step_steer
from tools.comparison import SHOWN


def test_values_stand_under_their_run():
    text = comparison({"none": {"roll_peak_rad": math.radians(2.0)}, "ars": {"roll_peak_rad": math.radians(-1.5)}})
    head, row = text.splitlines()
    assert head.split() == ["none", "ars"]
    assert row.split() == ["peak", "roll", "angle", "deg", "2.000", "-1.500"]
    for label, value in (("none", "2.000"), ("ars", "-1.500")):
        assert head.index(label) + len(label) == row.index(value) + len(value)


def test_what_does_not_exist_is_a_dash_and_what_is_missing_a_blank():
    text = comparison({"a": {"ay_lag_s": math.nan, "step_time_s": 1.0}, "b": {"ay_lag_s": 2.0}})
    _, first, second = text.splitlines()
    assert first.split() == ["lateral", "acceleration", "lag", "s", "-", "2.000"]
    assert second.split() == ["step", "time", "s", "1.000"]


def test_table_of_real_metrics_has_a_line_for_each():
    values = step_response.step_response_metrics(step_steer())
    assert len(comparison({"none": values}).splitlines()) == len(values) + 1


def test_a_car_that_has_turned_round_has_lost_metrics_but_its_verdicts_remain():
    spun = {"sideslip_peak_abs_rad": math.pi, "ay_rms_mps2": 3.0, "stays_in_lanes": 0.0, "steering_wheel_rms_rad": 1.0}
    fine = {**spun, "sideslip_peak_abs_rad": 0.5, "stays_in_lanes": 1.0}
    rows = {line.split()[0]: line.split()[-2:] for line in comparison({"none": spun, "ars": fine}).splitlines()[1:]}
    assert rows["largest"] == ["lost", "28.648"]
    assert rows["lateral"] == ["lost", "3.000"]
    assert rows["stays"] == ["no", "yes"]
    assert rows["steering"] == ["57.296", "57.296"]


def test_a_friction_utilisation_above_1_is_explained():
    assert "combined slip" in " ".join(comparison({"none": {"friction_utilisation_max": 1.06}}).splitlines()[2:])
    assert len(notes({"none": {"friction_utilisation_max": 1.06}})) == 1  # one sentence of a page
    assert len(comparison({"none": {"friction_utilisation_max": 0.9}}).splitlines()) == 2


JUDGED = [metric for metric in METRICS.values() if metric.better is not None]


@pytest.mark.parametrize(
    ("metric", "value", "first", "change"),
    [
        ("sideslip_peak_rad", -0.1, 0.2, Change.BETTER),
        ("sideslip_peak_rad", -0.2, 0.1, Change.WORSE),
        ("lane_overstep_m", -0.3, 0.2, Change.BETTER),
        # No significance is declared: a change of 0 % is none.
        ("steering_wheel_rate_rms_radps", 0.9009, 0.9007, Change.SAME),
        ("steering_wheel_rate_rms_radps", 0.91, 0.90, Change.WORSE),
        ("heading_end_rad", math.radians(0.245), math.radians(0.160), Change.SAME),
        ("heading_end_rad", math.radians(0.9), math.radians(-0.2), Change.WORSE),
        ("lane_overstep_m", 0.3, -0.4, Change.WORSE),
        ("entry_speed_mps", 15.0, 14.0, Change.BETTER),
        ("mean_deceleration_mps2", 7.0, 9.0, Change.WORSE),
        ("ay_response_time_s", 0.1, 0.2, Change.BETTER),
        ("stopping_distance_m", 50.0, 50.0, Change.SAME),
        ("yaw_rate_peak_abs_radps", 1.0, 2.0, Change.OTHER),
        ("sideslip_peak_rad", math.nan, 0.1, Change.OTHER),
        ("a_metric_of_another_version_m", 1.0, 2.0, Change.OTHER),
    ],
)
def test_each_metric_is_better_in_its_own_direction(metric, value, first, change):
    assert significance(metric, value, first) is change


def test_every_metric_with_a_direction_is_shown_somewhere():
    shown = {metric for metrics in SHOWN.values() for metric in metrics}
    assert {*shown, *(name for names in KEY_FIGURES.values() for name in names)} >= {metric.name for metric in JUDGED}


def test_cost_is_less_for_the_better_value():
    for metric in JUDGED:
        assert significance(metric.name, *sorted((-3.0, 1.0), key=metric.cost)) is Change.BETTER

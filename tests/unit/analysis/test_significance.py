"""Significance of the difference between two values of a metric."""

from __future__ import annotations

import math

import pytest

from activesteer.analysis.report.run_page import KEY_FIGURES
from activesteer.analysis.tables import Change, significance
from activesteer.metric_table import METRICS
from tools.comparison import SHOWN

JUDGED = [metric for metric in METRICS.values() if metric.better is not None]


@pytest.mark.parametrize(
    ("metric", "value", "first", "change"),
    [
        ("sideslip_peak_rad", -0.1, 0.2, Change.BETTER),
        ("sideslip_peak_rad", -0.2, 0.1, Change.WORSE),
        ("lane_overstep_m", -0.3, 0.2, Change.BETTER),
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

"""Detection of loss of control."""

from __future__ import annotations

import math

import pytest

from activesteer.analysis.harm import has_spun, is_controlled, is_lost
from activesteer.metric_table import CONES_MISSED, STAYS_IN_LANES

PEAK = "sideslip_peak_abs_rad"
SMALL, LARGE = math.radians(5.0), math.radians(25.0)


@pytest.mark.parametrize(
    ("metrics", "lost"),
    [
        ({PEAK: SMALL}, False),
        ({PEAK: LARGE}, True),
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

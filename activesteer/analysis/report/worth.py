"""In which direction each metric is better, and what the difference of two values of it is worth."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Final

from activesteer.analysis.claims.noticeable import noticeable
from activesteer.analysis.claims.path_following import CONES_HIT
from activesteer.analysis.claims.slalom import CONES_MISSED
from activesteer.analysis.claims.slippery import OVERSTEP
from activesteer.analysis.loss import SIDESLIP_PEAKS
from activesteer.analysis.report.tables import difference_text


class Better(StrEnum):
    """What of a metric is the better value."""

    SMALLER = "smaller in magnitude"
    LOWER = "lower"
    """Of values whose sign counts: a lane that is not touched has an overstep below zero."""
    HIGHER = "higher"


BETTER: Final = {
    **dict.fromkeys((CONES_HIT, CONES_MISSED, *SIDESLIP_PEAKS), Better.SMALLER),
    OVERSTEP: Better.LOWER,
    "stopping_distance_m": Better.SMALLER,
    "mean_deceleration_mps2": Better.HIGHER,
    "entry_speed_min_mps": Better.HIGHER,
    "entry_speed_mps": Better.HIGHER,
    "entry_speed_max_mps": Better.HIGHER,
    "yaw_rate_overshoot": Better.LOWER,
    "yaw_rate_response_time_s": Better.SMALLER,
    "ay_response_time_s": Better.SMALLER,
    "yaw_rate_after_1000ms_share": Better.SMALLER,
    "yaw_rate_after_1750ms_share": Better.SMALLER,
    "yaw_rate_deviation_after_1000ms_radps": Better.SMALLER,
    "path_deviation_after_1000ms_m": Better.SMALLER,
    "track_deviation_max_m": Better.SMALLER,
    "lateral_deviation_max_m": Better.SMALLER,
    "track_amplitude_m": Better.SMALLER,  # of a slalom: what the car needs beside the cones
    "steering_wheel_peak_abs_rad": Better.SMALLER,
    "steering_wheel_rate_rms_radps": Better.SMALLER,
}
"""Metric -> what is better; of those that are not here, neither more nor less is: as of a peak of the yaw rate,
or of a displacement that only has a bound."""


class Change(StrEnum):
    """What a difference to the first run is worth."""

    BETTER = "better"
    WORSE = "worse"
    SAME = "same"
    """Neither a driver nor a sensor in a test car could tell it."""
    OTHER = "other"
    """A difference, and no better or worse for it."""


def cost(metric: str, value: float) -> float:
    """What of a value is the better the less it is [SI]; the value itself where neither more nor less is better."""
    match BETTER.get(metric):
        case Better.SMALLER:
            return abs(value)
        case Better.HIGHER:
            return -value
    return value


def worth(metric: str, value: float, first: float) -> Change:
    """What the difference of a metric to that of the first run is worth.

    Args:
        metric: Its name.
        value: Its value [SI].
        first: That of the first run [SI].
    """
    if metric not in BETTER or not math.isfinite(value - first):
        return Change.OTHER
    size, before = cost(metric, value), cost(metric, first)
    if is_near(metric, size, before):
        return Change.SAME
    return Change.BETTER if size < before else Change.WORSE


def is_near(metric: str, value: float, first: float) -> bool:
    """Whether neither a driver nor a sensor could tell two values [SI] apart."""
    return abs(value - first) <= noticeable(metric) or difference_text(metric, value, first).text == "0"

"""Whether a car was lost: it spun, or left the course."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from activesteer.analysis.claims.sine_with_dwell import LOST_SIDESLIP_RAD

SIDESLIP_PEAKS: Final = ("sideslip_peak_abs_rad", "sideslip_peak_rad")
"""Metrics of the largest sideslip; a manoeuvre has one of them."""
IN_LANES: Final = "stays_in_lanes"
CONES_MISSED: Final = "cones_missed"

Metrics = Mapping[str, float | None]
"""Metrics of a run; a value that does not exist is None or nan."""


def has_spun(metrics: Metrics) -> bool:
    """Whether the sideslip went beyond `LOST_SIDESLIP_RAD`, or the run ended before that could be said."""
    peaks = [abs(_number(metrics, name)) for name in SIDESLIP_PEAKS if metrics.get(name) is not None]
    return not peaks or not peaks[0] <= LOST_SIDESLIP_RAD


def is_lost(metrics: Metrics) -> bool:
    """Whether a car was lost.

    It is where it has spun, where it does not keep to the lanes of its course, and where it passes a cone of a slalom
    on the wrong side or not at all. A cone that is touched makes no loss.

    Args:
        metrics: Metrics of the run. One that the manoeuvre does not have is no key of them.

    Returns:
        Whether it was.
    """
    if has_spun(metrics) or (IN_LANES in metrics and _number(metrics, IN_LANES) != 1.0):
        return True
    return CONES_MISSED in metrics and _number(metrics, CONES_MISSED) != 0.0


def _number(metrics: Metrics, name: str) -> float:
    value = metrics[name]
    return math.nan if value is None else float(value)

"""Whether a car was lost: it spun, or left the course; and the same in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from activesteer.analysis.claims.sine_with_dwell import LOST_SIDESLIP_RAD
from activesteer.metric_table import CONES_HIT, CONES_MISSED, LANE_OVERSTEP, SIDESLIP_PEAKS, STAYS_IN_LANES

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
    if has_spun(metrics) or (STAYS_IN_LANES in metrics and _number(metrics, STAYS_IN_LANES) != 1.0):
        return True
    return CONES_MISSED in metrics and _number(metrics, CONES_MISSED) != 0.0


def losses(metrics: Mapping[str, float]) -> Iterator[str]:
    """What went wrong in a run with these metrics, in words."""
    peak = next((abs(metrics[name]) for name in SIDESLIP_PEAKS if name in metrics), None)
    if peak is not None and has_spun(metrics):
        yield f"lost at {math.degrees(peak):.0f} deg of sideslip" if math.isfinite(peak) else "lost"
    if STAYS_IN_LANES in metrics and metrics[STAYS_IN_LANES] != 1.0:
        beyond = metrics.get(LANE_OVERSTEP, math.nan)
        yield f"leaves the lane by {beyond:.2f} m" if beyond > 0.0 else "does not get through the lanes"
    if missed := metrics.get(CONES_MISSED):
        yield f"misses {_cones(missed)}"
    if hit := metrics.get(CONES_HIT):
        yield f"hits {_cones(hit)}"


def kept(metrics: Mapping[str, float]) -> Iterator[str]:
    """What a run with these metrics kept to, in words; nothing where there is nothing to keep to."""
    if metrics.get(STAYS_IN_LANES) == 1.0:
        yield "stays in the lanes"
    if metrics.get(CONES_MISSED) == 0.0 and not metrics.get(CONES_HIT):
        yield "passes all cones"
    if metrics.get(CONES_HIT) == 0.0:
        yield "hits no cone"


def _cones(count: float) -> str:
    return "some cones" if math.isnan(count) else f"{count:.0f} cone{'s' if count != 1.0 else ''}"


def _number(metrics: Metrics, name: str) -> float:
    value = metrics[name]
    return math.nan if value is None else float(value)

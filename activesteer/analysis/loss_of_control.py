"""Loss of control: the car spins, or leaves the course; as a verdict and in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final

from activesteer.metric_table import (
    CONES_HIT,
    CONES_MISSED,
    LANE_OVERSTEP,
    SIDESLIP_PEAKS,
    STAYS_IN_LANES,
    recorded_metric,
)

Metrics = Mapping[str, float | None]
"""Metrics of a run; a value that is not defined is None or nan."""

LOST_SIDESLIP_RAD: Final = math.radians(20.0)
"""Largest sideslip angle of a car that is not lost [rad]."""
TURNED_ROUND_RAD: Final = math.radians(90.0)
"""Sideslip angle beyond which the car slides backwards, and its metrics say nothing [rad]."""
LOST: Final = "lost"
"""Text in place of the metrics of a car that has turned round."""


def has_spun(metrics: Metrics) -> bool:
    """Return whether the sideslip exceeded `LOST_SIDESLIP_RAD`, or whether the run ended too early to tell.

    Where the manoeuvre has no peak of the sideslip, as in straight braking, the heading at the end counts.
    """
    names = SIDESLIP_PEAKS if any(name in metrics for name in SIDESLIP_PEAKS) else ("heading_end_rad",)
    peaks = [abs(_number(metrics, name)) for name in names if metrics.get(name) is not None]
    return not peaks or not peaks[0] <= LOST_SIDESLIP_RAD


def is_lost(metrics: Metrics) -> bool:
    """Return whether the car was lost, by the metrics of its run.

    A car is lost if it spins, if it does not keep to the lanes of its course, or if it passes a cone of a slalom on the
    wrong side or not at all. A cone that is touched does not count.
    """
    return has_spun(metrics) or _leaves_course(metrics)


def is_controlled(metrics: Metrics) -> bool:
    """Return whether nothing tells that the car was lost; a manoeuvre may have no metric that could."""
    tells = any(name in metrics for name in (*SIDESLIP_PEAKS, "heading_end_rad"))
    return not ((tells and has_spun(metrics)) or _leaves_course(metrics))


def _leaves_course(metrics: Metrics) -> bool:
    if STAYS_IN_LANES in metrics and _number(metrics, STAYS_IN_LANES) != 1.0:
        return True
    return CONES_MISSED in metrics and _number(metrics, CONES_MISSED) != 0.0


def losses(metrics: Mapping[str, float]) -> Iterator[str]:
    """Describe the failures of a run with these metrics."""
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
    """Describe the requirements that a run with these metrics met; empty if the manoeuvre has none."""
    if metrics.get(STAYS_IN_LANES) == 1.0:
        yield "stays in the lanes"
    if metrics.get(CONES_MISSED) == 0.0 and not metrics.get(CONES_HIT):
        yield "passes all cones"
    if metrics.get(CONES_HIT) == 0.0:
        yield "hits no cone"


def shown(name: str, metrics: Mapping[str, float], text: str) -> str:
    """Return the text of a metric, or `lost` if it says nothing because the car has turned round.

    The driver's steering, counts and verdicts remain.
    """
    turned = any(abs(metrics.get(peak, 0.0)) > TURNED_ROUND_RAD for peak in SIDESLIP_PEAKS)
    remains = recorded_metric(name).whole or name.startswith("steering_wheel") or name not in metrics
    return text if remains or not turned else LOST


def _cones(count: float) -> str:
    return "some cones" if math.isnan(count) else f"{count:.0f} cone{'s' if count != 1.0 else ''}"


def _number(metrics: Metrics, name: str) -> float:
    value = metrics[name]
    return math.nan if value is None else float(value)

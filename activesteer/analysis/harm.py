"""Harm that a controller does, and loss of control.

A controller *harms* a run if one of `MEASURES` grows by more than its size. The sizes were written down before the
first run of a comparison. A measure without a size is reported and not counted. A measure of 0 is as good as can be:
moving within the lane is no harm, and an error within `FREE_SIDE_M` of a path is none either.

One rule was added after the first run: a stopping distance counts only if the car without control keeps the free side
of its lane. On a split road a car that does not drifts with all wheels onto the better side and stops there; a
controller that keeps it in its lane stops it on the split.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Final, NamedTuple

from activesteer.metric_table import (
    CONES_HIT,
    CONES_MISSED,
    LANE_OVERSTEP,
    SIDESLIP_PEAKS,
    STAYS_IN_LANES,
    recorded_metric,
)
from activesteer.units import DisplayUnit, display_unit

Metrics = Mapping[str, float | None]
"""Metrics of a run. A value that is not defined is None or nan."""

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
    """Return whether nothing tells that the car was lost. A manoeuvre may have no metric that could."""
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
    """Describe the requirements that a run with these metrics met, or empty if the manoeuvre has none."""
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


FREE_SIDE_M: Final = 0.6
"""Path error that is no harm, where no lanes limit the path [m]: a car 1.8 m wide in a lane of 3.0 m. Chosen."""
NEEDED_DISPLACEMENT_M: Final = 1.83
"""Displacement of a sine with dwell below which a car turns too little [m]; FMVSS 126, S5.2.3."""
_DEGREE: Final = math.pi / 180.0
_STEERING: Final = "steering_wheel_rms_rad"
_DWELL: Final = "yaw_rate_after_1750ms_share"
TRACK: Final = ("lane", "path")
"""Measures of the track, for the worst harm in metres."""


class Measure(NamedTuple):
    """A measure of a run that shall not grow."""

    words: str  # meaning
    unit: DisplayUnit  # unit for display
    size: float | None  # growth above which it is harm [SI]; None if it is not counted
    # function from the metrics of a run to the measure [SI]: None if the manoeuvre has none, nan if the run does not
    # define it
    value: Callable[[Metrics], float | None]


def _of(metrics: Metrics, name: str) -> float | None:
    """Return a metric: None if the manoeuvre has none, nan if the run does not define it."""
    if name not in metrics:
        return None
    value = metrics[name]
    return math.nan if value is None else float(value)


def _size(name: str) -> Callable[[Metrics], float | None]:
    return lambda metrics: None if (value := _of(metrics, name)) is None else abs(value)


def _beyond(value: float | None, limit: float) -> float | None:
    # max(nan, 0) is nan, max(0, nan) is not.
    return None if value is None else max(value - limit, 0.0)


def _path(metrics: Metrics) -> float | None:
    if LANE_OVERSTEP in metrics or CONES_MISSED in metrics:
        return None
    names = "track_deviation_max_m", "lateral_deviation_max_m", "path_deviation_after_1000ms_m"
    return next((_beyond(abs(found), FREE_SIDE_M) for name in names if (found := _of(metrics, name)) is not None), None)


def _cones_harm(metrics: Metrics) -> float | None:
    hit = _of(metrics, CONES_HIT)
    return None if hit is None else hit + (_of(metrics, CONES_MISSED) or 0.0)


def _heading(metrics: Metrics) -> float | None:
    return None if _DWELL in metrics else _size("heading_end_rad")(metrics)


def _heading_open_loop(metrics: Metrics) -> float | None:
    return _size("heading_end_rad")(metrics) if _DWELL in metrics else None


def _yaw_rate_left(metrics: Metrics) -> float | None:
    share, peak = _of(metrics, _DWELL), _of(metrics, "yaw_rate_reversal_peak_radps")
    if share is not None and peak is not None:
        return abs(share * peak)
    return _of(metrics, "yaw_rate_after_gates_rms_radps")


def _displacement(metrics: Metrics) -> float | None:
    value = _of(metrics, "lateral_displacement_m")
    return None if value is None else _beyond(NEEDED_DISPLACEMENT_M - value, 0.0)


def _lost(metrics: Metrics) -> float:
    """Return 1 for a car that spins, does not get through its course, misses a cone or does not stop."""
    ends = (_of(metrics, LANE_OVERSTEP), _of(metrics, "stopping_distance_m"))
    undefined = any(value is not None and math.isnan(value) for value in ends)
    return float(has_spun(metrics) or undefined or (_of(metrics, CONES_MISSED) or 0.0) != 0.0)


_M, _DEG, _DEGPS = display_unit("path_m"), display_unit("heading_rad"), display_unit("yaw_rate_radps")
_COUNT: Final = DisplayUnit("", 1.0)
MEASURES: Final[dict[str, Measure]] = {
    "lane": Measure(
        "largest distance of the body beyond its lane", _M, 0.05, lambda m: _beyond(_of(m, LANE_OVERSTEP), 0.0)
    ),
    "path": Measure("largest path error beyond the free side of a lane", _M, 0.05, _path),
    "cones": Measure("cones hit or missed", _COUNT, 1.0, _cones_harm),
    "stopping": Measure("stopping distance", _M, 0.5, lambda m: _of(m, "stopping_distance_m")),
    "stopping_elsewhere": Measure(
        "stopping distance, where the car without control leaves the free side of its lane", _M, None, lambda _: None
    ),
    "heading": Measure("heading at the end against path or straight line", _DEG, 2.0 * _DEGREE, _heading),
    "yaw_rate": Measure("yaw rate left at the end", _DEGPS, 1.0 * _DEGREE, _yaw_rate_left),
    "displacement": Measure("lateral displacement that FMVSS 126 misses", _M, 0.10, _displacement),
    "lost": Measure("car lost", _COUNT, 0.5, _lost),
    "heading_open_loop": Measure("heading at the end of a sine with dwell", _DEG, None, _heading_open_loop),
    "steering": Measure("steering wheel, root mean square", _DEG, None, _size(_STEERING)),
}
"""Name -> measure. Sizes of heading and displacement: 2 deg are 0.8 m/s of drift at 80 km/h; 0.10 m is 5 % of the
displacement that the law asks for."""


def changes(without: Metrics, controlled: Metrics) -> dict[str, float]:
    """Return the growth of each measure by a controller [SI], for the measures that the manoeuvre has."""
    found = {}
    for name, measure in MEASURES.items():
        before, after = measure.value(without), measure.value(controlled)
        if before is None and after is None:
            continue
        before, after = (math.inf if value is None or math.isnan(value) else value for value in (before, after))
        if name == "stopping" and (_path(without) or 0.0) > 0.0:
            name = "stopping_elsewhere"  # noqa: PLW2901 - the same value, not counted
        found[name] = 0.0 if before == after else after - before
    return found


def harms(change: Mapping[str, float]) -> list[str]:
    """Return the measures that grew by more than their size."""
    return [name for name, growth in change.items() if (size := MEASURES[name].size) is not None and growth > size]


def severity(change: Mapping[str, float]) -> float:
    """Return the largest growth of a counted measure, in multiples of its size."""
    sizes = ((growth, MEASURES[name].size) for name, growth in change.items())
    return max((growth / size for growth, size in sizes if size), default=0.0)


def track_harm_m(change: Mapping[str, float]) -> float:
    """Return the growth of lane overstep or path error [m], or nan if the manoeuvre has neither."""
    return max((change[name] for name in TRACK if name in change), default=math.nan)

"""Harm that a controller does, and loss of control.

A controller *harms* a run if one of the measures in `SIZES` grows by more than its threshold. The thresholds were
written down before the first run of a comparison. A measure without a threshold is reported and not counted. A measure
of 0 is as good as can be: moving within the lane is no harm, and an error within `FREE_SIDE_M` of a path is none
either.

One rule was added after the first run: a stopping distance counts only if the car without control keeps the free side
of its lane. On a split road a car that does not drifts with all wheels onto the better side and stops there; a
controller that keeps it in its lane stops it on the split.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Final

import numpy as np

from activesteer.analysis.path_following import judged_metrics
from activesteer.analysis.sine_with_dwell import INSTANTS_S, RATIO_LIMITS
from activesteer.core.metric_table import (
    CONES_HIT,
    CONES_MISSED,
    LANE_OVERSTEP,
    SIDESLIP_PEAKS,
    STAYS_IN_LANES,
    recorded_metric,
)

if TYPE_CHECKING:
    from activesteer.recording import Recording

Metrics = Mapping[str, float | None]
"""Metrics of a run. A value that is not defined is None or nan."""

LOST_SIDESLIP_RAD: Final = math.radians(20.0)
"""Largest sideslip angle of a car that is not lost [rad]."""
TURNED_ROUND_RAD: Final = math.radians(90.0)
"""Sideslip angle beyond which the car slides backwards, and its metrics are meaningless [rad]."""
LOST: Final = "lost"
"""Text in place of the metrics of a car that has turned round."""


def has_spun(metrics: Metrics) -> bool:
    """Return whether the car spun. A run that ended too early to tell counts as a spin."""
    # Where the manoeuvre has no peak of the sideslip, as in straight braking, the heading at the end counts.
    names = SIDESLIP_PEAKS if any(name in metrics for name in SIDESLIP_PEAKS) else ("heading_end_rad",)
    peak = next((abs(value) for name in names if (value := metrics.get(name)) is not None), math.nan)
    return not peak <= LOST_SIDESLIP_RAD


def is_lost(metrics: Metrics) -> bool:
    """Return whether the car lost control: it spun, left its lanes, or missed a cone of a slalom."""
    return has_spun(metrics) or _leaves_course(metrics)


def is_controlled(metrics: Metrics) -> bool:
    """Return whether no metric shows a loss of control."""
    # Some manoeuvres have no metric that could.
    tells = any(name in metrics for name in (*SIDESLIP_PEAKS, "heading_end_rad"))
    return not ((tells and has_spun(metrics)) or _leaves_course(metrics) or _turns_on(metrics))


def _turns_on(metrics: Metrics) -> str:
    """Describe the yaw rate that remains after a sine with dwell, empty within the limits."""
    said = ""
    for at_s, limit in zip(INSTANTS_S, RATIO_LIMITS, strict=True):
        share = metrics.get(f"yaw_rate_after_{1000 * at_s:.0f}ms_share")
        if share is not None and abs(share) > limit:
            said = f"{100.0 * abs(share):.0f} % of the yaw rate remains after {at_s:.2f} s"
    return said


def _leaves_course(metrics: Metrics) -> bool:
    return metrics.get(STAYS_IN_LANES, 1.0) != 1.0 or metrics.get(CONES_MISSED, 0.0) != 0.0


def losses(metrics: Mapping[str, float]) -> Iterator[str]:
    """Describe the failures that the metrics of a run show."""
    peak = next((abs(metrics[name]) for name in SIDESLIP_PEAKS if name in metrics), None)
    if peak is not None and has_spun(metrics):
        yield f"lost with a sideslip angle of {math.degrees(peak):.0f} deg" if math.isfinite(peak) else "lost"
    elif share := _turns_on(metrics):
        yield f"keeps turning: {share}"
    if STAYS_IN_LANES in metrics and metrics[STAYS_IN_LANES] != 1.0:
        beyond = metrics.get(LANE_OVERSTEP, math.nan)
        yield f"leaves the lane by {beyond:.2f} m" if beyond > 0.0 else "does not get through the lanes"
    if missed := metrics.get(CONES_MISSED):
        yield f"misses {_cones(missed)}"
    if hit := metrics.get(CONES_HIT):
        yield f"hits {_cones(hit)}"


def failures(recording: Recording) -> Iterator[str]:
    """Describe the failures of a run, and how long its steering actuators were at their limits before a spin."""
    yield from losses(judged_metrics(recording))
    if len(recording) < 2 or "sideslip_rad" not in recording:  # measured by others
        return
    sideslip_rad = np.abs(recording["sideslip_rad"])
    if not np.nanmax(sideslip_rad, initial=0.0) > LOST_SIDESLIP_RAD:
        return
    before = slice(0, int(np.argmax(sideslip_rad > LOST_SIDESLIP_RAD)))
    step_s = float(recording.time_s[1] - recording.time_s[0])
    waited = {
        words: step_s * float(np.any([recording[channel][before] for channel in limited], axis=0).sum())
        for words, demand, limited in _STEERED
        if all(channel in recording for channel in (demand, *limited)) and recording[demand][before].any()
    }
    said = [f"{words} for {seconds:.1f} s" for words, seconds in waited.items() if seconds >= _WORTH_SAYING_S]
    if said:
        yield f"with actuators at their limits before: {' and '.join(said)}"


def kept(metrics: Mapping[str, float]) -> Iterator[str]:
    """Yield the requirements of the manoeuvre that a run met, according to its metrics."""
    if metrics.get(STAYS_IN_LANES) == 1.0:
        yield "stays in the lanes"
    if metrics.get(CONES_MISSED) == 0.0 and not metrics.get(CONES_HIT):
        yield "passes all cones"
    if metrics.get(CONES_HIT) == 0.0:
        yield "hits no cone"


def shown(name: str, metrics: Mapping[str, float], text: str) -> str:
    """Return the text of a metric, or `lost` if the car has turned round and the value is meaningless."""
    # The driver's steering, counts and verdicts remain.
    turned = any(abs(metrics.get(peak, 0.0)) > TURNED_ROUND_RAD for peak in SIDESLIP_PEAKS)
    remains = recorded_metric(name).whole or name.startswith("steering_wheel") or name not in metrics
    return text if remains or not turned else LOST


def _cones(count: float) -> str:
    return "some cones" if math.isnan(count) else f"{count:.0f} cone{'s' if count != 1.0 else ''}"


FREE_SIDE_M: Final = 0.6
"""Path error that is no harm, where no lanes limit the path [m]: a car 1.8 m wide in a lane of 3.0 m. Chosen."""
_STEERED: Final = (
    ("rear steering", "rear_steer_demand_rad", ("rl_steer_saturated", "rr_steer_saturated")),
    ("front superposition", "superposition_demand_rad", ("superposition_saturated",)),
)
_WORTH_SAYING_S: Final = 0.1
"""Shortest time at a limit that is reported [s]."""
NEEDED_DISPLACEMENT_M: Final = 1.83
"""Displacement of a sine with dwell below which a car turns too little [m]; FMVSS 126, S5.2.3."""
_DEGREE: Final = math.pi / 180.0
_DWELL: Final = "yaw_rate_after_1750ms_share"


SIZES: Final[dict[str, float | None]] = {
    "lane": 0.05,  # largest distance of the body beyond its lane
    "path": 0.05,  # largest path error beyond the free side of a lane
    "cones": 1.0,  # cones hit or missed
    "stopping": 0.5,  # stopping distance
    "stopping_elsewhere": None,  # the same, where the car without control leaves the free side of its lane
    "heading": 2.0 * _DEGREE,  # heading at the end against path or straight line: 0.8 m/s of drift at 80 km/h
    "yaw_rate": 1.0 * _DEGREE,  # yaw rate left at the end
    "displacement": 0.10,  # lateral displacement that FMVSS 126 misses: 5 % of the displacement that it asks for
    "lost": 0.5,  # car lost
    "heading_open_loop": None,  # heading at the end of a sine with dwell
    "steering": None,  # steering wheel, root mean square
}
"""Growth of each measure above which it counts as harm [SI], or None for a measure that is not counted."""


def measured(metrics: Metrics) -> dict[str, float]:
    """Return the measures of harm of a run [SI], infinite where the run does not define a measure of its manoeuvre."""
    known = {name: math.nan if value is None else value for name, value in metrics.items()}
    missed = known.get(CONES_MISSED, 0.0)
    found = {"lost": float(has_spun(metrics) or missed != 0.0)}
    # max(nan, 0) is nan, max(0, nan) is not.
    if LANE_OVERSTEP in known:
        found["lane"] = max(known[LANE_OVERSTEP], 0.0)
    names = "track_deviation_max_m", "lateral_deviation_max_m", "path_deviation_after_1000ms_m"
    errors = [abs(known[name]) for name in names if name in known]
    if errors and LANE_OVERSTEP not in known and CONES_MISSED not in known:
        found["path"] = max(errors[0] - FREE_SIDE_M, 0.0)
    if CONES_HIT in known:
        found["cones"] = known[CONES_HIT] + missed
    if "stopping_distance_m" in known:
        found["stopping"] = known["stopping_distance_m"]
    if any(math.isnan(found.get(name, 0.0)) for name in ("lane", "stopping")):  # does not get there, or does not stop
        found["lost"] = 1.0
    if "heading_end_rad" in known:
        found["heading_open_loop" if _DWELL in known else "heading"] = abs(known["heading_end_rad"])
    if _DWELL in known and "yaw_rate_reversal_peak_radps" in known:
        found["yaw_rate"] = abs(known[_DWELL] * known["yaw_rate_reversal_peak_radps"])
    elif "yaw_rate_after_gates_rms_radps" in known:
        found["yaw_rate"] = known["yaw_rate_after_gates_rms_radps"]
    if "lateral_displacement_m" in known:
        found["displacement"] = max(NEEDED_DISPLACEMENT_M - known["lateral_displacement_m"], 0.0)
    if "steering_wheel_rms_rad" in known:
        found["steering"] = abs(known["steering_wheel_rms_rad"])
    return {name: math.inf if math.isnan(value) else value for name, value in found.items()}


def changes(without: Metrics, controlled: Metrics) -> dict[str, float]:
    """Return the growth of each measure of harm that a controller causes [SI]."""
    found, all_before, all_after = {}, measured(without), measured(controlled)
    for name in SIZES:
        if name not in all_before and name not in all_after:
            continue
        before, after = (values.get(name, math.inf) for values in (all_before, all_after))
        # Where the car without control leaves the free side, the same value is not counted.
        elsewhere = name == "stopping" and 0.0 < all_before.get("path", 0.0) < math.inf
        found["stopping_elsewhere" if elsewhere else name] = 0.0 if before == after else after - before
    return found


def harms(change: Mapping[str, float]) -> list[str]:
    """Return the measures of harm that grew by more than their threshold."""
    return [name for name, growth in change.items() if (size := SIZES[name]) is not None and growth > size]


def severity(change: Mapping[str, float]) -> float:
    """Return the largest growth of a counted measure, in multiples of its threshold."""
    sizes = ((growth, SIZES[name]) for name, growth in change.items())
    return max((growth / size for growth, size in sizes if size), default=0.0)

"""The paper's statements about the double lane change on a slippery road, as checks on three recordings.

Source: V. Dorsch, Mecatronics-REM 2012, section on the double lane change with low friction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from activesteer.analysis import path_following
from activesteer.analysis.claims.claim import SYSTEMS_WITH_CONTROL, Claim, Kind, Statement
from activesteer.analysis.claims.path_following import (
    LARGE_STEERING_WHEEL_RAD,
    SETTLED_YAW_RATE_RADPS,
    SIDESLIP_PEAK,
    held,
    held_statement,
)
from activesteer.analysis.claims.system_runs import Metrics, SystemRuns
from activesteer.analysis.requirement import Condition, at_least, at_most
from activesteer.analysis.series import rms
from activesteer.analysis.source import RecordingLike
from activesteer.metric_table import CONES_HIT, LANE_OVERSTEP, STAYS_IN_LANES, TRACK_M

LARGER: Final = 1.5
"""Least ratio of the driver's angle without control to the angles with control."""
LARGE_YAW_RATE_RADPS: Final = math.radians(5.0)
"""Yaw rate at the end that no car has which continues straight [rad/s]."""
LARGE_SIDESLIP_RAD: Final = math.radians(5.0)
"""Sideslip angle at the end that no car has which continues straight [rad]."""
KEPT_SIDESLIP_RAD: Final = math.radians(5.0)
"""Largest sideslip angle at which the steering still turns the car on the slippery road [rad]: the 12 deg of a dry road
(`sine_with_dwell.KEPT_SIDESLIP_RAD`) in proportion to the friction, 0.4 to 0.9, because the slip angle of the largest
side force is proportional to it."""
SCALE_M: Final = 0.5
"""Overstep that counts as a whole distance from keeping to the lanes [m]."""
END_S: Final = 3.0
"""Length of the end of the run, which the paper's figures show [s]."""
WHEEL: Final = "steering_wheel_peak_abs_rad"
YAW_RATE_END: Final = "yaw_rate_end_rms_radps"
SIDESLIP_END: Final = "sideslip_end_rms_rad"


def _stays_statement(number: str, system: str, text: str) -> Statement:
    return Statement.about(
        Kind.DRIVER,
        number,
        text,
        f"The whole body of {system} goes through every lane and never crosses a side; the body of none "
        f"does not, and gets at least {TRACK_M:g} m further out. {system} is under control: its sideslip stays within "
        f"{math.degrees(KEPT_SIDESLIP_RAD):.0f} deg, and in the last {END_S:g} s of the run the root mean square of "
        f"its yaw rate is at most {math.degrees(SETTLED_YAW_RATE_RADPS):g} deg/s.",
    )


W1: Final = Statement.about(
    Kind.DRIVER,
    "W1",
    "Without control the driver leaves the track, with large steering angles, and the car ends with large yaw rate "
    "and sideslip.",
    "The body of none does not keep to the lanes; its steering wheel angle exceeds "
    f"{math.degrees(LARGE_STEERING_WHEEL_RAD):.0f} deg and {LARGER:g} times the angles of ars and of afs; in the last "
    f"{END_S:g} s of the run the root mean squares of its yaw rate and sideslip are above "
    f"{math.degrees(LARGE_YAW_RATE_RADPS):.0f} deg/s and {math.degrees(LARGE_SIDESLIP_RAD):.0f} deg.",
)
W2: Final = _stays_statement("W2", "ars", "Rear steering keeps the car on the track.")
W3: Final = _stays_statement("W3", "afs", "Front superposition keeps the car on the track.")
W4: Final = held_statement("W4")
STATEMENTS: Final = (W1, W2, W3, W4)


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims W1 to W4; see `scenarios.Claims`."""
    runs = SystemRuns(recordings, _metrics, "slippery double lane change")
    return [_leaves(runs), _stays(runs, W2, "ars"), _stays(runs, W3, "afs"), held(runs, W4)]


def _metrics(recording: RecordingLike) -> dict[str, float]:
    # A course without lanes has no track to stay on.
    without = {LANE_OVERSTEP: math.nan, STAYS_IN_LANES: math.nan, CONES_HIT: math.nan}
    last = recording.time_s >= recording.time_s[-1] - END_S
    end = {YAW_RATE_END: rms(recording["yaw_rate_radps"][last]), SIDESLIP_END: rms(recording["sideslip_rad"][last])}
    return without | path_following.metrics(recording) | end


def _outside(metrics: Metrics) -> Condition:
    """Return the condition that a body does not keep to the lanes."""
    room = max(abs(metrics[LANE_OVERSTEP]) / SCALE_M, 1e-6)
    return Condition(room if metrics[STAYS_IN_LANES] == 0.0 else -room, strict=True)


def _inside(metrics: Metrics) -> Condition:
    """Return the condition that a body keeps to the lanes."""
    room = max(abs(metrics[LANE_OVERSTEP]) / SCALE_M, 1e-6)
    return Condition(room if metrics[STAYS_IN_LANES] == 1.0 else -room, strict=True)


def _leaves(runs: SystemRuns) -> Claim:
    none = runs.metrics["none"]
    conditions = [
        _outside(none),
        at_least(none[WHEEL], LARGE_STEERING_WHEEL_RAD, strict=True),
        *(at_least(none[WHEEL], LARGER * runs.metrics[system][WHEEL], strict=True) for system in SYSTEMS_WITH_CONTROL),
        at_least(none[YAW_RATE_END], LARGE_YAW_RATE_RADPS, strict=True),
        at_least(none[SIDESLIP_END], LARGE_SIDESLIP_RAD, strict=True),
    ]
    names = (LANE_OVERSTEP, STAYS_IN_LANES, CONES_HIT, YAW_RATE_END, SIDESLIP_END)
    return runs.judge(W1, conditions, {f"none_{name}": none[name] for name in names} | runs.pick(WHEEL))


def _stays(runs: SystemRuns, statement: Statement, system: str) -> Claim:
    names = (LANE_OVERSTEP, STAYS_IN_LANES, CONES_HIT, SIDESLIP_PEAK, YAW_RATE_END)
    none, kept = runs.metrics["none"], runs.metrics[system]
    conditions = [
        _inside(kept),
        _outside(none),
        at_least(none[LANE_OVERSTEP] - kept[LANE_OVERSTEP], TRACK_M),
        at_most(kept[SIDESLIP_PEAK], KEPT_SIDESLIP_RAD),
        at_most(kept[YAW_RATE_END], SETTLED_YAW_RATE_RADPS),
    ]
    return runs.judge(
        statement, conditions, {f"{run}_{name}": runs.metrics[run][name] for name in names for run in ("none", system)}
    )

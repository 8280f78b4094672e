"""What the paper says about the double lane change on a slippery road, as checks on three recordings.

The criteria were written down before any parameter was chosen for this manoeuvre.

Source: V. Dorsch, Mecatronics-REM 2012, section on the double lane change with low friction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from activesteer.analysis import path_following
from activesteer.analysis.claims.claim import Claim, Runs, all_metrics, pick
from activesteer.analysis.claims.path_following import SYSTEMS_WITH_CONTROL
from activesteer.analysis.series import rms
from activesteer.analysis.source import RecordingLike

LARGE_ANGLE_RAD: Final = math.radians(90.0)
"""A steering wheel angle above this is large [rad]."""
LARGER: Final = 1.5
"""The driver without control needs this many times the angle that the others need."""
LARGE_YAW_RATE_RADPS: Final = math.radians(5.0)
"""A car that goes on straight has a smaller yaw rate at the end [rad/s]."""
LARGE_SIDESLIP_RAD: Final = math.radians(5.0)
"""A car that goes on straight has a smaller sideslip at the end [rad]."""
OVERSTEP: Final = "lane_overstep_m"
IN_LANES: Final = "all_wheels_in_lanes"
WHEEL: Final = "steering_wheel_peak_abs_rad"


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims W1 to W3.

    Args:
        recordings: Double lane changes on a slippery road, by system; the three of `SYSTEMS` are needed.

    Returns:
        Three claims, in order. A value that does not exist (nan) lets its claim fail.

    Raises:
        ParameterError: one of the three runs is missing.
        RecordingError: a run has no course, or a channel is missing.
    """
    runs = all_metrics(recordings, _metrics, "slippery double lane change")
    return [
        _leaves(runs, recordings["none"]),
        _stays(runs, "W2", "ars", "Rear steering keeps the car on the track."),
        _stays(runs, "W3", "afs", "Front superposition keeps the car on the track."),
    ]


def _metrics(recording: RecordingLike) -> dict[str, float]:
    # A course without lanes has no track to stay on.
    return {OVERSTEP: math.nan, IN_LANES: math.nan, **path_following.metrics(recording)}


def _leaves(runs: Runs, none: RecordingLike) -> Claim:
    end = {
        f"none_{name}_end_rms_{unit}": _end(runs["none"], none, name, unit)
        for name, unit in (("yaw_rate", "radps"), ("sideslip", "rad"))
    }
    yaw_rate, sideslip = end.values()
    wheel = runs["none"][WHEEL]
    steers = wheel > LARGE_ANGLE_RAD and all(wheel > LARGER * runs[system][WHEEL] for system in SYSTEMS_WITH_CONTROL)
    return Claim(
        "W1",
        "Without control the driver leaves the track, with large steering angles, and the car ends with large yaw rate "
        "and sideslip.",
        f"A wheel of none gets beyond a side of a cone lane; its steering wheel angle goes beyond "
        f"{math.degrees(LARGE_ANGLE_RAD):.0f} deg and beyond {LARGER:g} times that of ars and of afs; in the "
        f"{path_following.AFTER_S:g} s after the last gate (the last {path_following.AFTER_S:g} s of the run, if it "
        "never gets there or ends before) the root mean squares of yaw rate and of sideslip are above "
        f"{math.degrees(LARGE_YAW_RATE_RADPS):.0f} deg/s and {math.degrees(LARGE_SIDESLIP_RAD):.0f} deg.",
        runs["none"][OVERSTEP] > 0.0 and steers and yaw_rate > LARGE_YAW_RATE_RADPS and sideslip > LARGE_SIDESLIP_RAD,
        {f"none_{OVERSTEP}": runs["none"][OVERSTEP], **pick(runs, WHEEL), **end},
    )


def _end(metrics: Mapping[str, float], recording: RecordingLike, name: str, unit: str) -> float:
    """Root mean square after the last gate, or at the end of a run that has nothing after it."""
    after = metrics.get(f"{name}_after_gates_rms_{unit}", math.nan)
    if not math.isnan(after):
        return after
    last = recording.time_s >= recording.time_s[-1] - path_following.AFTER_S
    return rms(recording[f"{name}_{unit}"][last])


def _stays(runs: Runs, number: str, system: str, text: str) -> Claim:
    run = runs[system]
    return Claim(
        number,
        text,
        f"All four wheels of {system} go through every cone lane, and none gets beyond a side of it "
        "(contact point and half the tyre's width).",
        run[IN_LANES] == 1.0,
        {f"{system}_{OVERSTEP}": run[OVERSTEP], f"{system}_{IN_LANES}": run[IN_LANES]},
    )

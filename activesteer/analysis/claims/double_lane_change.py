"""What the paper says about the double lane change on a dry road, as checks on three recordings.

The criteria were written down before any parameter was chosen for this manoeuvre.

Source: V. Dorsch, Mecatronics-REM 2012, section on the double lane change.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Final

from activesteer.analysis import path_following, track
from activesteer.analysis.claims.claim import SYSTEMS, Claim, Runs, all_metrics, lowered, pick
from activesteer.analysis.claims.path_following import SYSTEMS_WITH_CONTROL, calmed
from activesteer.analysis.source import RecordingLike, read_course

ALIKE_M: Final = 0.5
"""Tracks look alike when they are nowhere further apart than this [m]."""
PEAK_FRACTION: Final = 0.9
"""A system lowers a peak when it brings it down to this fraction."""
PEAKS: Final = ("yaw_rate_peak_abs_radps", "sideslip_peak_abs_rad")


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims L1 to L3.

    Args:
        recordings: Double lane changes through the same course, by system; the three of `SYSTEMS` are needed.

    Returns:
        Three claims, in order. A value that does not exist (nan) lets its claim fail.

    Raises:
        ParameterError: one of the three runs is missing.
        RecordingError: a run has no course, or a channel is missing.
    """
    runs = all_metrics(recordings, path_following.metrics, "double lane change")
    text = "Without control the car goes on oscillating after the last gate; each system stops that."
    return [_alike(recordings), calmed(runs, "L2", text), _peaks(runs)]


def _alike(recordings: Mapping[str, RecordingLike]) -> Claim:
    course = read_course(recordings["none"])
    first_m, last_m = course.first_gate_x_m, course.last_gate_x_m
    values = {
        f"track_difference_{one}_{other}_m": math.nan
        if last_m is None
        else track.largest_difference(recordings[one], recordings[other], first_m, last_m)
        for one, other in combinations(SYSTEMS, 2)
    }
    return Claim(
        "L1",
        "The three tracks look alike.",
        "From the first gate to the last, the tracks of the front axle centre of any two runs are at most "
        f"{ALIKE_M:g} m apart at the same x.",
        all(value <= ALIKE_M for value in values.values()),
        values,
    )


def _peaks(runs: Runs) -> Claim:
    return Claim(
        "L3",
        "Each system lowers the peaks of yaw rate and sideslip.",
        "The largest magnitudes of yaw rate and of sideslip of ars and of afs are at most "
        f"{100.0 * PEAK_FRACTION:.0f} % of those of none.",
        all(lowered(runs, metric, PEAK_FRACTION, system) for metric in PEAKS for system in SYSTEMS_WITH_CONTROL),
        pick(runs, *PEAKS),
    )

"""The paper's statements about the double lane change on a dry road, as checks on three recordings.

Source: V. Dorsch, Mecatronics-REM 2012, section on the double lane change.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Final

from activesteer.analysis import path_following, track
from activesteer.analysis.claims.claim import SYSTEMS, Claim, Kind, Statement
from activesteer.analysis.claims.path_following import (
    AFTER_SIDESLIP,
    AFTER_YAW_RATE,
    CALMED,
    CALMED_WORDS,
    SETTLED_YAW_RATE_RADPS,
    SIDESLIP_PEAK,
    calmed,
    held,
    held_statement,
)
from activesteer.analysis.claims.system_runs import SystemRuns
from activesteer.analysis.requirement import at_least, at_most
from activesteer.analysis.source import RecordingLike, read_course
from activesteer.metric_table import CONES_HIT, SIDESLIP_RAD, YAW_RATE_RADPS

ALIKE_M: Final = 0.5
"""Largest distance between tracks that look alike [m]: a seventh of the distance to the side lane."""
PEAK_FRACTION: Final = 0.9
"""Largest fraction of a peak that is left when a system lowers it."""
YAW_RATE_PEAK: Final = "yaw_rate_peak_abs_radps"
AFTER_DRIVER: Final = ("ay_after_gates_rms_mps2", "steering_wheel_after_gates_rms_rad")

L1: Final = Statement.about(
    Kind.DRIVER,
    "L1",
    "The three tracks look alike.",
    "From the first gate to the last, the tracks of the front axle centre of any two runs are at most "
    f"{ALIKE_M:g} m apart at the same x. The number of cones that each body hits is given, and does not decide.",
    rejects=(),
)
L2: Final = Statement.about(
    Kind.DRIVER,
    "L2",
    "Without control the car goes on oscillating after the last gate; each system stops that.",
    f"The root mean square of the yaw rate of none after the last gate is above "
    f"{math.degrees(SETTLED_YAW_RATE_RADPS):g} deg/s. The root mean squares of yaw rate and sideslip {CALMED_WORDS}. "
    "The root mean squares of lateral acceleration and steering wheel angle are also at most "
    f"{100.0 * CALMED:.0f} % of the values of none.",
)
L3: Final = Statement.about(
    Kind.DRIVER,
    "L3",
    "Each system lowers the peaks of yaw rate and sideslip.",
    "The largest magnitudes of yaw rate and of sideslip of ars and of afs are at most "
    f"{100.0 * PEAK_FRACTION:.0f} % of the values of none, and smaller by at least {math.degrees(YAW_RATE_RADPS):g} "
    f"deg/s and {math.degrees(SIDESLIP_RAD):g} deg.",
)
L4: Final = held_statement("L4")
STATEMENTS: Final = (L1, L2, L3, L4)


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims L1 to L4; see `scenarios.Claims`."""
    runs = SystemRuns(recordings, path_following.metrics, "double lane change")
    oscillates = at_least(runs.metrics["none"][AFTER_YAW_RATE], SETTLED_YAW_RATE_RADPS, strict=True)
    others = [part for name in AFTER_DRIVER for part in runs.both_lower(name, CALMED, 0.0)]
    lowered = runs.both_lower(YAW_RATE_PEAK, PEAK_FRACTION, YAW_RATE_RADPS)
    return [
        _alike(runs),
        runs.judge(L2, [oscillates, *others, *calmed(runs)], runs.pick(AFTER_YAW_RATE, AFTER_SIDESLIP, *AFTER_DRIVER)),
        runs.judge(
            L3,
            [*lowered, *runs.both_lower(SIDESLIP_PEAK, PEAK_FRACTION, SIDESLIP_RAD)],
            runs.pick(YAW_RATE_PEAK, SIDESLIP_PEAK),
        ),
        held(runs, L4),
    ]


def _alike(runs: SystemRuns) -> Claim:
    course = read_course(runs.recordings["none"])
    first_m, last_m = course.first_gate_x_m, course.last_gate_x_m
    differences = {
        f"track_difference_{one}_{other}_m": math.nan
        if last_m is None or not runs.whole
        else track.largest_difference(runs.recordings[one], runs.recordings[other], first_m, last_m)
        for one, other in combinations(SYSTEMS, 2)
    }
    cones = {f"{system}_{CONES_HIT}": runs.metrics[system].get(CONES_HIT, math.nan) for system in SYSTEMS}
    return runs.judge(L1, [at_most(value, ALIKE_M) for value in differences.values()], differences | cones)

"""The paper's statements about the slalom, as checks on three recordings.

"Between the cones": from the first gate to the end of the last gate, by the front axle centre.

Source: V. Dorsch, Mecatronics-REM 2012, section on the slalom.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from activesteer.analysis import path_following
from activesteer.analysis.claims.claim import SYSTEMS_WITH_CONTROL, Claim, Kind, Statement
from activesteer.analysis.claims.path_following import (
    AFTER_SIDESLIP,
    AFTER_YAW_RATE,
    CALMED_WORDS,
    LARGE_STEERING_WHEEL_RAD,
    calmed,
    held,
    held_statement,
)
from activesteer.analysis.claims.system_runs import SystemRuns
from activesteer.analysis.requirement import at_least, true
from activesteer.analysis.source import RecordingLike
from activesteer.metric_table import (
    CONES_HIT,
    CONES_MISSED,
    SIDESLIP_RAD,
    STEERING_WHEEL_RAD,
    TRACK_M,
    YAW_RATE_RADPS,
)

NOT_REDUCED: Final = 0.95
"""Least fraction of the amplitude without control that is left when a system does not reduce it."""
TRACK: Final = "track_amplitude_m"
YAW_RATE: Final = "yaw_rate_gates_rms_radps"
SIDESLIP: Final = "sideslip_gates_rms_rad"
STEERING: Final = "steering_wheel_gates_rms_rad"
STEERING_PEAK: Final = "steering_wheel_peak_abs_rad"

Z1: Final = Statement.about(
    Kind.DRIVER,
    "Z1",
    "Without control the track swings wider.",
    "The amplitude of the front axle centre's track between first and last cone (half the distance of its leftmost "
    f"and rightmost place) is at least {TRACK_M:g} m larger for none than for ars and for afs. The number of "
    "cones that each body hits is given, and does not decide.",
)
Z2: Final = Statement.about(
    Kind.DRIVER,
    "Z2",
    "Each system reduces the oscillation of yaw rate and sideslip after the last gate.",
    f"The root mean squares of yaw rate and sideslip {CALMED_WORDS}.",
)
Z3: Final = Statement.about(
    Kind.DRIVER,
    "Z3",
    "Front superposition does not reduce the amplitudes, and needs large angles of the driver.",
    "Between the cones, the root mean squares of yaw rate and of sideslip of afs are not more than "
    f"{100.0 * (1.0 - NOT_REDUCED):.0f} % below the values of none. The root mean square of its steering wheel angle "
    f"is the largest of the three by at least {math.degrees(STEERING_WHEEL_RAD):g} deg, and the angle exceeds "
    f"{math.degrees(LARGE_STEERING_WHEEL_RAD):.0f} deg. afs passes every cone on the right side.",
)
Z4: Final = Statement.about(
    Kind.DRIVER,
    "Z4",
    "Rear steering has the smallest amplitudes of yaw rate and sideslip.",
    "Between the cones, the root mean squares of yaw rate and of sideslip of ars are below the values of none and "
    f"afs by at least {math.degrees(YAW_RATE_RADPS):g} deg/s and {math.degrees(SIDESLIP_RAD):g} deg.",
)
Z5: Final = held_statement("Z5")
STATEMENTS: Final = (Z1, Z2, Z3, Z4, Z5)


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims Z1 to Z5; see `scenarios.Claims`."""
    runs = SystemRuns(recordings, path_following.metrics, "slalom")
    none, afs = runs.metrics["none"], runs.metrics["afs"]
    wider = [at_least(none[TRACK] - runs.metrics[system][TRACK], TRACK_M) for system in SYSTEMS_WITH_CONTROL]
    kept = [at_least(afs[metric], NOT_REDUCED * none[metric]) for metric in (YAW_RATE, SIDESLIP)]
    large = at_least(afs[STEERING_PEAK], LARGE_STEERING_WHEEL_RAD, strict=True)
    passes = true(afs[CONES_MISSED] == 0.0)
    calmest = [*runs.is_smallest("ars", YAW_RATE, YAW_RATE_RADPS), *runs.is_smallest("ars", SIDESLIP, SIDESLIP_RAD)]
    return [
        runs.judge(Z1, wider, runs.pick(TRACK, CONES_HIT)),
        runs.judge(Z2, calmed(runs), runs.pick(AFTER_YAW_RATE, AFTER_SIDESLIP)),
        runs.judge(
            Z3,
            [*kept, large, passes, *runs.is_largest("afs", STEERING, STEERING_WHEEL_RAD)],
            runs.pick(YAW_RATE, SIDESLIP, STEERING, STEERING_PEAK),
        ),
        runs.judge(Z4, calmest, runs.pick(YAW_RATE, SIDESLIP)),
        held(runs, Z5),
    ]

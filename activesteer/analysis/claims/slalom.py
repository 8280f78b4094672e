"""What the paper says about the slalom, as checks on three recordings.

"Between the cones" is from where the front axle centre reaches the first gate to where it reaches the end of the last.

Source: V. Dorsch, Mecatronics-REM 2012, section on the slalom.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from activesteer.analysis import path_following
from activesteer.analysis.claims.claim import SYSTEMS_WITH_CONTROL, Claim, Fake, Kind, Statement
from activesteer.analysis.claims.path_following import (
    AFTER_SIDESLIP,
    AFTER_YAW_RATE,
    CALMED_WORDS,
    LARGE_STEERING_WHEEL_RAD,
    calmed,
    held,
    held_statement,
)
from activesteer.analysis.claims.trio import Trio
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
"""An amplitude is not reduced when it stays above this fraction of the one without control."""
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
    f"and rightmost place) is at least {TRACK_M:g} m larger for none than for ars and for afs. How many cones each "
    "body hits is said, and does not decide.",
    Fake.NO_EFFECT,
    Fake.REVERSED,
)
Z2: Final = Statement.about(
    Kind.DRIVER,
    "Z2",
    "Each system reduces the oscillation of yaw rate and sideslip after the last gate.",
    f"The root mean squares of yaw rate and sideslip {CALMED_WORDS}.",
    Fake.NO_EFFECT,
    Fake.REVERSED,
)
Z3: Final = Statement.about(
    Kind.DRIVER,
    "Z3",
    "Front superposition does not reduce the amplitudes, and needs large angles of the driver.",
    "Between the cones, the root mean squares of yaw rate and of sideslip of afs are not more than "
    f"{100.0 * (1.0 - NOT_REDUCED):.0f} % below those of none; that of its steering wheel angle is the largest of the "
    f"three by at least {math.degrees(STEERING_WHEEL_RAD):g} deg, and that angle goes beyond "
    f"{math.degrees(LARGE_STEERING_WHEEL_RAD):.0f} deg; and afs passes every cone on the right side.",
    Fake.NO_EFFECT,
    Fake.REVERSED,
)
Z4: Final = Statement.about(
    Kind.DRIVER,
    "Z4",
    "Rear steering has the smallest amplitudes of yaw rate and sideslip.",
    "Between the cones, the root mean squares of yaw rate and of sideslip of ars are below those of none and afs, by "
    f"at least {math.degrees(YAW_RATE_RADPS):g} deg/s and {math.degrees(SIDESLIP_RAD):g} deg.",
    Fake.NO_EFFECT,
    Fake.REVERSED,
)
Z5: Final = held_statement("Z5")
STATEMENTS: Final = (Z1, Z2, Z3, Z4, Z5)


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims Z1 to Z5.

    Args:
        recordings: Slaloms around the same cones, by system; the three of `SYSTEMS` are needed.

    Returns:
        Five claims, in order. A value that does not exist (nan) lets its claim fail.

    Raises:
        ParameterError: one of the three runs is missing.
        RecordingError: a run has no course, or a channel is missing.
    """
    trio = Trio(recordings, path_following.metrics, "slalom")
    wider = all(trio.metrics["none"][TRACK] - trio.metrics[system][TRACK] >= TRACK_M for system in SYSTEMS_WITH_CONTROL)
    kept = all(
        trio.metrics["afs"][metric] >= NOT_REDUCED * trio.metrics["none"][metric] for metric in (YAW_RATE, SIDESLIP)
    )
    large = trio.metrics["afs"][STEERING_PEAK] > LARGE_STEERING_WHEEL_RAD
    passes = trio.metrics["afs"][CONES_MISSED] == 0.0
    calmest = trio.is_smallest("ars", YAW_RATE, YAW_RATE_RADPS) and trio.is_smallest("ars", SIDESLIP, SIDESLIP_RAD)
    return [
        trio.judge(Z1, wider, trio.pick(TRACK, CONES_HIT)),
        trio.judge(Z2, calmed(trio), trio.pick(AFTER_YAW_RATE, AFTER_SIDESLIP)),
        trio.judge(
            Z3,
            kept and large and passes and trio.is_largest("afs", STEERING, STEERING_WHEEL_RAD),
            trio.pick(YAW_RATE, SIDESLIP, STEERING, STEERING_PEAK),
        ),
        trio.judge(Z4, calmest, trio.pick(YAW_RATE, SIDESLIP)),
        held(trio, Z5),
    ]

"""What the paper says about the slalom, as checks on three recordings.

The criteria were written down before any parameter was chosen for this manoeuvre. "Between the cones" is from where the
front axle centre reaches the first gate to where it reaches the end of the last.

Source: V. Dorsch, Mecatronics-REM 2012, section on the slalom.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from activesteer.analysis import path_following
from activesteer.analysis.claims.claim import SYSTEMS, Claim, Runs, all_metrics, pick
from activesteer.analysis.claims.path_following import SYSTEMS_WITH_CONTROL, calmed
from activesteer.analysis.source import RecordingLike

NOT_REDUCED: Final = 0.95
"""An amplitude is not reduced when it stays above this fraction of the one without control."""
TRACK: Final = "track_amplitude_m"
AMPLITUDES: Final = ("yaw_rate_gates_rms_radps", "sideslip_gates_rms_rad")
STEERING: Final = "steering_wheel_gates_rms_rad"


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims Z1 to Z4.

    Args:
        recordings: Slaloms around the same cones, by system; the three of `SYSTEMS` are needed.

    Returns:
        Four claims, in order. A value that does not exist (nan) lets its claim fail.

    Raises:
        ParameterError: one of the three runs is missing.
        RecordingError: a run has no course, or a channel is missing.
    """
    runs = all_metrics(recordings, path_following.metrics, "slalom")
    text = "Each system reduces the oscillation of yaw rate and sideslip after the last gate."
    return [_track(runs), calmed(runs, "Z2", text), _front_system(runs), _rear_system(runs)]


def _track(runs: Runs) -> Claim:
    none = runs["none"][TRACK]
    return Claim(
        "Z1",
        "Without control the track swings wider.",
        "The amplitude of the front axle centre's track between first and last cone (half the distance of its leftmost "
        "and rightmost place) is larger for none than for ars and for afs.",
        all(none > runs[system][TRACK] for system in SYSTEMS_WITH_CONTROL),
        pick(runs, TRACK),
    )


def _front_system(runs: Runs) -> Claim:
    none, ars, afs = (runs[system] for system in SYSTEMS)
    kept = all(afs[metric] >= NOT_REDUCED * none[metric] for metric in AMPLITUDES)
    return Claim(
        "Z3",
        "Front superposition does not reduce the amplitudes, and needs large angles of the driver.",
        "Between the cones, the root mean squares of yaw rate and of sideslip of afs are not more than "
        f"{100.0 * (1.0 - NOT_REDUCED):.0f} % below those of none, and that of its steering wheel angle is the largest "
        "of the three.",
        kept and afs[STEERING] > none[STEERING] and afs[STEERING] > ars[STEERING],
        pick(runs, *AMPLITUDES, STEERING),
    )


def _rear_system(runs: Runs) -> Claim:
    ars = runs["ars"]
    return Claim(
        "Z4",
        "Rear steering has the smallest amplitudes of yaw rate and sideslip.",
        "Between the cones, the root mean squares of yaw rate and of sideslip of ars are below those of none and afs.",
        all(ars[metric] < runs[other][metric] for metric in AMPLITUDES for other in ("none", "afs")),
        pick(runs, *AMPLITUDES),
    )

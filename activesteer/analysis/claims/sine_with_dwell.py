"""What the paper says about the sine with dwell, as checks on three recordings.

The criteria were written down before any parameter was chosen for this manoeuvre. Ratios are those of FMVSS 126, from
the completion of steer. Where a system must keep the car, their magnitude counts: a car that swings back fails too,
which is stricter than the standard. Where the control-free car must be lost, they count with their sign, as there.

Source: V. Dorsch, Mecatronics-REM 2012, section on the single sine with dwell; 49 CFR 571.126.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis import sine_with_dwell
from activesteer.analysis.claims.claim import Claim, Runs, all_metrics
from activesteer.analysis.sine_with_dwell import INSTANTS_S, RATIO_LIMITS
from activesteer.analysis.source import RecordingLike

LOST_SIDESLIP_RAD: Final = math.radians(20.0)
"""Beyond this sideslip angle a car is lost [rad]."""
MIN_ANGLE_RAD: Final = math.radians(0.1)
"""Two added angles are compared where both are larger than this [rad]."""
OPPOSITE_FRACTION: Final = 0.9
"""Share of this time in which they must be opposite."""
MIN_COMMON_S: Final = 0.1
"""Time for which both must be that large at all [s]."""

RATIOS: Final = ("yaw_rate_after_1000ms_share", "yaw_rate_after_1750ms_share")
SIDESLIP: Final = "sideslip_peak_abs_rad"
_LIMITS: Final = " and ".join(
    f"{100.0 * limit:.0f} % {instant_s:.2f} s" for limit, instant_s in zip(RATIO_LIMITS, INSTANTS_S, strict=True)
)


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims D1 to D5.

    Args:
        recordings: Sines with dwell with the same steering input, by system; the three of `SYSTEMS` are needed.

    Returns:
        Five claims, in order. A value that does not exist (nan) lets its claim fail.

    Raises:
        ParameterError: one of the three runs is missing.
        RecordingError: a run is no sine with dwell.
    """
    runs = all_metrics(recordings, sine_with_dwell.metrics, "sine with dwell")
    return [
        _lost(runs),
        _kept(runs, "D2", "ars", "Rear steering keeps the car."),
        _kept(runs, "D3", "afs", "Front superposition keeps the car."),
        _opposite(recordings),
        _effective(runs),
    ]


def _lost(runs: Runs) -> Claim:
    none = runs["none"]
    failed = any(none[ratio] > limit for ratio, limit in zip(RATIOS, RATIO_LIMITS, strict=True))
    return Claim(
        "D1",
        "Without control the car is lost.",
        f"The yaw rate of none is above at least one of the limits of FMVSS 126 ({_LIMITS} after the completion of "
        f"steer), and its sideslip goes beyond {math.degrees(LOST_SIDESLIP_RAD):.0f} deg.",
        failed and none[SIDESLIP] > LOST_SIDESLIP_RAD,
        {f"none_{metric}": none[metric] for metric in (*RATIOS, SIDESLIP)},
    )


def _kept(runs: Runs, number: str, system: str, text: str) -> Claim:
    run = runs[system]
    return Claim(
        number,
        text,
        f"The magnitude of the yaw rate of {system} is at most {_LIMITS} after the completion of steer, of its first "
        "peak after the steering reversal (FMVSS 126).",
        all(abs(run[ratio]) <= limit for ratio, limit in zip(RATIOS, RATIO_LIMITS, strict=True)),
        {f"{system}_{ratio}": run[ratio] for ratio in RATIOS},
    )


def _opposite(recordings: Mapping[str, RecordingLike]) -> Claim:
    """D4, from the angles that the controllers demand: what the hinges give under load is nothing that they add."""
    rear, front, step_s = _added_angles(recordings["ars"], recordings["afs"])
    both = (np.abs(rear) > MIN_ANGLE_RAD) & (np.abs(front) > MIN_ANGLE_RAD)
    common_s = float(np.count_nonzero(both)) * step_s
    fraction = float(np.mean(rear[both] * front[both] < 0.0)) if both.any() else math.nan
    scale = float(np.sqrt(np.sum(rear**2) * np.sum(front**2)))
    correlation = float(np.sum(rear * front)) / scale if scale > 0.0 else math.nan
    return Claim(
        "D4",
        "The angles that the two systems add have opposite signs.",
        f"From the steering reversal to {INSTANTS_S[-1]:.2f} s after the completion of steer, the rear angle demanded "
        "by ars times the angle demanded by afs integrates to less than 0, and while both are larger than "
        f"{math.degrees(MIN_ANGLE_RAD):.1f} deg, at least {MIN_COMMON_S:.1f} s in all, they are opposite for "
        f"{100.0 * OPPOSITE_FRACTION:.0f} % of the time.",
        correlation < 0.0 and common_s >= MIN_COMMON_S and fraction >= OPPOSITE_FRACTION,
        {
            "added_angles_correlation": correlation,
            "added_angles_opposite_share": fraction,
            "added_angles_common_s": common_s,
        },
    )


def _added_angles(ars: RecordingLike, afs: RecordingLike) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Demanded rear and superposed angle over the time since the beginning of steer, and its step [s]."""
    times = sine_with_dwell.steering(ars)
    later_s = sine_with_dwell.steering(afs).begin_s - times.begin_s
    time_s = np.asarray(ars.time_s, dtype=np.float64)
    wanted = (time_s >= times.reversal_s) & (time_s <= times.completion_s + INSTANTS_S[-1])
    rear = np.asarray(ars["rear_steer_demand_rad"], dtype=np.float64)[wanted]
    front = np.interp(time_s[wanted] + later_s, afs.time_s, afs["superposition_demand_rad"])
    return rear, front, float(time_s[1] - time_s[0])


def _effective(runs: Runs) -> Claim:
    ars, afs = runs["ars"], runs["afs"]
    return Claim(
        "D5",
        "Rear steering is somewhat more effective than front superposition.",
        "The peak of the sideslip of ars and the magnitude of its yaw rate ratio 1.00 s after the completion of steer "
        "are not larger than those of afs.",
        ars[SIDESLIP] <= afs[SIDESLIP] and abs(ars[RATIOS[0]]) <= abs(afs[RATIOS[0]]),
        {f"{system}_{metric}": runs[system][metric] for metric in (SIDESLIP, RATIOS[0]) for system in ("ars", "afs")},
    )

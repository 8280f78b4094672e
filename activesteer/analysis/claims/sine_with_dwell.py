"""The paper's statements about the sine with dwell, as checks on three recordings.

The ratios are those of FMVSS 126, from the completion of steer. For a system that must keep the car, their magnitude
counts: a car that swings back fails too, which is stricter than the standard. For the car without control, which must
be lost, they count with their sign, as in the standard.

Source: V. Dorsch, Mecatronics-REM 2012, section on the single sine with dwell; 49 CFR 571.126; A. van Zanten et al.,
VDC, the vehicle dynamics control system of Bosch, SAE 950759 (1995), for the sideslip at which steering has no effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from activesteer.analysis import sine_with_dwell
from activesteer.analysis.claims.claim import SYSTEMS_WITH_CONTROL, Claim, Fake, Kind, Statement
from activesteer.analysis.claims.system_runs import SystemRuns
from activesteer.analysis.loss_of_control import LOST_SIDESLIP_RAD
from activesteer.analysis.requirement import Condition, at_least, at_most
from activesteer.analysis.sine_with_dwell import INSTANTS_S, RATIO_LIMITS
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import Array
from activesteer.metric_table import SIDESLIP_RAD

KEPT_SIDESLIP_RAD: Final = math.radians(12.0)
"""Largest sideslip angle at which the steering still turns the car on a dry road [rad]."""
MIN_ANGLE_RAD: Final = math.radians(0.1)
"""Least size of two added angles that are compared [rad]."""
OPPOSITE_FRACTION: Final = 0.9
"""Least fraction of the time of comparison in which they are opposite."""
MIN_COMMON_S: Final = 0.1
"""Least time of comparison [s]."""

RATIOS: Final = ("yaw_rate_after_1000ms_share", "yaw_rate_after_1750ms_share")
SIDESLIP: Final = "sideslip_peak_abs_rad"
_LIMITS: Final = " and ".join(
    f"{100.0 * limit:.0f} % {instant_s:.2f} s" for limit, instant_s in zip(RATIO_LIMITS, INSTANTS_S, strict=True)
)


def _kept_statement(number: str, system: str, text: str) -> Statement:
    return Statement.about(
        Kind.SYSTEMS,
        number,
        text,
        f"The yaw rate of {system} is in magnitude at most {_LIMITS} after the completion of steer, of its first "
        f"peak after the steering reversal (FMVSS 126), and its sideslip stays within "
        f"{math.degrees(KEPT_SIDESLIP_RAD):.0f} deg; none breaks these limits, and the peak of its sideslip is "
        f"at least {math.degrees(SIDESLIP_RAD):g} deg larger.",
    )


D1: Final = Statement.about(
    Kind.SYSTEMS,
    "D1",
    "Without control the car is lost.",
    f"The yaw rate of none is above at least one of the limits of FMVSS 126 ({_LIMITS} after the completion of steer), "
    f"and its sideslip exceeds {math.degrees(LOST_SIDESLIP_RAD):.0f} deg and twice the sideslip of ars and of afs.",
)
D2: Final = _kept_statement("D2", "ars", "Rear steering keeps the car.")
D3: Final = _kept_statement("D3", "afs", "Front superposition keeps the car.")
D4: Final = Statement.about(
    Kind.SYSTEMS,
    "D4",
    "The angles that the two systems add have opposite signs.",
    f"From the steering reversal to {INSTANTS_S[-1]:.2f} s after the completion of steer, the rear angle demanded "
    "by ars times the angle demanded by afs integrates to less than 0, and while both are larger than "
    f"{math.degrees(MIN_ANGLE_RAD):.1f} deg, at least {MIN_COMMON_S:.1f} s in all, they are opposite for "
    f"{100.0 * OPPOSITE_FRACTION:.0f} % of the time.",
    rejects=(Fake.ONE_REVERSED,),
)
D5: Final = Statement.about(
    Kind.SYSTEMS,
    "D5",
    "Rear steering is somewhat more effective than front superposition.",
    f"The peak of the sideslip of ars is at least {math.degrees(SIDESLIP_RAD):g} deg below the peak of afs, and the "
    "magnitude of its yaw rate ratio 1.00 s after the completion of steer is not larger; ars keeps the limits of D2.",
)
STATEMENTS: Final = (D1, D2, D3, D4, D5)


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims D1 to D5; see `scenarios.Claims`."""
    runs = SystemRuns(recordings, sine_with_dwell.metrics, "sine with dwell")
    return [_lost(runs), _kept(runs, D2, "ars"), _kept(runs, D3, "afs"), _opposite(runs), _effective(runs)]


def _lost(runs: SystemRuns) -> Claim:
    none = runs.metrics["none"]
    failed = max(at_least(none[ratio], limit, strict=True) for ratio, limit in zip(RATIOS, RATIO_LIMITS, strict=True))
    lost = at_least(none[SIDESLIP], LOST_SIDESLIP_RAD, strict=True)
    alone = [
        at_least(none[SIDESLIP], 2.0 * runs.metrics[system][SIDESLIP], strict=True) for system in SYSTEMS_WITH_CONTROL
    ]
    values = {f"none_{ratio}": none[ratio] for ratio in RATIOS}
    return runs.judge(D1, [failed, lost, *alone], values | runs.pick(SIDESLIP))


def _kept(runs: SystemRuns, statement: Statement, system: str) -> Claim:
    values = {
        f"{run}_{metric}": runs.metrics[run][metric] for metric in (*RATIOS, SIDESLIP) for run in ("none", system)
    }
    breaks = Condition(-min(_keeps(runs, "none")).margin, strict=True)
    lowers = runs.lowers(system, SIDESLIP, 1.0, SIDESLIP_RAD)
    return runs.judge(statement, [*_keeps(runs, system), breaks, *lowers], values)


def _keeps(runs: SystemRuns, system: str) -> list[Condition]:
    within = [at_most(runs.size(system, ratio), limit) for ratio, limit in zip(RATIOS, RATIO_LIMITS, strict=True)]
    return [*within, at_most(runs.metrics[system][SIDESLIP], KEPT_SIDESLIP_RAD)]


def _opposite(runs: SystemRuns) -> Claim:
    """Check D4 with the angles that the controllers demand, without the give of the hinges under load."""
    nothing = np.empty(0), np.empty(0), 0.0
    rear, front, step_s = _added_angles(runs.recordings["ars"], runs.recordings["afs"]) if runs.whole else nothing
    both = (np.abs(rear) > MIN_ANGLE_RAD) & (np.abs(front) > MIN_ANGLE_RAD)
    common_s = float(np.count_nonzero(both)) * step_s
    fraction = float(np.mean(rear[both] * front[both] < 0.0)) if both.any() else math.nan
    scale = float(np.sqrt(np.sum(rear**2) * np.sum(front**2)))
    correlation = float(np.sum(rear * front)) / scale if scale > 0.0 else math.nan
    return runs.judge(
        D4,
        [
            at_most(correlation, 0.0, 1.0, strict=True),
            at_least(common_s, MIN_COMMON_S),
            at_least(fraction, OPPOSITE_FRACTION),
        ],
        {
            "added_angles_correlation": correlation,
            "added_angles_opposite_share": fraction,
            "added_angles_common_s": common_s,
        },
    )


def _added_angles(ars: RecordingLike, afs: RecordingLike) -> tuple[Array, Array, float]:
    """Return demanded rear and superposed angle over the time since the beginning of steer, and its step [s]."""
    times = sine_with_dwell.steering(ars)
    later_s = sine_with_dwell.steering(afs).begin_s - times.begin_s
    time_s = np.asarray(ars.time_s, dtype=np.float64)
    wanted = (time_s >= times.reversal_s) & (time_s <= times.completion_s + INSTANTS_S[-1])
    rear = np.asarray(ars["rear_steer_demand_rad"], dtype=np.float64)[wanted]
    front = np.interp(time_s[wanted] + later_s, afs.time_s, afs["superposition_demand_rad"])
    return rear, front, float(time_s[1] - time_s[0])


def _effective(runs: SystemRuns) -> Claim:
    less = at_least(runs.metrics["afs"][SIDESLIP] - runs.metrics["ars"][SIDESLIP], SIDESLIP_RAD)
    sooner = at_most(runs.size("ars", RATIOS[0]), runs.size("afs", RATIOS[0]), RATIO_LIMITS[0])
    return runs.judge(
        D5,
        [*_keeps(runs, "ars"), less, sooner],
        {f"{run}_{metric}": runs.metrics[run][metric] for metric in (SIDESLIP, RATIOS[0]) for run in ("ars", "afs")},
    )

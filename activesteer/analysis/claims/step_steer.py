"""The paper's statements about the step steer, as checks on three recordings.

Source: V. Dorsch, Implementation of active Steering Systems into a Multibody Vehicle Model by Co-Simulation,
Mecatronics-REM 2012, section on the step steering input.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from activesteer.analysis import step_response
from activesteer.analysis.claims.action import mean_straight_ahead
from activesteer.analysis.claims.claim import SYSTEMS, SYSTEMS_WITH_CONTROL, Claim, Fake, Kind, Statement
from activesteer.analysis.claims.system_runs import SystemRuns
from activesteer.analysis.requirement import at_least, at_most
from activesteer.analysis.series import crossing_time, smooth, timestep
from activesteer.analysis.source import RecordingLike
from activesteer.metric_table import SETTLED_SIDESLIP_RAD, STEER_RAD, TIME_S, YAW_RATE_RADPS

PEAK: Final = "yaw_rate_peak_abs_radps"
"""Peak over the whole run, to either side: the peak of a car that swings back counts too."""
DELAYS: Final = ("yaw_rate_response_time_s", "ay_response_time_s")
SIGNALS: Final = ("yaw_rate_radps", "ay_mps2")
COMMON_DELAYS: Final = ("yaw_rate_delay_s", "ay_delay_s")
"""Times at which the signals reach a common level, 90 % of the steady-state value of none."""
SIDESLIP: Final = "sideslip_steady_state_rad"
STEADY: Final = "yaw_rate_steady_state_radps"
LEVEL: Final = 0.9
"""Fraction of the steady-state value of none at which the delays are compared."""
KEPT: Final = 0.8
"""Least fraction of the steady-state yaw rate that a system must keep; with less, the car only turns less."""
_LOWER: Final = (
    f"at least {math.degrees(YAW_RATE_RADPS):g} deg/s below the peak of none, with at least {100.0 * KEPT:.0f} % of "
    "its steady-state value"
)
_HELPS: Final = f"the peak yaw rate of {{}} is {_LOWER}"
"""Benefit without which the angles and the sideslip of a system prove nothing."""
TURNED: Final = (("rear_steer", "rad"), ("superposition", "rad"), ("sideslip", "rad"))
"""Settled angles that count from straight ahead, where the offset of a sensor also turns wheels."""

S1: Final = Statement.about(
    Kind.SYSTEMS,
    "S1",
    "Both systems lower the peak of the yaw rate.",
    f"The peak yaw rates of ars and of afs are {_LOWER}.",
)
S2: Final = Statement.about(
    Kind.SYSTEMS,
    "S2",
    "Neither system makes the car answer later while it lowers the peak.",
    "Yaw rate and lateral acceleration of ars and of afs reach 90 % of the steady-state values of none, counted from "
    f"half the steering angle, at most {1000.0 * TIME_S:.0f} ms after none; and their peak yaw rates are {_LOWER}. "
    "The paper's figure has the three curves in one diagram, where a delay is a distance at one level. The times to "
    "90 % of each run's own steady-state value are given, and do not decide: a system that raises its steady state "
    "reaches 90 % of it later without answering later.",
)
S3: Final = Statement.about(
    Kind.SYSTEMS,
    "S3",
    "The rear wheels settle turned against the front wheels.",
    "The steady-state rear angle of ars, counted from straight ahead, less the angle of none (the give "
    f"of the hinges), has the opposite sign to the front wheels, and at least {math.degrees(STEER_RAD):g} deg; "
    f"{_HELPS.format('ars')}.",
    rejects=(Fake.REVERSED,),
)
S4: Final = Statement.about(
    Kind.SYSTEMS,
    "S4",
    "The superposed angle adds to the driver's.",
    "The steady-state superposition angle of afs, counted from straight ahead, less the angle of none (the give of "
    f"the gear), has the sign of the steering wheel angle, and at least {math.degrees(STEER_RAD):g} deg; "
    f"{_HELPS.format('afs')}.",
    rejects=(Fake.REVERSED,),
)
S5: Final = Statement.about(
    Kind.SYSTEMS,
    "S5",
    "Rear steering makes the sideslip angle larger.",
    "The magnitude of the steady-state sideslip angle of ars, counted from straight ahead, is above the values of none "
    f"and of afs by at least {math.degrees(SETTLED_SIDESLIP_RAD):g} deg; {_HELPS.format('ars')}.",
)
STATEMENTS: Final = (S1, S2, S3, S4, S5)


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims S1 to S5; see `scenarios.Claims`."""
    runs = SystemRuns(recordings, _metrics, "step steer")
    steady = runs.metrics["none"][STEADY]
    helps = {
        system: [
            *runs.lowers(system, PEAK, 1.0, YAW_RATE_RADPS),
            at_least(runs.metrics[system][STEADY] * steady, KEPT * steady**2),
        ]
        for system in SYSTEMS_WITH_CONTROL
    }
    lowered = [*helps["ars"], *helps["afs"]]
    delays = _common_delays(runs)
    prompt = [
        at_most(delays[f"{system}_{name}"], delays[f"none_{name}"] + TIME_S, TIME_S)
        for system in SYSTEMS_WITH_CONTROL
        for name in COMMON_DELAYS
    ]
    rear_rad = _added(runs, "ars", "rear_steer_steady_state_rad")
    front_rad = runs.metrics["ars"]["front_steer_steady_state_rad"]
    added_rad = _added(runs, "afs", "superposition_steady_state_rad")
    wheel_rad = runs.metrics["afs"]["steering_wheel_steady_state_rad"]
    return [
        runs.judge(S1, lowered, runs.pick(PEAK, STEADY)),
        runs.judge(S2, [*lowered, *prompt], delays | runs.pick(*DELAYS)),
        runs.judge(
            S3,
            [*helps["ars"], at_least(-rear_rad * math.copysign(1.0, front_rad), STEER_RAD)],
            {"ars_added_rear_steer_steady_state_rad": rear_rad, "ars_front_steer_steady_state_rad": front_rad},
        ),
        runs.judge(
            S4,
            [*helps["afs"], at_least(added_rad * math.copysign(1.0, wheel_rad), STEER_RAD)],
            {
                "afs_added_superposition_steady_state_rad": added_rad,
                "afs_steering_wheel_steady_state_rad": wheel_rad,
            },
        ),
        runs.judge(
            S5,
            [*helps["ars"], *runs.is_largest("ars", SIDESLIP, SETTLED_SIDESLIP_RAD)],
            runs.pick(SIDESLIP),
        ),
    ]


def _metrics(recording: RecordingLike) -> dict[str, float]:
    values = step_response.metrics(recording)
    for name, unit in TURNED:
        values[f"{name}_steady_state_{unit}"] -= mean_straight_ahead(recording, f"{name}_{unit}")
    return values | {PEAK: float(np.abs(recording["yaw_rate_radps"]).max())}


def _common_delays(runs: SystemRuns) -> dict[str, float]:
    """Return the times at which the signals reach the common level, from half the steering angle, named as metrics [s].

    A time is nan if its run is incomplete or stays below the level.
    """
    found = {f"{system}_{name}": math.nan for name in COMMON_DELAYS for system in SYSTEMS}
    for channel, name in zip(SIGNALS, COMMON_DELAYS, strict=True) if runs.whole else ():
        steady = runs.metrics["none"][f"{channel.rpartition('_')[0]}_steady_state_{channel.rpartition('_')[2]}"]
        for system in SYSTEMS:
            recording, begin_s = runs.recordings[system], runs.metrics[system]["step_time_s"]
            time_s = np.asarray(recording.time_s, dtype=np.float64)
            moving = math.copysign(1.0, steady) * smooth(recording[channel], timestep(time_s))
            after = time_s >= begin_s
            found[f"{system}_{name}"] = crossing_time(time_s[after], moving[after], LEVEL * abs(steady)) - begin_s
    return found


def _added(runs: SystemRuns, system: str, metric: str) -> float:
    """Return the angle that a system adds to the give of the hinges, which the car without control has too."""
    return runs.metrics[system][metric] - runs.metrics["none"][metric]

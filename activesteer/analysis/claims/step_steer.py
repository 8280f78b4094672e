"""What the paper says about the step steer, as checks on three recordings.

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
from activesteer.analysis.claims.claim import SYSTEMS_WITH_CONTROL, Claim, Fake, Kind, Statement
from activesteer.analysis.claims.trio import Trio
from activesteer.analysis.source import RecordingLike
from activesteer.metric_table import SETTLED_SIDESLIP_RAD, STEER_RAD, TIME_S, YAW_RATE_RADPS

PEAK: Final = "yaw_rate_peak_abs_radps"
"""Over the whole run, to either side: that of a car that swings back counts too."""
DELAYS: Final = ("yaw_rate_response_time_s", "ay_response_time_s")
SIDESLIP: Final = "sideslip_steady_state_rad"
STEADY: Final = "yaw_rate_steady_state_radps"
KEPT: Final = 0.8
"""A system that takes more of the steady-state yaw rate than the rest of this makes the car turn less, not better."""
_LOWER: Final = (
    f"at least {math.degrees(YAW_RATE_RADPS):g} deg/s below that of none, with at least {100.0 * KEPT:.0f} % of its "
    "steady-state value"
)
_HELPS: Final = f"the peak yaw rate of {{}} is {_LOWER}"
"""What a system must do for its angles and its sideslip to say something about it: one that does harm is another."""
TURNED: Final = (("rear_steer", "rad"), ("superposition", "rad"), ("sideslip", "rad"))
"""Settled angles that count from straight ahead: the offset of a sensor turns wheels there too."""

S1: Final = Statement.about(
    Kind.SYSTEMS,
    "S1",
    "Both systems lower the peak of the yaw rate.",
    f"The peak yaw rate of ars and that of afs are {_LOWER}.",
    Fake.NO_EFFECT,
    Fake.REVERSED,
)
S2: Final = Statement.about(
    Kind.SYSTEMS,
    "S2",
    "Neither system makes the car answer later while it lowers the peak.",
    "Yaw rate and lateral acceleration of ars and of afs reach 90 % of their steady-state values, counted from half "
    f"the steering angle, at most {1000.0 * TIME_S:.0f} ms after those of none; and their peak yaw rates are {_LOWER}.",
    Fake.NO_EFFECT,
    Fake.REVERSED,
)
S3: Final = Statement.about(
    Kind.SYSTEMS,
    "S3",
    "The rear wheels settle turned against the front wheels.",
    "The steady-state rear angle of ars, counted from straight ahead, less that of none (the give of the "
    f"hinges), has the sign opposite to that of the front wheels, and at least {math.degrees(STEER_RAD):g} deg; "
    f"{_HELPS.format('ars')}.",
    Fake.REVERSED,
)
S4: Final = Statement.about(
    Kind.SYSTEMS,
    "S4",
    "The superposed angle adds to the driver's.",
    "The steady-state superposition angle of afs, counted from straight ahead, less that of none (the give of "
    f"the gear), has the sign of the steering wheel angle, and at least {math.degrees(STEER_RAD):g} deg; "
    f"{_HELPS.format('afs')}.",
    Fake.REVERSED,
)
S5: Final = Statement.about(
    Kind.SYSTEMS,
    "S5",
    "Rear steering makes the sideslip angle larger.",
    "The magnitude of the steady-state sideslip angle of ars, counted from straight ahead, is above those of none "
    f"and of afs by at least {math.degrees(SETTLED_SIDESLIP_RAD):g} deg; {_HELPS.format('ars')}.",
    Fake.NO_EFFECT,
    Fake.REVERSED,
)
STATEMENTS: Final = (S1, S2, S3, S4, S5)


def claims(recordings: Mapping[str, RecordingLike]) -> list[Claim]:
    """Check claims S1 to S5.

    Args:
        recordings: Step steers with the same steering input, by system; the three of `SYSTEMS` are needed.

    Returns:
        Five claims, in order. A value that does not exist (nan) lets its claim fail.

    Raises:
        ParameterError: one of the three runs is missing.
        RecordingError: a run is no step steer.
    """
    trio = Trio(recordings, _metrics, "step steer")
    steady = trio.metrics["none"][STEADY]
    helps = {
        system: trio.lowers(system, PEAK, 1.0, YAW_RATE_RADPS)
        and trio.metrics[system][STEADY] * steady >= KEPT * steady**2
        for system in SYSTEMS_WITH_CONTROL
    }
    lowered = all(helps.values())
    prompt = all(
        trio.metrics[system][name] <= trio.metrics["none"][name] + TIME_S
        for system in SYSTEMS_WITH_CONTROL
        for name in DELAYS
    )
    rear_rad = _added(trio, "ars", "rear_steer_steady_state_rad")
    front_rad = trio.metrics["ars"]["front_steer_steady_state_rad"]
    added_rad = _added(trio, "afs", "superposition_steady_state_rad")
    wheel_rad = trio.metrics["afs"]["steering_wheel_steady_state_rad"]
    return [
        trio.judge(S1, lowered, trio.pick(PEAK, STEADY)),
        trio.judge(S2, lowered and prompt, trio.pick(*DELAYS)),
        trio.judge(
            S3,
            helps["ars"] and rear_rad * front_rad < 0.0 and abs(rear_rad) >= STEER_RAD,
            {"ars_added_rear_steer_steady_state_rad": rear_rad, "ars_front_steer_steady_state_rad": front_rad},
        ),
        trio.judge(
            S4,
            helps["afs"] and added_rad * wheel_rad > 0.0 and abs(added_rad) >= STEER_RAD,
            {
                "afs_added_superposition_steady_state_rad": added_rad,
                "afs_steering_wheel_steady_state_rad": wheel_rad,
            },
        ),
        trio.judge(
            S5,
            helps["ars"] and trio.is_largest("ars", SIDESLIP, SETTLED_SIDESLIP_RAD),
            trio.pick(SIDESLIP),
        ),
    ]


def _metrics(recording: RecordingLike) -> dict[str, float]:
    values = step_response.metrics(recording)
    for name, unit in TURNED:
        values[f"{name}_steady_state_{unit}"] -= mean_straight_ahead(recording, f"{name}_{unit}")
    return values | {PEAK: float(np.abs(recording["yaw_rate_radps"]).max())}


def _added(trio: Trio, system: str, metric: str) -> float:
    """What a system adds to an angle that the control-free car has too, since its hinges give under load."""
    return trio.metrics[system][metric] - trio.metrics["none"][metric]

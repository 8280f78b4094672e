"""Common parts of the claims about lane changes and slalom: oscillation after the last gate, low sideslip.

Source: A. van Zanten et al., VDC, the vehicle dynamics control system of Bosch, SAE 950759 (1995): drivers know
sideslip angles up to 2 deg from normal driving.
"""

from __future__ import annotations

import math
from typing import Final

from activesteer.analysis.claims.claim import SYSTEMS_WITH_CONTROL, Claim, Kind, Statement
from activesteer.analysis.claims.system_runs import SystemRuns
from activesteer.analysis.path_following import AFTER_S
from activesteer.analysis.requirement import Condition, at_most
from activesteer.metric_table import SIDESLIP_RAD, YAW_RATE_RADPS

CALMED: Final = 0.5
"""Largest fraction of the root mean square that is left when a system calms an oscillation."""
SETTLED_YAW_RATE_RADPS: Final = math.radians(3.0)
"""Largest root mean square of the yaw rate of a car that runs straight [rad/s]: at 80 km/h it strays 0.3 m a second."""
AFTER_YAW_RATE: Final = "yaw_rate_after_gates_rms_radps"
AFTER_SIDESLIP: Final = "sideslip_after_gates_rms_rad"
LOW_SIDESLIP_RAD: Final = math.radians(2.0)
"""Largest sideslip angle that a driver knows from normal driving [rad]."""
SIDESLIP_PEAK: Final = "sideslip_peak_abs_rad"
LARGE_STEERING_WHEEL_RAD: Final = math.radians(90.0)
"""Largest steering wheel angle without crossing arms or changing the grip [rad]."""

CALMED_WORDS: Final = (
    f"in the {AFTER_S:g} s after the last gate (front axle centre) are, for ars and for afs, at most "
    f"{100.0 * CALMED:.0f} % of the values of none and smaller by at least {math.degrees(YAW_RATE_RADPS):g} deg/s and "
    f"{math.degrees(SIDESLIP_RAD):g} deg; the remaining yaw rate is at most "
    f"{math.degrees(SETTLED_YAW_RATE_RADPS):g} deg/s"
)


def calmed(runs: SystemRuns) -> list[Condition]:
    """Return the conditions that both systems calm yaw rate and sideslip after the last gate, to straight running."""
    return [
        *(at_most(runs.metrics[system][AFTER_YAW_RATE], SETTLED_YAW_RATE_RADPS) for system in SYSTEMS_WITH_CONTROL),
        *runs.both_lower(AFTER_YAW_RATE, CALMED, YAW_RATE_RADPS),
        *runs.both_lower(AFTER_SIDESLIP, CALMED, SIDESLIP_RAD),
    ]


def held_statement(number: str) -> Statement:
    """Return L4, Z5 or W4: the paper's conclusion about the rear system, for a manoeuvre with a driver."""
    return Statement.about(
        Kind.DRIVER,
        number,
        "Rear steering holds the sideslip low.",
        f"The peak of the sideslip of ars is at most {math.degrees(LOW_SIDESLIP_RAD):g} deg, and at least "
        f"{math.degrees(SIDESLIP_RAD):g} deg below the peaks of none and of afs.",
    )


def held(runs: SystemRuns, statement: Statement) -> Claim:
    """Check L4, Z5 or W4."""
    low = at_most(runs.metrics["ars"][SIDESLIP_PEAK], LOW_SIDESLIP_RAD)
    return runs.judge(statement, [low, *runs.is_smallest("ars", SIDESLIP_PEAK, SIDESLIP_RAD)], runs.pick(SIDESLIP_PEAK))

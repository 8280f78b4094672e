"""Three synthetic runs of each scenario for which all claims hold, as arguments of their makers."""

from __future__ import annotations

from typing import Any

import numpy as np

from activesteer.analysis.claims.judge import SCENARIOS, Claim
from tests.unit.analysis import synthetic
from tests.unit.analysis.synthetic import SyntheticRun, offset_track, second_order

Arguments = dict[str, dict[str, Any]]

MAKERS = {
    "step_steer": synthetic.step_steer,
    "sine_with_dwell": synthetic.sine_with_dwell,
    "double_lane_change": synthetic.along_path,
    "slalom": synthetic.slalom,
    "double_lane_change_low_mu": synthetic.along_path,
}


def wider(share: float):
    """Return the track of a lane change, wider or narrower."""
    return lambda x: share * offset_track(x)


def good(scenario: str) -> Arguments:
    """Return the arguments of three runs for which all claims hold, by system."""
    rear, front = {"rear_rad": 0.02}, {"superposition_rad": 0.02}
    return {
        "step_steer": {
            "none": {"sideslip_rad": -0.01},
            "ars": {"yaw": damped, "sideslip_rad": -0.015, "rear_rad": -0.01},
            "afs": {"yaw": damped, "sideslip_rad": -0.01, "superposition_rad": 0.005},
        },
        "sine_with_dwell": {
            "none": {"after_1000ms": 0.7, "after_1750ms": 0.6, "sideslip_rad": np.radians(30.0)},
            "ars": {"after_1000ms": 0.10, "after_1750ms": 0.02, "sideslip_rad": 0.05, "rear_rad": 0.02},
            "afs": {"after_1000ms": 0.20, "after_1750ms": 0.05, "sideslip_rad": 0.06, "superposition_rad": -0.03},
        },
        "double_lane_change": {
            "none": {"yaw_rate": 0.30, "sideslip": 0.05, "track": wider(1.02)},
            "ars": {"yaw_rate": 0.25, "sideslip": 0.03, "after": 0.2, "track": wider(0.98), **rear},
            "afs": {"yaw_rate": 0.26, "sideslip": 0.04, "after": 0.25, "track": wider(1.0), **front},
        },
        "slalom": {
            "none": {"amplitude_m": 1.6, "yaw_rate": 0.30, "sideslip": 0.05, "steering_rad": 1.0},
            "ars": {"amplitude_m": 1.4, "yaw_rate": 0.20, "sideslip": 0.03, "after": 0.2, "steering_rad": 0.8, **rear},
            "afs": {
                "amplitude_m": 1.5, "yaw_rate": 0.31, "sideslip": 0.06, "after": 0.1, "steering_rad": 1.7, **front,
            },
        },
        "double_lane_change_low_mu": {
            "none": {"track": wider(1.6), "steering_rad": 3.0, "yaw_rate": 0.3, "sideslip": 0.2},
            "ars": {"track": wider(1.02), "steering_rad": 0.9, "after": 0.2, **rear},
            "afs": {"track": wider(0.98), "steering_rad": 1.2, "sideslip": 0.03, "after": 0.2, **front},
        },
    }[scenario]  # fmt: skip


def damped(time_s: np.ndarray) -> np.ndarray:
    """Return a yaw rate that is faster and overshoots less than without control."""
    return second_order(time_s, 10.0, 0.6)


def runs_of(scenario: str, arguments: Arguments, **words: Any) -> dict[str, SyntheticRun]:
    """Return the runs by system; the keywords apply to all of them."""
    return {system: MAKERS[scenario](**own, **words) for system, own in arguments.items()}


def check(scenario: str, arguments: Arguments, **words: Any) -> dict[str, Claim]:
    """Return the claims for runs with these arguments, by number."""
    return {claim.id: claim for claim in SCENARIOS[scenario](runs_of(scenario, arguments, **words))}


def failing(scenario: str, arguments: Arguments, **words: Any) -> list[str]:
    """Return the numbers of the claims that fail."""
    return [number for number, claim in check(scenario, arguments, **words).items() if not claim.passed]

"""What the paper says about the step steer, as checks on three recordings.

The criteria were written down before any parameter of the controllers was chosen.

Source: V. Dorsch, Implementation of active Steering Systems into a Multibody Vehicle Model by Co-Simulation,
Mecatronics-REM 2012, section on the step steering input.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from activesteer.analysis import step_response
from activesteer.analysis.claims.claim import Claim, Runs, all_metrics, pick
from activesteer.analysis.source import RecordingLike

DELAY_TOLERANCE_S: Final = 0.005
"""A response time counts as longer when it is longer by more than this [s]: five steps of the controller."""

MIN_ANGLE_RAD: Final = math.radians(0.01)
"""A settled angle smaller than this has no sign [rad]."""


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
    runs = all_metrics(recordings, step_response.metrics, "step steer")
    return [_peak(runs), _delay(runs), _rear_angle(runs), _front_angle(runs), _sideslip(runs)]


def _peak(runs: Runs) -> Claim:
    values = pick(runs, "yaw_rate_peak_radps")
    none, ars, afs = (abs(value) for value in values.values())
    return Claim(
        "S1",
        "Both systems lower the peak of the yaw rate.",
        "The peak yaw rate of ars and of afs is below that of none.",
        ars < none and afs < none,
        values,
    )


def _delay(runs: Runs) -> Claim:
    values = pick(runs, "yaw_rate_response_time_s")
    none, ars, afs = values.values()
    return Claim(
        "S2",
        "Neither system makes the car answer later.",
        "The yaw rate of ars and of afs reaches 90 % of its steady-state value, counted from half the steering angle, "
        f"at most {1000.0 * DELAY_TOLERANCE_S:.0f} ms after that of none.",
        ars <= none + DELAY_TOLERANCE_S and afs <= none + DELAY_TOLERANCE_S,
        values,
    )


def _rear_angle(runs: Runs) -> Claim:
    rear_rad = _added(runs, "ars", "rear_steer_steady_state_rad")
    front_rad = runs["ars"]["front_steer_steady_state_rad"]
    return Claim(
        "S3",
        "The rear wheels settle turned against the front wheels.",
        "The steady-state rear angle of ars, less that of none (the give of the hinges), has the sign opposite to that "
        "of the front wheels.",
        rear_rad * front_rad < 0.0 and abs(rear_rad) > MIN_ANGLE_RAD,
        {"ars_added_rear_steer_steady_state_rad": rear_rad, "ars_front_steer_steady_state_rad": front_rad},
    )


def _front_angle(runs: Runs) -> Claim:
    added_rad = _added(runs, "afs", "superposition_steady_state_rad")
    wheel_rad = runs["afs"]["steering_wheel_steady_state_rad"]
    return Claim(
        "S4",
        "The superposed angle adds to the driver's.",
        "The steady-state superposition angle of afs, less that of none (the give of the gear), has the sign of the "
        "steering wheel angle.",
        added_rad * wheel_rad > 0.0 and abs(added_rad) > MIN_ANGLE_RAD,
        {"afs_added_superposition_steady_state_rad": added_rad, "afs_steering_wheel_steady_state_rad": wheel_rad},
    )


def _sideslip(runs: Runs) -> Claim:
    values = pick(runs, "sideslip_steady_state_rad")
    return Claim(
        "S5",
        "Rear steering makes the sideslip angle larger.",
        "The magnitude of the steady-state sideslip angle of ars is above that of none.",
        abs(values["ars_sideslip_steady_state_rad"]) > abs(values["none_sideslip_steady_state_rad"]),
        values,
    )


def _added(runs: Runs, system: str, metric: str) -> float:
    """What a system adds to an angle that the control-free car has too, since its hinges give under load."""
    return runs[system][metric] - runs["none"][metric]

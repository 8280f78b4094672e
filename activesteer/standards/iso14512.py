"""ISO 14512: straight-ahead braking on surfaces with split coefficient of friction, steering wheel held."""

from __future__ import annotations

import math
from typing import Final

from activesteer.plotting import Picture
from activesteer.standards.standard import Findings, Standard, StandardRun, TestRunner, metrics_table, time_panels

AFTER_S: Final = 1.0
"""Time after the beginning of braking at which the car is evaluated [s]."""
HIGH, LOW = 0.9, 0.3
"""Friction of the two sides, relative to the tyre file."""
_CASES: Final = {
    "high friction on the left": {"road.mu_left": HIGH, "road.mu_right": LOW},
    "high friction on the right": {"road.mu_left": LOW, "road.mu_right": HIGH},
}
_CHANNELS: Final = ("yaw_rate_radps", "yaw_rad", "y_m", "speed_mps")
_BEGIN_S: Final = 0.5


def after_one_second(run: StandardRun, begin_s: float) -> dict[str, float]:
    """Return the motion of the car 1 s after the beginning of braking, left positive, or nan if the run ends before."""
    then_s = begin_s + AFTER_S
    return {
        "yaw_rate_after_1000ms_radps": run.at("yaw_rate_radps", then_s),
        "yaw_angle_after_1000ms_rad": run.at("yaw_rad", then_s) - run.at("yaw_rad", begin_s),
        "lateral_deviation_after_1000ms_m": run.at("y_m", then_s) - run.at("y_m", begin_s),
    }


def _examine(runner: TestRunner) -> Findings:
    changes = {"hold_line": False, "brake.start_s": _BEGIN_S}
    driven = runner.drive("split_mu", "split_mu_braking", list(_CASES.values()), changes, _CHANNELS)
    runs = dict(zip(_CASES, driven, strict=True))
    own = {label: after_one_second(run, _BEGIN_S) for label, run in runs.items()}
    worst = max(own.values(), key=lambda metrics: abs(metrics["yaw_rate_after_1000ms_radps"]))
    failed = [run.error for run in driven if run.error]
    if failed:
        summary = f"no result: {failed[0]}"
    else:
        summary = (
            f"1 s after the brake the car yaws at {abs(math.degrees(worst['yaw_rate_after_1000ms_radps'])):.1f} deg/s, "
            f"has turned by {abs(math.degrees(worst['yaw_angle_after_1000ms_rad'])):.1f} deg and has deviated by "
            f"{abs(worst['lateral_deviation_after_1000ms_m']):.2f} m"
        )
    return Findings(
        {"runs": [run.values | own[label] for label, run in runs.items()]},
        summary,
        [metrics_table("Braking", {label: {**own[label], **run.metrics} for label, run in runs.items()})],
        [Picture("Steering wheel held straight", time_panels(runs, _CHANNELS, _BEGIN_S, "the brake"))],
    )


STANDARD: Final = Standard(
    name="iso14512",
    title="ISO 14512: straight-ahead braking on split friction, steering wheel held",
    edition="ISO 14512:1999, as known from the literature; the text was not available.",
    implemented=(
        "Full braking from 80 km/h on a road with 0.9 times the friction of the tyre file on one side and 0.3 times "
        "on the other, in both arrangements. Steering wheel held straight, clutch open, anti-lock system active.",
        "Yaw rate, yaw angle and lateral deviation 1 s after the beginning of braking; deceleration and peaks.",
    ),
    left_out=(
        "Series over pedal force and speed. A driver who keeps the line: the manoeuvre split_mu_braking has one.",
        "Transverse joints of the surface, water, temperature.",
    ),
    examine=_examine,
)

"""Braking tests: straight-line stop (ISO 21994), split friction (ISO 14512), and in a turn (ISO 7975)."""

from __future__ import annotations

import math
from typing import Final

from activesteer.core.metric_table import metric
from activesteer.plotting import Curve, Panel, Picture
from activesteer.standards.standard import (
    SIDES,
    Findings,
    StandardRun,
    StandardRunner,
    metrics_table,
    steering_wheel_at,
    time_panels,
)

STOP_KMH: Final = 100.0
"""Speed at which the brake is pressed [km/h]."""
_BRAKE_S: Final = 0.5
"""Time at which the brake is pressed on a straight road [s]."""


def corrected_distance(distance_m: float, speed_mps: float, nominal_mps: float) -> float:
    """Return the stopping distance [m], scaled to the nominal speed by the square of the speed."""
    return distance_m * (nominal_mps / speed_mps) ** 2


def stop(runner: StandardRunner) -> Findings:
    """Stop from 100 km/h: ISO 21994."""
    [run] = runner.drive(
        "stop",
        "straight_braking",
        [{"speed_kmh": STOP_KMH}],
        {"brake.start_s": _BRAKE_S},
        ("speed_mps", "ax_mps2"),
    )
    distance_m = corrected_distance(run.metric("stopping_distance_m"), run.metric("speed_begin_mps"), STOP_KMH / 3.6)
    own = {"stopping_distance_corrected_m": distance_m}
    if math.isnan(distance_m):
        summary = f"no result: {run.error or 'the car does not stop within the run'}"
    else:
        summary = (
            f"{distance_m:.2f} m from {STOP_KMH:g} km/h, mean fully developed deceleration "
            f"{run.metric('mean_deceleration_mps2'):.2f} m/s²"
        )
    panels = time_panels({"": run}, ("speed_mps", "ax_mps2"), _BRAKE_S, "the brake")
    return Findings(
        run.values | own, summary, [metrics_table("Stop", {"stop": {**own, **run.metrics}})], [Picture("Stop", panels)]
    )


AFTER_S: Final = 1.0
"""Time after the start of braking at which the car is evaluated [s]."""
HIGH, LOW = 0.9, 0.3
"""Friction of the two sides, relative to the tyre file."""
_SPLIT_CASES: Final = {
    "high friction on the left": {"road.mu_left": HIGH, "road.mu_right": LOW},
    "high friction on the right": {"road.mu_left": LOW, "road.mu_right": HIGH},
}
_SPLIT_CHANNELS: Final = ("yaw_rate_radps", "yaw_rad", "y_m", "speed_mps")


def after_one_second(run: StandardRun, begin_s: float) -> dict[str, float]:
    """Return the motion of the car 1 s after the start of braking, or nan if the run ends before."""
    then_s = begin_s + AFTER_S
    return {
        "yaw_rate_after_1000ms_radps": run.at("yaw_rate_radps", then_s),
        "yaw_angle_after_1000ms_rad": run.at("yaw_rad", then_s) - run.at("yaw_rad", begin_s),
        "lateral_deviation_after_1000ms_m": run.at("y_m", then_s) - run.at("y_m", begin_s),
    }


def on_split_friction(runner: StandardRunner) -> Findings:
    """Brake on split friction with the steering wheel held: ISO 14512."""
    changes = {"hold_line": False, "brake.start_s": _BRAKE_S}
    driven = runner.drive("split_mu", "split_mu_braking", list(_SPLIT_CASES.values()), changes, _SPLIT_CHANNELS)
    runs = dict(zip(_SPLIT_CASES, driven, strict=True))
    own = {label: after_one_second(run, _BRAKE_S) for label, run in runs.items()}
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
        [Picture("Steering wheel held straight", time_panels(runs, _SPLIT_CHANNELS, _BRAKE_S, "the brake"))],
    )


TURN_KMH: Final = 80.0
TURN_MPS2: Final = 5.0
"""Steady state before braking in the turn [km/h, m/s2]: a circle of 100 m."""
PEDALS: Final = (0.12, 0.2, 0.28, 0.36, 0.44, 0.52, 0.6)
"""Pedal positions of a series, from gentle to nearly full braking."""
_SHOWN: Final = (
    "yaw_rate_deviation_after_1000ms_radps", "path_deviation_after_1000ms_m", "sideslip_peak_abs_rad",
)  # fmt: skip
_TURN_CHANNELS: Final = ("yaw_rate_radps", "sideslip_rad", "speed_mps")
_TURN_BRAKE_S: Final = 6.0
_AFTER_S: Final = 2.2
"""Duration after the start of braking [s]. It ends before the car stops, where sideslip is undefined."""


def in_a_turn(runner: StandardRunner) -> Findings:
    """Brake in a turn: ISO 7975."""
    angle_deg = steering_wheel_at(runner, TURN_KMH, TURN_MPS2)
    cases = [
        {"turn.steering_wheel_deg": sign * angle_deg, "brake.pedal": pedal}
        for sign in SIDES.values()
        for pedal in PEDALS
    ]
    changes = {"speed_kmh": TURN_KMH, "brake.start_s": _TURN_BRAKE_S, "duration_s": _TURN_BRAKE_S + _AFTER_S}
    runs = runner.drive("brake_in_turn", "brake_in_turn", cases, changes, _TURN_CHANNELS)
    by_side = {side: runs[len(PEDALS) * number :][: len(PEDALS)] for number, side in enumerate(SIDES)}
    done = [run for run in runs if not run.error]
    summary = f"no result: {runs[0].error}"
    if done:
        worst = max(done, key=lambda run: abs(run.metric("yaw_rate_deviation_after_1000ms_radps")))
        deviation = math.degrees(worst.metric("yaw_rate_deviation_after_1000ms_radps"))
        summary = (
            f"largest yaw rate deviation {deviation:+.1f} deg/s 1 s after the start of braking "
            f"({'turns in' if deviation > 0.0 else 'runs wide'}), at {worst.metric('mean_deceleration_mps2'):.1f} m/s² "
            f"of deceleration; {len(done)} of {len(runs)} runs evaluated"
        )
    tables = [
        metrics_table(f"Turn to the {side}", {f"pedal {run.case['brake.pedal']:.2f}": run.metrics for run in group})
        for side, group in by_side.items()
    ]
    hardest = {f"{side}, pedal {PEDALS[-1]:.2f}": group[-1] for side, group in by_side.items()}
    pictures = [
        Picture("Over the mean deceleration", [_over_deceleration(name, by_side) for name in _SHOWN]),
        Picture("Hardest braking", time_panels(hardest, _TURN_CHANNELS, _TURN_BRAKE_S, "the brake")),
    ]
    values = {"steering_wheel_deg": angle_deg, "runs": [run.values for run in runs]}
    return Findings(values, summary, tables, pictures)


def _over_deceleration(name: str, by_side: dict[str, list[StandardRun]]) -> Panel:
    shown = metric(name)
    curves = [
        Curve(
            [run.metric("mean_deceleration_mps2") for run in group],
            [shown.unit.factor * run.metric(name) for run in group],
            side,
            marker="o",
        )
        for side, group in by_side.items()
    ]
    return Panel("mean deceleration [m/s²]", shown.title, curves)

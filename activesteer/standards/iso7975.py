"""ISO 7975: braking in a turn, open loop."""

from __future__ import annotations

import math
from typing import Final

from activesteer.core.metric_table import metric
from activesteer.plotting import Curve, Panel, Picture
from activesteer.standards.standard import (
    SIDES,
    Findings,
    Standard,
    StandardRun,
    TestRunner,
    metrics_table,
    steering_wheel_at,
    time_panels,
)

SPEED_KMH: Final = 80.0
AY_MPS2: Final = 5.0
"""Steady state before braking [km/h, m/s2]: a circle of 100 m."""
PEDALS: Final = (0.12, 0.2, 0.28, 0.36, 0.44, 0.52, 0.6)
"""Pedal positions of a series, from gentle to nearly full braking."""
_SHOWN: Final = (
    "yaw_rate_deviation_after_1000ms_radps", "path_deviation_after_1000ms_m", "sideslip_peak_abs_rad",
)  # fmt: skip
_CHANNELS: Final = ("yaw_rate_radps", "sideslip_rad", "speed_mps")
_BEGIN_S: Final = 6.0
_AFTER_S: Final = 2.2
"""Duration after the beginning of braking [s]. It ends before the car stops, where sideslip is undefined."""


def _examine(runner: TestRunner) -> Findings:
    angle_deg = steering_wheel_at(runner, SPEED_KMH, AY_MPS2)
    cases = [
        {"turn.steering_wheel_deg": sign * angle_deg, "brake.pedal": pedal}
        for sign in SIDES.values()
        for pedal in PEDALS
    ]
    changes = {"speed_kmh": SPEED_KMH, "brake.start_s": _BEGIN_S, "duration_s": _BEGIN_S + _AFTER_S}
    runs = runner.drive("brake_in_turn", "brake_in_turn", cases, changes, _CHANNELS)
    by_side = {side: runs[len(PEDALS) * number :][: len(PEDALS)] for number, side in enumerate(SIDES)}
    done = [run for run in runs if not run.error]
    summary = f"no result: {runs[0].error}"
    if done:
        worst = max(done, key=lambda run: abs(run.metric("yaw_rate_deviation_after_1000ms_radps")))
        deviation = math.degrees(worst.metric("yaw_rate_deviation_after_1000ms_radps"))
        summary = (
            f"largest yaw rate deviation {deviation:+.1f} deg/s 1 s after the beginning of braking "
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
        Picture("Hardest braking", time_panels(hardest, _CHANNELS, _BEGIN_S, "the brake")),
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


STANDARD: Final = Standard(
    name="iso7975",
    title="ISO 7975: braking in a turn, open loop",
    edition="ISO 7975:2019, as known from the literature; the text was not available.",
    implemented=(
        "Steady state at 80 km/h and 5 m/s² (100 m), left and right; throttle released, brake applied within 0.2 s, "
        "steering wheel held at the angle at which the tested car reaches 5 m/s² in a slow ramp.",
        "Series of pedal positions, and so of decelerations. Deviations of yaw rate and path from the steady circle "
        "1 s after the beginning of braking, mean deceleration, peaks.",
    ),
    left_out=(
        "Constant lateral acceleration at other radii. A locked wheel does not end the series.",
        "Repetitions: without noise all runs are identical.",
    ),
    examine=_examine,
)

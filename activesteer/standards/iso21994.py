"""ISO 21994: stopping distance at straight-line braking with an anti-lock system."""

from __future__ import annotations

import math
from typing import Final

from activesteer.plotting import Picture
from activesteer.standards.standard import Findings, Standard, TestRunner, metrics_table, time_panels

SPEED_KMH: Final = 100.0
"""Speed at which the brake is pressed [km/h]."""
_BEGIN_S: Final = 0.5


def corrected_distance(distance_m: float, speed_mps: float, nominal_mps: float) -> float:
    """Return the stopping distance at the nominal speed [m]. It is proportional to the square of the speed."""
    return distance_m * (nominal_mps / speed_mps) ** 2


def _examine(runner: TestRunner) -> Findings:
    [run] = runner.drive(
        "stop",
        "straight_braking",
        [{"speed_kmh": SPEED_KMH}],
        {"brake.start_s": _BEGIN_S},
        ("speed_mps", "ax_mps2"),
    )
    distance_m = corrected_distance(run.metric("stopping_distance_m"), run.metric("speed_begin_mps"), SPEED_KMH / 3.6)
    own = {"stopping_distance_corrected_m": distance_m}
    if math.isnan(distance_m):
        summary = f"no result: {run.error or 'the car does not stop within the run'}"
    else:
        summary = (
            f"{distance_m:.2f} m from {SPEED_KMH:g} km/h, mean fully developed deceleration "
            f"{run.metric('mean_deceleration_mps2'):.2f} m/s²"
        )
    panels = time_panels({"": run}, ("speed_mps", "ax_mps2"), _BEGIN_S, "the brake")
    return Findings(
        run.values | own, summary, [metrics_table("Stop", {"stop": {**own, **run.metrics}})], [Picture("Stop", panels)]
    )


STANDARD: Final = Standard(
    name="iso21994",
    title="ISO 21994: stopping distance at straight-line braking with an anti-lock system",
    edition="ISO 21994:2007, as known from the literature; the text was not available.",
    implemented=(
        "Full braking from 100 km/h to standstill on an even dry road (0.9 times the friction of the tyre file), "
        "clutch open, pedal fully pressed within 0.1 s. The driver keeps the line.",
        "Stopping distance from the beginning of pedal travel, corrected to 100 km/h by the square of the speed; "
        "mean fully developed deceleration from 80 to 10 % of the speed (UN R13-H).",
    ),
    left_out=(
        "Repetitions and their mean: without noise all runs are identical.",
        "Temperature of brakes and tyres, bedding in. For a wet surface use --set road.mu.",
    ),
    examine=_examine,
)

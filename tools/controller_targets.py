"""Targets of a controller beyond the paper's, relative to no control, to the paper's systems and to the brakes.

The targets were set before any of these controllers was tuned.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, Final, NamedTuple

from activesteer.analysis.requirement import Names, Requirement, Run, Runs
from activesteer.config import Source
from activesteer.metric_table import metric

NONE: Final = "none"
REFERENCES: Final = ("ars", "afs", "esc")
"""Reference controllers: the paper's two systems, and the system that the law requires."""
HARMED_PROPORTION: Final = 0.01
"""Largest proportion of runs of a population that a controller harms; see `analysis.harm`."""
TRACK_HARM_M: Final = 0.10
"""Largest growth of a lane overstep or path error by a controller in any run [m]."""


class Target(NamedTuple):
    """Verdict on a target of a controller; the text holds the target and the result."""

    controller: str
    text: str
    passed: bool


_RULES: Final = (
    ("step_steer", "abs(yaw_rate_overshoot(controller)) <= 0.03"),
    ("step_steer", "abs(yaw_rate_response_time_s(controller)) <= abs(yaw_rate_response_time_s(none))"),
    ("step_steer", "abs(ay_response_time_s(controller)) <= abs(ay_response_time_s(none))"),
    ("step_steer", "abs(sideslip_peak_rad(controller)) <= abs(sideslip_peak_rad(none))"),
    ("slalom", "track_amplitude_m(controller) < track_amplitude_m(none)"),
    # Cars with such systems gain as much.
    ("split_mu_braking", "stopping_distance_m(controller) <= 0.94 * stopping_distance_m(esc)"),
    ("split_mu_braking", "abs(lateral_deviation_max_m(controller)) <= abs(lateral_deviation_max_m(esc))"),
    ("severe_lane_change", "entry_speed_mps(controller) > entry_speed_mps(none)"),
)
"""Scenario and requirement of each target."""


def asked(controllers: Iterable[str]) -> list[str]:
    """Return the controllers that have targets."""
    return [name for name in controllers if name not in (NONE, *REFERENCES)]


def targets(controllers: Sequence[str], rows: Iterable[Any]) -> list[Target]:
    """Judge the nominal runs by their rows of `scenario`, `controller`, `metric` and `value`.

    A target fails if its value was sought and not found. It is left out if no controller has the metric.
    """
    runs: defaultdict[Run, dict[str, float | None]] = defaultdict(dict)
    sought = set()
    for row in rows:
        runs[Run(row.controller, row.scenario)][row.metric] = row.value
        sought.add((row.metric, row.scenario))
    found = []
    for name in asked(controllers):
        for scenario, text in _RULES:
            rule = Requirement(text, Names(None, [scenario], name), Source("targets"), ())
            if (next(iter(rule.metrics))[0], scenario) in sought:
                found.append(_judged(name, rule, runs))
    return found


def _judged(controller: str, rule: Requirement, runs: Runs) -> Target:
    (metric_name, run), *others = rule.metrics
    ((left, sign, right),) = rule.comparisons
    shown = metric(metric_name)
    value, limit = (f"{short(side(runs) * shown.unit.factor)} {shown.unit.name}" for side in (left, right))
    of = f" ({others[0][1].controller})" if others else ""
    return Target(controller, f"{run.maneuver}: {shown.label} {value}, asked for {sign} {limit}{of}", rule(runs) >= 0.0)


def short(value: float) -> str:
    """Return a number with three digits, or a hyphen for nan."""
    return "-" if math.isnan(value) else f"{value:.3g}"


def targets_text(found: Sequence[Target]) -> str:
    """Return a line for each target."""
    width = max((len(target.controller) for target in found), default=0) + 2
    return "\n".join(
        f"{target.controller:{width}}{'passed' if target.passed else 'FAILED'}  {target.text}" for target in found
    )

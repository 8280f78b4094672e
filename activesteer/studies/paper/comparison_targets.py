"""Targets of a controller beyond the paper's, relative to no control, to the paper's systems and to the brakes.

The targets were set before any of these controllers was tuned.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

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


class _Rule(NamedTuple):
    """A bound on the magnitude of a metric.

    Attributes:
        scenario: The scenario.
        metric: The metric.
        than: Controller whose value sets the bound; empty if the bound is `factor` itself.
        factor: Factor on that value.
        above: Whether it is a lower bound.
        strict: Whether the bound itself is excluded.
    """

    scenario: str
    metric: str
    than: str = ""
    factor: float = 1.0
    above: bool = False
    strict: bool = False

    def judged(self, controller: str, values: Mapping[str, float]) -> Target | None:
        """Return the verdict: failed if the value was sought and not found, None if it was not sought."""
        if not values:
            return None
        value = abs(values.get(controller, math.nan))
        bound = self.factor * (abs(values.get(self.than, math.nan)) if self.than else 1.0)
        shown = metric(self.metric)
        factor, unit = shown.unit.factor, shown.unit.name
        sign = ("<" if not self.above else ">") + ("" if self.strict else "=")
        whose = f", {self.factor:.0%} of {self.than}" if self.factor != 1.0 else f" of {self.than}"
        text = (
            f"{self.scenario}: {shown.label} {short(value * factor)} {unit}, "
            f"asked for {sign} {short(bound * factor)} {unit}{whose if self.than else ''}"
        )
        further = value > bound if self.above else value < bound
        return Target(controller, text, further or (value == bound and not self.strict))


_RULES: Final = (
    _Rule("step_steer", "yaw_rate_overshoot", factor=0.03),
    _Rule("step_steer", "yaw_rate_response_time_s", NONE),
    _Rule("step_steer", "ay_response_time_s", NONE),
    _Rule("step_steer", "sideslip_peak_rad", NONE),
    _Rule("slalom", "track_amplitude_m", NONE, strict=True),
    # Cars with such systems gain as much.
    _Rule("split_mu_braking", "stopping_distance_m", "esc", 0.94),
    _Rule("split_mu_braking", "lateral_deviation_max_m", "esc"),
    _Rule("severe_lane_change", "entry_speed_mps", NONE, above=True, strict=True),
)


def asked(controllers: Iterable[str]) -> list[str]:
    """Return the controllers that have targets."""
    return [name for name in controllers if name not in (NONE, *REFERENCES)]


def targets(controllers: Sequence[str], rows: Iterable[Any]) -> list[Target]:
    """Judge the nominal runs by their rows of `scenario`, `controller`, `metric` and `value`."""
    known: dict[tuple[str, str], dict[str, float]] = {}
    for row in rows:
        known.setdefault((row.scenario, row.metric), {})[row.controller] = row.value
    judged = (
        rule.judged(name, known.get((rule.scenario, rule.metric), {})) for name in asked(controllers) for rule in _RULES
    )
    return [target for target in judged if target is not None]


def short(value: float) -> str:
    """Return a number with three digits, or a hyphen for nan."""
    return "-" if math.isnan(value) else f"{value:.3g}"


def targets_text(found: Sequence[Target]) -> str:
    """Return a line for each target."""
    width = max((len(target.controller) for target in found), default=0) + 2
    return "\n".join(
        f"{target.controller:{width}}{'passed' if target.passed else 'FAILED'}  {target.text}" for target in found
    )

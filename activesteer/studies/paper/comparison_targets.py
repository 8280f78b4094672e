"""What a controller beyond the paper's is asked for: against the car by itself, and against the paper's and the brakes.

The targets stood before any of these controllers was tuned.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from activesteer.metric_table import metric

NONE: Final = "none"
REFERENCES: Final = ("ars", "afs", "esc")
"""What the others are measured by: the paper's two systems, and what cars have by law."""
LOWER_SHARE: Final = 0.8
"""Share of a population in which the peak of the sideslip is to be lower than the lowest of `REFERENCES`."""
SPOILED_SHARE: Final = 0.01
"""Largest share of the runs that are fine without control which may be lost with it."""


class Target(NamedTuple):
    """A target and what became of it.

    Attributes:
        controller: Who is asked.
        text: What for, and the number that came of it.
        passed: Whether it is met.
    """

    controller: str
    text: str
    passed: bool


class _Rule(NamedTuple):
    """A bound of the size of a metric.

    Attributes:
        scenario: Where.
        metric: What.
        than: Controller whose value is the bound; none where the bound is `factor` itself.
        factor: Part of that value.
        above: Whether it is a lower bound.
        strict: Whether the bound itself is out.
    """

    scenario: str
    metric: str
    than: str = ""
    factor: float = 1.0
    above: bool = False
    strict: bool = False

    def judged(self, controller: str, values: Mapping[str, float]) -> Target | None:
        """What became of it, a failure where a value was looked for and not found; None where it was not looked for.

        Args:
            controller: Who is asked.
            values: Controller -> value of the metric.
        """
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
    # As much as cars with such systems gain.
    _Rule("split_mu_braking", "stopping_distance_m", "esc", 0.94),
    _Rule("split_mu_braking", "lateral_deviation_max_m", "esc"),
    _Rule("severe_lane_change", "entry_speed_mps", NONE, above=True, strict=True),
)


def asked(controllers: Iterable[str]) -> list[str]:
    """Those of some controllers that targets are for."""
    return [name for name in controllers if name not in (NONE, *REFERENCES)]


def targets(controllers: Sequence[str], rows: Iterable[Any]) -> list[Target]:
    """Judges the nominal runs.

    Args:
        controllers: What was compared.
        rows: `scenario`, `controller`, `metric`, `value` of each number.
    """
    known: dict[tuple[str, str], dict[str, float]] = {}
    for row in rows:
        known.setdefault((row.scenario, row.metric), {})[row.controller] = row.value
    judged = (
        rule.judged(name, known.get((rule.scenario, rule.metric), {})) for name in asked(controllers) for rule in _RULES
    )
    return [target for target in judged if target is not None]


def short(value: float) -> str:
    """A number with three digits; a hyphen where there is none."""
    return "-" if math.isnan(value) else f"{value:.3g}"


def targets_text(found: Sequence[Target]) -> str:
    """A line for each target."""
    width = max((len(target.controller) for target in found), default=0) + 2
    return "\n".join(
        f"{target.controller:{width}}{'passed' if target.passed else 'FAILED'}  {target.text}" for target in found
    )

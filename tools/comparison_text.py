"""Results of a comparison of controllers over a population: harm, targets and text."""

from __future__ import annotations

import math
from typing import Any, Final

from activesteer.analysis.harm import MEASURES
from activesteer.metric_table import SIDESLIP_PEAKS
from tools.controller_targets import (
    HARMED_PROPORTION,
    NONE,
    TRACK_HARM_M,
    Target,
    asked,
    targets_text,
)
from tools.population_results import STEERING_EFFORT, TOTAL, Population, SystemEffect

_ROW: Final = "{:14}{:>20}{:>12}{:>14}{:>14}{:>12}{:>12}"
_GROWTH: Final = "    {:14}{:>9}{:>9}{:>9}{:>9}  {:8}{:>4} of {}"


def population_targets(found: Population) -> list[Target]:
    """Return the verdicts on the targets of the controllers beyond the paper's, in all scenarios together."""
    verdicts = []
    for name in asked(found.controllers):
        total = found.total(name)
        harmed = f"harms {total.harmed} of the runs, asked for <= {HARMED_PROPORTION:.0%}"
        worst = f"worst harm of the track {total.worst_track_m:.2f} m, asked for <= {TRACK_HARM_M:.2f} m"
        verdicts += [
            Target(name, harmed, total.harmed.value <= HARMED_PROPORTION),
            Target(name, worst, total.worst_track_m <= TRACK_HARM_M),
        ]
    return verdicts


def comparison_text(found: Population) -> str:
    """Return the harm, the proportions and the targets of a comparison as text."""
    lines = [
        f"{found.samples} samples of {found.vehicle}, seed {found.seed}; changes against {NONE}, medians",
        "",
        _ROW.format("", "harmed", "worst track", "saves of", "spoils of", "sideslip", "steering"),
        _ROW.format("", "", "[m]", "the lost", "the fine", "peak", "rms"),
    ]
    effects = [*found.systems, *(found.total(name) for name in found.controllers)]
    for scenario in [*dict.fromkeys(effect.scenario for effect in found.systems), TOTAL]:
        lines += [scenario, *(_line(effect) for effect in effects if effect.scenario == scenario)]
    lines += ["", "growth of each measure: 5 %, median, 95 %, largest; runs in which it is harm"]
    for effect in found.systems:
        lines += [f"{effect.scenario} {effect.controller}", *map(_growth, effect.growth)]
    if found.worst:
        lines += ["", "runs with the most harm"]
    for run in found.worst:
        grown = ", ".join(f"{name} {shown_growth(name, growth)}" for name, growth in run.growth.items())
        lines += [f"{run.controller} {run.scenario}: {grown}", f"  {run.command}"]
    if found.failed:
        lines += ["", f"{found.failed} runs did not come to their end"]
    return "\n".join([*lines, "", targets_text(population_targets(found))]).rstrip()


def shown_growth(name: str, growth: float) -> str:
    """Return the growth of a measure in its unit; `lost` where only the car without control gets so far."""
    measure = MEASURES[name]
    return f"{growth * measure.unit.factor:+.2f} {measure.unit.name}".rstrip() if math.isfinite(growth) else "undefined"


def _growth(change: Any) -> str:
    unit = MEASURES[change.metric].unit
    values = (change.low, change.median, change.high, change.largest)
    return _GROWTH.format(
        change.metric, *(f"{unit.factor * value:+.2f}" for value in values), unit.name, change.harmed, change.number
    )


def _line(effect: SystemEffect) -> str:
    counts = (f"{proportion.count} of {proportion.number}" for proportion in (effect.saved, effect.spoiled))
    medians = (effect.median_change(SIDESLIP_PEAKS), effect.median_change([STEERING_EFFORT]))
    changes = ("-" if math.isnan(value) else f"{math.degrees(value):+.2f} deg" for value in medians)
    track = "-" if math.isnan(effect.worst_track_m) else f"{effect.worst_track_m:.2f}"
    return _ROW.format(f"  {effect.controller}", str(effect.harmed), track, *counts, *changes)

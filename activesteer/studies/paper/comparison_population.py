"""Results of a comparison of controllers over a population: targets and text."""

from __future__ import annotations

import math
from typing import Any, Final

from activesteer.analysis.claims.population import TOTAL, Population, SystemEffect
from activesteer.metric_table import SIDESLIP_PEAKS
from activesteer.studies.paper.comparison_targets import (
    LOWER_PROPORTION,
    NONE,
    REFERENCES,
    SPOILED_PROPORTION,
    Target,
    asked,
    targets_text,
)
from activesteer.studies.paper.population import STEERING_EFFORT

_ROW: Final = "{:16}{:>22}{:>14}{:>14}{:>12}{:>12}"


def population_targets(found: Population) -> list[Target]:
    """Return the verdicts on the targets of the controllers beyond the paper's, in all scenarios together."""
    verdicts = []
    for name in asked(found.controllers):
        total = found.total(name)
        lower = f"peak of the sideslip below the lowest of {', '.join(REFERENCES)} in {total.lower}"
        spoils = f"of the runs that are fine without control it spoils {total.spoiled}"
        verdicts += [
            Target(name, f"{lower}, asked for >= {LOWER_PROPORTION:.0%}", total.lower.value >= LOWER_PROPORTION),
            Target(name, f"{spoils}, asked for <= {SPOILED_PROPORTION:.0%}", total.spoiled.value <= SPOILED_PROPORTION),
        ]
    return verdicts


def comparison_json(found: Population) -> dict[str, Any]:
    """Return JSON values of a comparison, with its totals and targets."""
    return {
        **found.to_json(),
        "totals": [found.total(name).to_json() for name in found.controllers],
        "targets": [target._asdict() for target in population_targets(found)],
    }


def comparison_text(found: Population) -> str:
    """Return the proportions and the targets of a comparison as text."""
    lines = [
        f"{found.samples} samples of {found.vehicle}, seed {found.seed}; median changes against {NONE}",
        "",
        _ROW.format("", "sideslip below all", "saves of", "spoils of", "sideslip", "steering"),
        _ROW.format("", f"of {', '.join(REFERENCES)}", "the lost", "the fine", "peak", "rms"),
    ]
    effects = [*found.systems, *(found.total(name) for name in found.controllers)]
    for scenario in [*dict.fromkeys(effect.scenario for effect in found.systems), TOTAL]:
        lines += [scenario, *(_line(effect) for effect in effects if effect.scenario == scenario)]
    if found.failed:
        lines += ["", f"{found.failed} runs did not come to their end"]
    return "\n".join([*lines, "", targets_text(population_targets(found))]).rstrip()


def _line(effect: SystemEffect) -> str:
    counts = (f"{proportion.count} of {proportion.number}" for proportion in (effect.saved, effect.spoiled))
    medians = (effect.median_change(SIDESLIP_PEAKS), effect.median_change([STEERING_EFFORT]))
    changes = ("-" if math.isnan(value) else f"{math.degrees(value):+.2f} deg" for value in medians)
    return _ROW.format(f"  {effect.controller}", str(effect.lower), *counts, *changes)

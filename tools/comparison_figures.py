"""A comparison of controllers as heat maps: better and worse than the first controller, alone and in a population."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from activesteer.analysis.report.significance import Change, significance
from activesteer.metric_table import metric as declared
from activesteer.plotting import Heat, Picture, draw
from activesteer.theory.proportions import percent
from tools.compare_controllers import Comparison
from tools.controller_targets import short
from tools.population_results import Population

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RANGE: Final = 3.0
"""Ratio at which the colours end in both directions."""
_WORSE, _NEUTRAL, _BETTER = "#e08a3c", "#f4f4f4", "#5b9fd0"
"""Ends and middle of the colours; they are told apart without seeing red or green, and black can be read on them."""
_COLOURS: Final = (_WORSE, _NEUTRAL, _BETTER)
_PALEST: Final = 0.2
"""Least depth of the colour of a better or worse value, so that it is seen to be one [-]."""
_PROPORTIONS: Final = {
    "harmed": ("runs with harm [%]", 0.0, -1.0),
    "saved": ("lost without control,\nsaved [%]", 0.0, 1.0),
    "spoiled": ("fine without control,\nspoiled [%]", 0.0, -1.0),
}
"""Proportion of an effect -> title of its panel, and place in the colours, from -1 to 1, of none and of all runs."""


def comparison_figure(made: Comparison) -> Figure:
    """Return the figure of a comparison in the nominal runs."""
    lines, first = made.shown(), made.controllers[0]
    shades = np.full((len(lines), len(made.controllers)), math.nan)
    texts = [[""] * len(made.controllers) for _ in lines]
    labels, rules, before = [], [], ""
    for row, (scenario, metric, values) in enumerate(lines):
        shown = declared(metric)
        for column, name in enumerate(made.controllers):
            if name in values:
                shades[row, column] = _shade(metric, values[name], values.get(first, math.nan))
                texts[row][column] = short(values[name] * shown.unit.factor)
        begins = scenario != before
        labels.append(f"{scenario.replace('_', ' ')}: {shown.title}" if begins else shown.title)
        rules += [row] if begins and row else []
        before = scenario
    heat = Heat(shades, texts, made.controllers, labels, (-1.0, 1.0), _COLOURS, rules=rules)
    legend = _legend(
        f"better than {first}",
        f"worse; full colour: a factor of {_RANGE:g}",
        "not told apart, or neither better nor worse",
    )
    width_in, height_in = 4.2 + 0.85 * len(made.controllers), 1.2 + 0.26 * len(lines)
    return draw(Picture("", [heat], None, 1, width_in, height_in, legend, shared_legend=True))


def _shade(metric: str, value: float, first: float) -> float:
    """Return how much better a value is than the first controller's, 1 at a factor of `_RANGE`; worse is below 0."""
    change = significance(metric, value, first)
    if change not in (Change.BETTER, Change.WORSE):
        return 0.0 if math.isfinite(value) else math.nan
    size, before = declared(metric).cost(value), declared(metric).cost(first)
    # Two values have no ratio if one of them is zero, or if only one of them is negative.
    depth = abs(math.log(size / before)) / math.log(_RANGE) if size * before > 0.0 else 1.0
    return math.copysign(_PALEST + (1.0 - _PALEST) * min(depth, 1.0), 1.0 if change is Change.BETTER else -1.0)


def _legend(better: str, worse: str, neutral: str) -> list[tuple[str, str]]:
    return [(better, _BETTER), (worse, _WORSE), (neutral, _NEUTRAL)]


def comparison_population_figure(made: Population) -> Figure:
    """Return the figure of a comparison over a population: proportions in percent by scenario and controller."""
    names = list(dict.fromkeys(effect.controller for effect in made.systems))
    scenarios = list(dict.fromkeys(effect.scenario for effect in made.systems))
    panels = []
    for key, (title, none, every) in _PROPORTIONS.items():
        proportions = np.full((len(scenarios), len(names)), math.nan)
        for effect in made.systems:
            proportions[scenarios.index(effect.scenario), names.index(effect.controller)] = getattr(effect, key).value
        texts = [["-" if math.isnan(value) else percent(value) for value in row] for row in proportions.tolist()]
        rows = [name.replace("_", " ") if not panels else "" for name in scenarios]
        panels.append(Heat(none + (every - none) * proportions, texts, names, rows, (-1.0, 1.0), _COLOURS, title))
    legend = _legend("better", "worse", "as without control, or in half of the runs")
    title = f"{made.samples} samples of {made.vehicle}, seed {made.seed}; -: no such run"
    width_in, height_in = 2.0 + 1.5 * max(len(names), 4), 1.4 + 0.3 * len(scenarios)
    return draw(Picture(title, panels, None, len(panels), width_in, height_in, legend, shared_legend=True))

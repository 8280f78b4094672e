"""A comparison of controllers as heat maps: every number over that of the first controller; shares of a population."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from activesteer.analysis.claims.population import percent
from activesteer.plotting import new_figure, save
from activesteer.quantities import metric_label
from activesteer.studies.comparison import Comparison
from activesteer.studies.comparison_shares import ComparisonPopulation
from activesteer.studies.comparison_targets import REFERENCES, short

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RANGE: Final = 3.0
"""Ratio at which the colours end, up and down."""
_SHARES: Final = {
    "lower": (f"sideslip below all\nof {', '.join(REFERENCES)} [%]", "RdYlGn"),
    "saved": ("lost without control,\nsaved [%]", "RdYlGn"),
    "spoiled": ("fine without control,\nspoiled [%]", "RdYlGn_r"),
}
"""Share of an effect -> title and colours of its panel."""


def draw_comparison(made: Comparison, path: Path) -> Path:
    """Draws it.

    Raises:
        ActiveSteerError: the file cannot be written, or matplotlib is not installed.
    """
    return save(comparison_figure(made), path)


def comparison_figure(made: Comparison) -> Figure:
    """The figure that `draw_comparison` writes."""
    lines, first = made.shown(), made.controllers[0]
    ratios = np.full((len(lines), len(made.controllers)), math.nan)
    figure = new_figure(4.2 + 0.85 * len(made.controllers), 1.2 + 0.26 * len(lines))
    axes = figure.subplots()
    for row, (_, metric, values) in enumerate(lines):
        _, _, factor = metric_label(metric)
        base = abs(values.get(first, math.nan))
        for column, name in enumerate(made.controllers):
            if name not in values:
                continue
            value = abs(values[name])
            if base > 0.0 and value > 0.0:
                ratios[row, column] = math.log(value / base)
            axes.text(column, row, short(values[name] * factor), ha="center", va="center", fontsize="x-small")
    span = math.log(_RANGE)
    axes.imshow(ratios, cmap="RdBu_r", vmin=-span, vmax=span, aspect="auto", alpha=0.5)
    axes.set_xticks(range(len(made.controllers)), made.controllers, fontsize="small")
    axes.xaxis.tick_top()
    labels, before = [], ""
    for row, (scenario, metric, _) in enumerate(lines):
        label, unit, _ = metric_label(metric)
        name = f"{scenario.replace('_', ' ')}: " if scenario != before else ""
        labels.append(f"{name}{label} [{unit}]")
        if scenario != before and row:
            axes.axhline(row - 0.5, color="black", linewidth=0.8)
        before = scenario
    axes.set_yticks(range(len(lines)), labels, fontsize="x-small")
    axes.set_xlabel(
        f"Blue: size below that of {first}, red: above; full colour: a factor of {_RANGE:g}", fontsize="x-small"
    )
    return figure


def draw_comparison_population(made: ComparisonPopulation, path: Path) -> Path:
    """Draws a comparison over a population.

    Raises:
        ActiveSteerError: the file cannot be written, or matplotlib is not installed.
    """
    return save(comparison_population_figure(made), path)


def comparison_population_figure(made: ComparisonPopulation) -> Figure:
    """The figure that `draw_comparison_population` writes: shares in percent by scenario and controller."""
    names = list(dict.fromkeys(effect.controller for effect in made.effects))
    scenarios = list(dict.fromkeys(effect.scenario for effect in made.effects))
    figure = new_figure(2.0 + 1.5 * len(names), 1.4 + 0.3 * len(scenarios))
    panels = figure.subplots(1, len(_SHARES), sharey=True)
    for axes, (name, (title, colours)) in zip(panels, _SHARES.items(), strict=True):
        shares = np.full((len(scenarios), len(names)), math.nan)
        for effect in made.effects:
            place = scenarios.index(effect.scenario), names.index(effect.controller)
            shares[place] = getattr(effect, name).share
            if not math.isnan(shares[place]):
                text = f"{percent(shares[place])}"
                axes.text(place[1], place[0], text, ha="center", va="center", fontsize="x-small")
        axes.imshow(shares, cmap=colours, vmin=0.0, vmax=1.0, aspect="auto", alpha=0.5)
        axes.set_xticks(range(len(names)), names, fontsize="x-small", rotation=45, ha="right")
        axes.set_title(title, fontsize="small")
    panels[0].set_yticks(range(len(scenarios)), [name.replace("_", " ") for name in scenarios], fontsize="x-small")
    figure.supxlabel(f"{made.samples} samples of {made.vehicle}, seed {made.seed}", fontsize="x-small")
    return figure

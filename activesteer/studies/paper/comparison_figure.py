"""A comparison of controllers as heat maps, coloured by what is better: than the first of them; in a population."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from activesteer.analysis.claims.population import percent
from activesteer.analysis.report.significance import Change, significance
from activesteer.metric_table import metric as declared
from activesteer.plotting import new_figure, save
from activesteer.studies.paper.comparison import Comparison
from activesteer.studies.paper.comparison_shares import ComparisonPopulation
from activesteer.studies.paper.comparison_targets import REFERENCES, short

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RANGE: Final = 3.0
"""Ratio at which the colours end, up and down."""
_WORSE, _NEUTRAL, _BETTER = "#e08a3c", "#f4f4f4", "#5b9fd0"
"""Ends and middle of the colours; they are told apart without seeing red or green, and black can be read on them."""
_PALEST: Final = 0.2
"""Depth of the colour of what is hardly better or worse, so that it is seen to be that [-]."""
_SHARES: Final = {
    "lower": (f"sideslip below all\nof {', '.join(REFERENCES)} [%]", -1.0, 1.0),
    "saved": ("lost without control,\nsaved [%]", 0.0, 1.0),
    "spoiled": ("fine without control,\nspoiled [%]", 0.0, -1.0),
}
"""Share of an effect -> title of its panel, and where in the colours, from -1 to 1, none and all of the runs are."""


def draw_comparison(made: Comparison, path: Path) -> Path:
    """Draws it.

    Raises:
        ActiveSteerError: the file cannot be written, or matplotlib is not installed.
    """
    return save(comparison_figure(made), path)


def comparison_figure(made: Comparison) -> Figure:
    """The figure that `draw_comparison` writes."""
    lines, first = made.shown(), made.controllers[0]
    shades = np.full((len(lines), len(made.controllers)), math.nan)
    figure = new_figure(4.2 + 0.85 * len(made.controllers), 1.2 + 0.26 * len(lines))
    axes = figure.subplots()
    for row, (_, metric, values) in enumerate(lines):
        factor = declared(metric).unit.factor
        for column, name in enumerate(made.controllers):
            if name not in values:
                continue
            shades[row, column] = _shade(metric, values[name], values.get(first, math.nan))
            axes.text(column, row, short(values[name] * factor), ha="center", va="center", fontsize="x-small")
    axes.imshow(shades, cmap=_colours(), vmin=-1.0, vmax=1.0, aspect="auto")
    axes.set_xticks(range(len(made.controllers)), made.controllers, fontsize="small")
    axes.xaxis.tick_top()
    labels, before = [], ""
    for row, (scenario, metric, _) in enumerate(lines):
        name = f"{scenario.replace('_', ' ')}: " if scenario != before else ""
        labels.append(f"{name}{declared(metric).title}")
        if scenario != before and row:
            axes.axhline(row - 0.5, color="black", linewidth=0.8)
        before = scenario
    axes.set_yticks(range(len(lines)), labels, fontsize="x-small")
    _legend(
        figure,
        f"better than {first}",
        f"worse; full colour: a factor of {_RANGE:g}",
        "not told apart, or neither better nor worse",
    )
    return figure


def _shade(metric: str, value: float, first: float) -> float:
    """How much better a value is than that of the first controller, 1 by a factor of `_RANGE`; below 0 it is worse."""
    change = significance(metric, value, first)
    if change not in (Change.BETTER, Change.WORSE):
        return 0.0 if math.isfinite(value) else math.nan
    size, before = declared(metric).cost(value), declared(metric).cost(first)
    # Where one of them is nothing, or touches where the other does not, there is no factor between them.
    depth = abs(math.log(size / before)) / math.log(_RANGE) if size * before > 0.0 else 1.0
    return math.copysign(_PALEST + (1.0 - _PALEST) * min(depth, 1.0), 1.0 if change is Change.BETTER else -1.0)


def _colours() -> Any:
    from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415 - an extra, and slow to import

    return LinearSegmentedColormap.from_list("worse to better", [_WORSE, _NEUTRAL, _BETTER])


def _legend(figure: Figure, better: str, worse: str, neutral: str, title: str = "") -> None:
    from matplotlib.patches import Patch  # noqa: PLC0415

    words = {better: _BETTER, worse: _WORSE, neutral: _NEUTRAL}
    patches = [Patch(facecolor=colour, edgecolor="0.6", label=label) for label, colour in words.items()]
    figure.legend(
        handles=patches, loc="outside lower center", ncols=len(patches), fontsize="x-small", frameon=False,
        title=title or None, title_fontsize="x-small",
    )  # fmt: skip


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
    for axes, (name, (title, none, every)) in zip(panels, _SHARES.items(), strict=True):
        shares = np.full((len(scenarios), len(names)), math.nan)
        for effect in made.effects:
            place = scenarios.index(effect.scenario), names.index(effect.controller)
            shares[place] = getattr(effect, name).share
            text = "-" if math.isnan(shares[place]) else f"{percent(shares[place])}"
            axes.text(place[1], place[0], text, ha="center", va="center", fontsize="x-small")
        axes.imshow(none + (every - none) * shares, cmap=_colours(), vmin=-1.0, vmax=1.0, aspect="auto")
        axes.set_xticks(range(len(names)), names, fontsize="x-small", rotation=45, ha="right")
        axes.set_title(title, fontsize="small")
    panels[0].set_yticks(range(len(scenarios)), [name.replace("_", " ") for name in scenarios], fontsize="x-small")
    said = f"{made.samples} samples of {made.vehicle}, seed {made.seed}; -: no such run"
    _legend(figure, "better", "worse", "as without control, or in half of the runs", said)
    return figure

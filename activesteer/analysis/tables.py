"""Metrics of several runs side by side, as plain text for a terminal. Degrees and km/h, as this is for reading."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from activesteer.analysis.harm import LOST, shown
from activesteer.metric_table import FRICTION_UTILISATION, recorded_metric
from activesteer.text_table import text_table, wrapped_line

Paint = Callable[[str, str, float, float, str], str]
"""Function from label of a run, name of a metric, its value in this and in the first run, and its text to the text
as shown."""

TYRE_USE_NOTE: Final = (
    "tyre use is the force of a tyre relative to its peaks along and across, each alone; combined slip and shifts of "
    "the tyre file let it exceed 1"
)


def comparison(runs: Mapping[str, Mapping[str, float]], paint: Paint | None = None) -> str:
    """Return a table with a row per metric and a column per run."""
    names = list(dict.fromkeys(name for metrics in runs.values() for name in metrics))
    rows, first = [["", "", *runs]], next(iter(runs.values()), {})
    for name in names:
        metric = recorded_metric(name)
        numbers = [
            shown(name, metrics, metric.text(metrics[name])) if name in metrics else "" for metrics in runs.values()
        ]
        for place, (run, metrics) in enumerate(runs.items()):
            if paint is not None and place and name in metrics and name in first and LOST not in numbers:
                numbers[place] = paint(run, name, metrics[name], first[name], numbers[place])
        rows.append([metric.label, metric.unit.name, *numbers])
    return "\n".join((*text_table(rows, text=2, repeat=2, least=8), *notes(runs)))


def notes(runs: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Return explanations of values that a reader may take for an error."""
    above = any(metrics.get(name, 0.0) > 1.0 for metrics in runs.values() for name in FRICTION_UTILISATION)
    return wrapped_line(TYRE_USE_NOTE) if above else []

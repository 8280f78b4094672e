"""Metrics of several runs side by side, as plain text for a terminal. Degrees and km/h, as this is for reading."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from activesteer.metric_table import recorded_metric

Paint = Callable[[str, float, float, str], str]
"""Function from the name of a metric, its value in a run and in the first run, and its text to the text as shown."""


def comparison(runs: Mapping[str, Mapping[str, float]], paint: Paint | None = None) -> str:
    """Return a table with a row per metric and a column per run.

    Args:
        runs: Metrics by label of the run; a metric that a run lacks leaves a blank.
        paint: Colours the values of all runs but the first; None for no colours.

    Returns:
        Lines without a newline at the end: name, unit, then the values. A value that the run does not define (nan) is
        shown as `-`.
    """
    names = list(dict.fromkeys(name for metrics in runs.values() for name in metrics))
    rows = [["", "", *runs]]
    for name in names:
        metric = recorded_metric(name)
        numbers = [metric.text(metrics[name]) if name in metrics else "" for metrics in runs.values()]
        rows.append([metric.label, metric.unit.name, *numbers])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    cells = [_cells(row, widths) for row in rows]
    first = next(iter(runs.values()), {})
    for row, name in zip(cells[1:], names, strict=True):
        for place, metrics in enumerate(list(runs.values())[1:], start=3):
            if paint is not None and name in metrics and name in first:
                row[place] = paint(name, metrics[name], first[name], row[place])
    return "\n".join("  ".join(row).rstrip() for row in cells)


def _cells(row: list[str], widths: list[int]) -> list[str]:
    texts = [cell.ljust(width) for cell, width in zip(row[:2], widths[:2], strict=True)]
    return texts + [cell.rjust(max(width, 8)) for cell, width in zip(row[2:], widths[2:], strict=True)]

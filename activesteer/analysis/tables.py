"""Metrics of several runs side by side, as plain text for a terminal. Degrees and km/h, as this is for reading."""

from __future__ import annotations

from collections.abc import Mapping

from activesteer.quantities import metric_label, metric_number


def comparison(runs: Mapping[str, Mapping[str, float]]) -> str:
    """A table with a row per metric and a column per run.

    Args:
        runs: Metrics by label of the run; metrics that only some runs have leave a blank in the others.

    Returns:
        Lines of equal form, without a newline at the end: name, unit, then the values. A value that the run does not
        define (nan) is shown as `-`.
    """
    names = list(dict.fromkeys(name for metrics in runs.values() for name in metrics))
    rows = [["", "", *runs]]
    for name in names:
        words, unit, _ = metric_label(name)
        numbers = [metric_number(name, metrics[name]) if name in metrics else "" for metrics in runs.values()]
        rows.append([words, unit, *numbers])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(_line(row, widths) for row in rows)


def _line(row: list[str], widths: list[int]) -> str:
    texts = [cell.ljust(width) for cell, width in zip(row[:2], widths[:2], strict=True)]
    numbers = [cell.rjust(max(width, 8)) for cell, width in zip(row[2:], widths[2:], strict=True)]
    return "  ".join(texts + numbers).rstrip()

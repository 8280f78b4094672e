"""Significance of the difference between two values of a metric."""

from __future__ import annotations

import math
from enum import StrEnum

from activesteer.analysis.report.tables import difference_text
from activesteer.metric_table import recorded_metric


class Change(StrEnum):
    """Significance of a difference from the first run."""

    BETTER = "better"
    WORSE = "worse"
    SAME = "same"
    """Neither a driver nor a sensor in a test car could tell the values apart."""
    OTHER = "other"
    """The values differ, and neither is better."""


def significance(name: str, value: float, first: float) -> Change:
    """Compare a metric with its value in the first run.

    Args:
        name: Name of the metric.
        value: Its value [SI].
        first: Its value in the first run [SI].
    """
    metric = recorded_metric(name)
    if metric.better is None or not math.isfinite(value - first):
        return Change.OTHER
    size, before = metric.cost(value), metric.cost(first)
    if is_near(name, size, before):
        return Change.SAME
    return Change.BETTER if size < before else Change.WORSE


def is_near(name: str, value: float, first: float) -> bool:
    """Return whether neither a driver nor a sensor could tell two values [SI] apart."""
    near = abs(value - first) <= recorded_metric(name).significance
    return near or difference_text(name, value, first).text == "0"

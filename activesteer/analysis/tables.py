"""Metrics of several runs side by side, as plain text for a terminal. Degrees and km/h, as this is for reading."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

_DISPLAY: Final = (
    # Longest suffix first: `_srad` also ends in `rad`.
    ("_radpmps2", "deg/g", math.degrees(9.81)),
    ("_mps2prad", "g/100deg", math.radians(100.0) / 9.81),
    ("_radprad", "deg/deg", 1.0),
    ("_1ps", "1/s", 1.0),
    ("_Hz", "Hz", 1.0),
    ("_radps", "deg/s", math.degrees(1.0)),
    ("_srad", "s deg", math.degrees(1.0)),
    ("_rad", "deg", math.degrees(1.0)),
    ("_mps2", "m/s2", 1.0),
    ("_mps", "km/h", 3.6),
    ("_Nm", "Nm", 1.0),
    ("_N", "N", 1.0),
    ("_m", "m", 1.0),
    ("_s", "s", 1.0),
    ("_overshoot", "%", 100.0),
    ("_share", "%", 100.0),
)
"""Suffix of a metric's name, unit it is shown in, factor from the SI value."""

_WORDS: Final = {"ay": "lateral acceleration", "tb": "TB"}


def label_and_unit(name: str) -> tuple[str, str, float]:
    """How a metric is shown.

    Args:
        name: Name with unit suffix, such as `yaw_rate_peak_radps`.

    Returns:
        Words, display unit (`-` for a pure number), and the factor from the SI value to it.
    """
    for suffix, unit, factor in _DISPLAY:
        if name.endswith(suffix):
            # A pure number has no unit to take off its name; the ending is a word of it.
            stem = name if unit == "%" else name.removesuffix(suffix)
            return _words(stem), unit, factor
    return _words(name), "-", 1.0


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
        words, unit, factor = label_and_unit(name)
        rows.append([words, unit, *(_number(metrics.get(name), factor) for metrics in runs.values())])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(_line(row, widths) for row in rows)


def _words(stem: str) -> str:
    head, _, tail = stem.partition("_")
    return " ".join(part for part in (_WORDS.get(head, head), tail.replace("_", " ")) if part)


def _number(value: float | None, factor: float) -> str:
    if value is None:
        return ""
    return "-" if math.isnan(value) else f"{value * factor:.3f}"


def _line(row: list[str], widths: list[int]) -> str:
    texts = [cell.ljust(width) for cell, width in zip(row[:2], widths[:2], strict=True)]
    numbers = [cell.rjust(max(width, 8)) for cell, width in zip(row[2:], widths[2:], strict=True)]
    return "  ".join(texts + numbers).rstrip()

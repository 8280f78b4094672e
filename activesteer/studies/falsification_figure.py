"""Picture of a falsification: how the robustness fell, and where violations lie."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from activesteer.plotting import Curve, Panel, Picture, draw, save
from activesteer.studies.falsification import Falsified

_FACTORS: Final = 5
"""Number of factors that are drawn: those with which the robustness correlates most."""
_KEPT, _BROKEN = "#5b9fd0", "#b3261e"


def draw_falsified(found: Falsified, path: Path) -> Path:
    """Draw a search and return its file."""
    robustness = np.array([value for _, value in found.sets])
    judged = np.abs(robustness) < 0.99e6  # others define no metric
    # A set far below zero is drawn at the edge, so that the others can be told apart.
    floor = 1.1 * float(np.min(robustness[judged], initial=0.0)) - 1e-9
    shown = np.clip(robustness, floor, float(np.max(robustness[judged], initial=1e-9)))
    panels = [
        Panel(
            "runs", "least robustness so far [-]",
            [Curve([run for run, _ in found.fall], np.maximum([value for _, value in found.fall], floor), marker="o")],
            limits=((0.0, "violated below"),),
        )
    ]  # fmt: skip
    broken = robustness < 0.0
    columns = {key: _numbers([values.get(key) for values, _ in found.sets]) for key in found.values}
    for key in sorted(columns, key=lambda key: -_correlation(columns[key], shown))[:_FACTORS]:
        points = [
            Curve(columns[key][part], shown[part], label, colour, "", 0.0, "o")
            for part, label, colour in ((~broken, "holds", _KEPT), (broken, "violated", _BROKEN))
            if part.any()
        ]
        panels.append(Panel(_label(key, found), "robustness [-]", points, limits=((0.0, "violated below"),)))
    title = f"{found.controller}, {found.maneuver}: {found.requirement}"
    return save(draw(Picture(title, panels, None, 3, 12.0, 7.0)), path)


def _numbers(values: list[object]) -> np.ndarray:
    """Return numbers; the place of each in the sorted list, for texts."""
    if all(isinstance(value, int | float) for value in values):
        return np.array(values, dtype=np.float64)
    texts = sorted({str(value) for value in values})
    return np.array([texts.index(str(value)) for value in values], dtype=np.float64)


def _label(key: str, found: Falsified) -> str:
    texts = sorted({str(values[key]) for values, _ in found.sets if isinstance(values.get(key), str)})
    return f"{key} ({', '.join(f'{place}: {text}' for place, text in enumerate(texts))})" if texts else key


def _correlation(x: np.ndarray, y: np.ndarray) -> float:
    """Return the magnitude of Spearman's rank correlation; 0 for a constant."""
    if len(x) < 3 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 0.0
    first, second = (np.argsort(np.argsort(values)) for values in (x, y))
    return float(abs(np.corrcoef(first, second)[0, 1]))

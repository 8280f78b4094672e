"""Figures of searches: objectives of the sets that were tried, and how the margin of a requirement fell."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from scipy.stats import rankdata

from activesteer.files import file_word
from activesteer.plotting import Curve, Panel, Picture, draw, save
from activesteer.studies.engine.tuning import Goal, Trial, Tuning

_FACTORS: Final = 5
"""Number of factors that are drawn: those with which the margin correlates most."""
_KEPT, _BROKEN, _GREY = "#5b9fd0", "#b3261e", "0.6"


def draw_tuning(found: Tuning, folder: Path) -> list[Path]:
    """Draw a search into the folder of its command, and return the files; none if no set could be judged."""
    if not found.trials:
        return []
    if found.goal is Goal.VIOLATE:
        below = folder / f"{file_word(found.controller)}-{file_word(found.maneuver)}"
        return [save(draw(_violations(found)), below / "violations.png")]
    figure = draw(Picture("Sets that were tried", [_front(found)], None, 1, 6.0, 4.5))
    return [save(figure, folder / f"front.{kind}") for kind in ("png", "svg")]


def _front(found: Tuning) -> Panel:
    """Return two objectives against each other, one over the sets, or the statements over the implausibility."""
    names = list(found.trials[0].objectives)
    x, y = names[:2] if len(names) > 1 else ("set", *names, "statements that hold")[:2]
    if found.goal is Goal.SATISFY:
        x = "implausibility"

    def place(trial: Trial) -> tuple[float, float]:
        if found.goal is Goal.SATISFY:
            return trial.implausibility, len(trial.holding)
        return trial.objectives.get(x, trial.number), trial.objectives[y]

    curves = []
    for trials, label, look in (
        ([trial for trial in found.trials if not trial.allowed], "breaks a constraint", (_GREY, "", 1.2, "x")),
        ([trial for trial in found.trials if trial.allowed], "tried", (_GREY, "", 1.2, "o")),
        (found.front, "best", (_BROKEN, "", 1.2, "o")),
    ):
        if trials:
            places = np.array([place(trial) for trial in trials])
            curves.append(Curve(places[:, 0], places[:, 1], label, *look))
    return Panel(f"{x} [-]", f"{y} [-]", curves)


def _violations(found: Tuning) -> Picture:
    """Return how the margin fell, and where violations are."""
    ((name, _),) = found.trials[0].margins.items()
    margins = np.array([trial.margins[name] for trial in found.trials])
    judged = np.abs(margins) < 0.99e6  # others define no metric
    # A set far below zero is drawn at the edge, so that the others can be told apart.
    floor = 1.1 * float(np.min(margins[judged], initial=0.0)) - 1e-9
    shown = np.clip(margins, floor, float(np.max(margins[judged], initial=1e-9)))
    falls = np.maximum([value for _, value in found.fall], floor)
    limits = ((0.0, "violated below"),)
    runs = [run for run, _ in found.fall]
    panels = [Panel("runs", "least margin so far [-]", [Curve(runs, falls, marker="o")], limits=limits)]
    broken = margins < 0.0
    columns = {key: [trial.values.get(key) for trial in found.trials] for key in found.front[0].values}
    texts = {key: [] if _all_numbers(column) else sorted(set(map(str, column))) for key, column in columns.items()}
    numbers = {
        key: np.array([texts[key].index(str(value)) if texts[key] else value for value in column], dtype=np.float64)
        for key, column in columns.items()
    }
    for key in sorted(numbers, key=lambda key: -_correlation(numbers[key], shown))[:_FACTORS]:
        points = [
            Curve(numbers[key][part], shown[part], label, colour, "", 0.0, "o")
            for part, label, colour in ((~broken, "holds", _KEPT), (broken, "violated", _BROKEN))
            if part.any()
        ]
        panels.append(Panel(_label(key, texts[key]), "margin [-]", points, limits=limits))
    title = f"{found.controller}, {found.maneuver}: {found.requirement}"
    return Picture(title, panels, None, 3, 12.0, 7.0)


def _all_numbers(values: Sequence[object]) -> bool:
    return all(isinstance(value, int | float) for value in values)


def _label(key: str, texts: Sequence[str]) -> str:
    return f"{key} ({', '.join(f'{place}: {text}' for place, text in enumerate(texts))})" if texts else key


def _correlation(x: np.ndarray, y: np.ndarray) -> float:
    """Return the magnitude of Spearman's rank correlation; 0 for a constant."""
    if len(x) < 3 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 0.0
    return abs(float(np.corrcoef(rankdata(x), rankdata(y))[0, 1]))

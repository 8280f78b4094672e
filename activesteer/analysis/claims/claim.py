"""A claim of the paper with what it was decided on, and what all of them have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from activesteer.analysis.source import Evaluable, RecordingLike
from activesteer.errors import ParameterError, RecordingError

SYSTEMS: Final = ("none", "ars", "afs")
"""The runs that are compared: no control, active rear steering, active front superposition."""

Runs = Mapping[str, Mapping[str, float]]
"""Metrics by system."""


@dataclass(frozen=True, slots=True)
class Claim:
    """One statement of the paper, checked.

    Attributes:
        id: Its number.
        text: What is claimed.
        criterion: What must hold for it to pass.
        passed: Whether it does.
        values: The numbers it was decided on, named `<system>_<metric>`.
    """

    id: str
    text: str
    criterion: str
    passed: bool
    values: dict[str, float]


def all_metrics(
    recordings: Mapping[str, RecordingLike],
    metrics: Callable[[RecordingLike], dict[str, float]],
    what: str,
) -> dict[str, dict[str, float]]:
    """Metrics of the three runs.

    Args:
        recordings: Runs by system; more than the three are no matter.
        metrics: What evaluates a run.
        what: Name of the manoeuvre, for the error.

    Returns:
        Metrics by system, in the order of `SYSTEMS`.

    Raises:
        ParameterError: one of the three runs is missing.
        RecordingError: a run cannot be evaluated.
    """
    missing = [system for system in SYSTEMS if system not in recordings]
    if missing:
        raise ParameterError(
            f"the claims about the {what} need the runs {', '.join(SYSTEMS)}; missing: {', '.join(missing)}"
        )
    return {system: _Metrics(metrics(Evaluable(recordings[system]))) for system in SYSTEMS}


class _Metrics(dict[str, float]):
    """Metrics of a run that may be of another kind than the name of its manoeuvre says."""

    def __missing__(self, name: str) -> float:
        raise RecordingError(f"the run has no metric {name}: is it what its name says?")


def pick(runs: Runs, *metrics: str) -> dict[str, float]:
    """Metrics of all systems, named `<system>_<metric>`."""
    return {f"{system}_{metric}": runs[system][metric] for metric in metrics for system in SYSTEMS}


def lowered(runs: Runs, metric: str, most: float, system: str) -> bool:
    """Whether a system brings a metric down to at most a part of the value without control.

    Never where one of them is nan, or where there is nothing to bring down.
    """
    none = abs(runs["none"][metric])
    return none > 0.0 and abs(runs[system][metric]) <= most * none

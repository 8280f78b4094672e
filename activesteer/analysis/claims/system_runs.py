"""The runs of the three systems in a scenario, as all claims use them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from activesteer.analysis.claims.action import MEAN_S, largest_action
from activesteer.analysis.claims.claim import SYSTEMS, SYSTEMS_WITH_CONTROL, Claim, Statement, check_systems
from activesteer.analysis.requirement import Condition, at_least, at_most
from activesteer.analysis.series import timestep
from activesteer.analysis.source import Evaluable, RecordingLike
from activesteer.errors import RecordingError
from activesteer.metric_table import STEER_RAD

Metrics = Mapping[str, float]


class SystemRuns:
    """The runs none, ars and afs of a scenario.

    Attributes:
        recordings: The runs, by system.
        metrics: Their metrics, by system; nan for metrics that an incomplete run does not have.
        whole: Whether all three runs reach the end of their manoeuvre.
        obstacle: Why no claim can pass on these runs, a sentence; empty if nothing prevents it. A run must be whole.
            The run of ars must turn the rear wheels and the run of afs the superposition gear, by
            `metric_table.STEER_RAD` more than straight ahead and for longer than noise does (`action.largest_action`).
            No run may demand as much of an actuator that its system does not have: an action that a system did not
            perform proves nothing.
        hindrance: Distance of the obstacle from vanishing, 0 to 1: the missing part of the smallest action.
    """

    def __init__(
        self, recordings: Mapping[str, RecordingLike], metrics: Callable[[RecordingLike], Metrics], what: str
    ) -> None:
        """Evaluate the three runs; `what` names the manoeuvre in errors."""
        check_systems(recordings, what)
        self.recordings = {system: recordings[system] for system in SYSTEMS}
        cut = [system for system in SYSTEMS if _is_cut_short(recordings[system])]
        self.metrics = {system: _evaluated(recordings[system], metrics, system in cut) for system in SYSTEMS}
        self.whole = not cut
        self.obstacle, self.hindrance = ", ".join(f"the run {system} ends too early" for system in cut), 1.0
        if not cut:
            self.obstacle, self.hindrance = _pretence(recordings)

    def judge(self, statement: Statement, conditions: Iterable[Condition], values: dict[str, float]) -> Claim:
        """Return the claim, which passes if all its conditions hold and there is no obstacle."""
        conditions = tuple(conditions)
        distance = sum(condition.distance for condition in conditions) + (self.hindrance if self.obstacle else 0.0)
        holds = all(condition.holds for condition in conditions)
        passed = holds and not self.obstacle
        room = -min(1.0, *(condition.margin for condition in conditions))
        return Claim(statement, passed, values, self.obstacle, room if passed else distance)

    def pick(self, *names: str) -> dict[str, float]:
        """Return metrics of all systems, named `<system>_<metric>`."""
        return {f"{system}_{name}": self.metrics[system][name] for name in names for system in SYSTEMS}

    def size(self, system: str, name: str) -> float:
        """Return the magnitude of a metric."""
        return abs(self.metrics[system][name])

    def lowers(self, system: str, name: str, fraction: float, minimum: float) -> list[Condition]:
        """Return the conditions that a system lowers the magnitude of a metric to a fraction, and noticeably."""
        none, value = self.size("none", name), self.size(system, name)
        noticeable = [at_least(none - value, minimum)] if minimum else []
        return [at_most(value, fraction * none), *noticeable]

    def both_lower(self, name: str, fraction: float, minimum: float) -> list[Condition]:
        """Return the conditions that both systems lower a metric; see `lowers`."""
        return [part for system in SYSTEMS_WITH_CONTROL for part in self.lowers(system, name, fraction, minimum)]

    def is_smallest(self, system: str, name: str, minimum: float) -> list[Condition]:
        """Return the conditions that the magnitude of a metric is noticeably below the two other runs."""
        others = [self.size(other, name) for other in SYSTEMS if other != system]
        return [at_least(other - self.size(system, name), minimum) for other in others]

    def is_largest(self, system: str, name: str, minimum: float) -> list[Condition]:
        """Return the conditions that the magnitude of a metric is noticeably above the two other runs."""
        others = [self.size(other, name) for other in SYSTEMS if other != system]
        return [at_least(self.size(system, name) - other, minimum) for other in others]


class _Whole(dict[str, float]):
    """Metrics of a run whose manoeuvre may be of another kind than its name says."""

    def __missing__(self, name: str) -> float:
        raise RecordingError(f"the run has no metric {name}: its manoeuvre is of another kind")


class _Cut(dict[str, float]):
    """Metrics of an incomplete run: those that it does not have are unknown."""

    def __missing__(self, name: str) -> float:
        return math.nan


def _evaluated(recording: RecordingLike, metrics: Callable[[RecordingLike], Metrics], cut: bool) -> Metrics:
    if not cut:
        return _Whole(metrics(Evaluable(recording)))
    try:
        return _Cut(metrics(Evaluable(recording)))
    except RecordingError:
        return _Cut()


def _is_cut_short(recording: RecordingLike) -> bool:
    """Return whether a run ended before its manoeuvre; the last row of a whole run lies one step before the end."""
    maneuver: Any = recording.metadata.get("maneuver")
    duration_s = maneuver.get("duration_s") if isinstance(maneuver, Mapping) else None
    time_s = recording.time_s
    if not recording.metadata.get("complete", True) or len(time_s) < 2:
        return True
    end_s = float(time_s[-1]) + 1.5 * timestep(time_s)
    return isinstance(duration_s, (int, float)) and end_s < duration_s


def _pretence(recordings: Mapping[str, RecordingLike]) -> tuple[str, float]:
    """Describe an action of a run that does not fit its system, with the largest missing part, 0 to 1; empty: none."""
    found: list[tuple[str, float]] = []
    for system in SYSTEMS:
        for name, owner in (("rear_steer", "ars"), ("superposition", "afs")):
            demand = f"{name}_demand_rad"
            angle = f"{math.degrees(STEER_RAD):.2f} deg of {name.replace('_', ' ')}"
            if system != owner and float(np.abs(recordings[system][demand]).max()) >= STEER_RAD:
                found.append((f"the run {system} demands {angle}", 1.0))
            if system == owner and not (action := largest_action(recordings[system], demand)) >= STEER_RAD:
                words = f"the run {system} never demands {angle} more than straight ahead, as a mean over {MEAN_S:g} s"
                found.append((words, min(1.0, 1.0 - action / STEER_RAD)))
    return (found[0][0], max(missing for _, missing in found)) if found else ("", 0.0)

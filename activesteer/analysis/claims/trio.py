"""Three runs of a scenario, one a system, as all claims look at them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from activesteer.analysis.claims.action import MEAN_S, largest_action
from activesteer.analysis.claims.claim import SYSTEMS, SYSTEMS_WITH_CONTROL, Claim, Statement, check_systems
from activesteer.analysis.series import timestep
from activesteer.analysis.source import Evaluable, RecordingLike
from activesteer.errors import RecordingError
from activesteer.metric_table import STEER_RAD

Metrics = Mapping[str, float]


class Trio:
    """The runs none, ars and afs of a scenario.

    Attributes:
        recordings: The runs, by system.
        metrics: Their metrics, by system; nan for one that a run cut short does not have.
        whole: Whether all three came to the end of their manoeuvre.
        obstacle: Why no claim can pass on these runs, a sentence; empty where nothing stands against it. A run must
            be whole. That of ars must turn the rear wheels and that of afs the superposition gear, by
            `metric_table.STEER_RAD` more than straight ahead and for longer than noise does (`action.largest_action`);
            neither may ask the other for as much in any instant, and none asks nobody: what a system did not do proves
            nothing about it.
    """

    def __init__(
        self, recordings: Mapping[str, RecordingLike], metrics: Callable[[RecordingLike], Metrics], what: str
    ) -> None:
        """Evaluates the runs.

        Args:
            recordings: Runs by system; more than the three are no matter.
            metrics: What evaluates a run.
            what: Name of the manoeuvre, for errors.

        Raises:
            ParameterError: one of the three runs is missing.
            RecordingError: a run that is whole cannot be evaluated, or a channel is missing.
        """
        check_systems(recordings, what)
        self.recordings = {system: recordings[system] for system in SYSTEMS}
        cut = [system for system in SYSTEMS if _is_cut_short(recordings[system])]
        self.metrics = {system: _evaluated(recordings[system], metrics, system in cut) for system in SYSTEMS}
        self.whole = not cut
        self.obstacle = ", ".join(f"the run {system} ends too early" for system in cut) or _pretence(recordings)

    def judge(self, statement: Statement, holds: bool, values: dict[str, float]) -> Claim:
        """The claim: it passes where its criterion holds and nothing stands against it."""
        return Claim(statement, holds and not self.obstacle, values, self.obstacle)

    def pick(self, *names: str) -> dict[str, float]:
        """Metrics of all systems, named `<system>_<metric>`."""
        return {f"{system}_{name}": self.metrics[system][name] for name in names for system in SYSTEMS}

    def size(self, system: str, name: str) -> float:
        """Magnitude of a metric."""
        return abs(self.metrics[system][name])

    def lowers(self, system: str, name: str, fraction: float, minimum: float) -> bool:
        """Whether a system brings a metric's magnitude down, to a part of that without control and noticeably.

        Args:
            system: The system.
            name: The metric.
            fraction: Most of the value without control that may be left.
            minimum: By how much it must be smaller at least.
        """
        none, value = self.size("none", name), self.size(system, name)
        return value <= fraction * none and none - value >= minimum

    def both_lower(self, name: str, fraction: float, minimum: float) -> bool:
        """Whether both systems do; see `lowers`."""
        return all(self.lowers(system, name, fraction, minimum) for system in SYSTEMS_WITH_CONTROL)

    def is_smallest(self, system: str, name: str, minimum: float) -> bool:
        """Whether a metric's magnitude is noticeably below those of the two other runs."""
        others = [self.size(other, name) for other in SYSTEMS if other != system]
        return all(other - self.size(system, name) >= minimum for other in others)

    def is_largest(self, system: str, name: str, minimum: float) -> bool:
        """Whether a metric's magnitude is noticeably above those of the two other runs."""
        others = [self.size(other, name) for other in SYSTEMS if other != system]
        return all(self.size(system, name) - other >= minimum for other in others)


class _Whole(dict[str, float]):
    """Metrics of a run that may be of another kind than the name of its manoeuvre says."""

    def __missing__(self, name: str) -> float:
        raise RecordingError(f"the run has no metric {name}: is it what its name says?")


class _Cut(dict[str, float]):
    """Metrics of a run that was cut short: what it does not have is not known."""

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
    """Whether a run ended before its manoeuvre does; its last row lies one step before the end."""
    maneuver: Any = recording.metadata.get("maneuver")
    duration_s = maneuver.get("duration_s") if isinstance(maneuver, Mapping) else None
    time_s = recording.time_s
    if not recording.metadata.get("complete", True) or len(time_s) < 2:
        return True
    end_s = float(time_s[-1]) + 1.5 * timestep(time_s)
    return isinstance(duration_s, (int, float)) and end_s < duration_s


def _pretence(recordings: Mapping[str, RecordingLike]) -> str:
    """What a run does that its system does not, or does not do that it should, a sentence; empty where all fits."""
    for system in SYSTEMS:
        for name, owner in (("rear_steer", "ars"), ("superposition", "afs")):
            demand = f"{name}_demand_rad"
            angle = f"{math.degrees(STEER_RAD):.2f} deg of {name.replace('_', ' ')}"
            if system != owner and float(np.abs(recordings[system][demand]).max()) >= STEER_RAD:
                return f"the run {system} asks for {angle}"
            if system == owner and not largest_action(recordings[system], demand) >= STEER_RAD:
                return f"the run {system} never asks for {angle} more than straight ahead, as a mean over {MEAN_S:g} s"
    return ""

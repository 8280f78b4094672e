"""A claim of the paper: its statement, its criterion, and the one judge of all claims.

A statement is a row: its text, its criterion in words, the values that decide, and its conditions. A condition is a
requirement (`analysis.requirement`) on metrics of the runs none, ars and afs. The limits come from the words of the
statement and from what a driver or a sensor can notice (`metric_table`). `tests/fakes.py` names the fakes on which each
statement must not pass.
"""

from __future__ import annotations

import functools
import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

import numpy as np

from activesteer.analysis.requirement import EvaluatedRun, Names, Requirement, distance
from activesteer.analysis.series import Array, timestep
from activesteer.analysis.source import Evaluable, RecordingLike
from activesteer.config import Source
from activesteer.errors import ParameterError, RecordingError
from activesteer.metric_table import STEER_RAD

SYSTEMS: Final = ("none", "ars", "afs")
"""Names of the compared runs: no control, active rear steering, active front superposition."""
SYSTEMS_WITH_CONTROL: Final = SYSTEMS[1:]
ALL: Final = "none ars afs"
"""Key of values that are given for every system."""
TOGETHER: Final = "together"
"""Name in place of a system for values that several runs have together."""
MEAN_S: Final = 0.2
"""Time over which an angle is averaged [s]. A car begins to respond in this time: the compact's lateral acceleration is
at 90 % of its steady state 0.24 s after a step of the steering wheel. The noise of a production yaw rate sensor, 0.1
deg/s in samples of 10 ms, times the largest gain of the paper's controllers, 0.42 s, is 0.04 deg rms in an instant and
0.01 deg in this mean."""
AHEAD_RAD: Final = math.radians(1.0)
"""Steering wheel angle whose first passing ends the part straight ahead [rad]."""

RunMetrics = dict[str, dict[str, float]]
"""System, or `together` -> metrics."""


class Kind(StrEnum):
    """Subject of the statements about a manoeuvre."""

    SYSTEMS = "property of the systems"
    """The steering wheel follows a table. Car, road and system determine the result."""
    DRIVER = "depends on the driver"
    """A driver closes the loop and influences the result too."""


@dataclass(frozen=True)
class Statement:
    """A statement of the paper, and its criterion.

    Attributes:
        id: Its number.
        text: Its words.
        criterion: Condition for it to pass, besides the conditions of all statements (`obstacle_of`).
        values: Values to show: names of systems -> names of metrics.
        conditions: Requirements that must all hold.
    """

    id: str
    text: str
    criterion: str
    values: Mapping[str, Iterable[str]]
    conditions: Sequence[str]

    @functools.cached_property
    def requirements(self) -> list[Requirement]:
        """The conditions, to be evaluated."""
        names = Names((*SYSTEMS, TOGETHER), ("",))
        return [Requirement(text, names, Source("the claims"), (self.id,)) for text in self.conditions]


@dataclass(frozen=True, slots=True)
class Claim:
    """A checked statement.

    Attributes:
        statement: The statement.
        passed: Whether it holds.
        values: The numbers that decide, named `<system>_<metric>`.
        obstacle: Why it cannot pass whatever the numbers are; empty if nothing prevents it.
        distance: Distance from passing: the sum over its broken conditions, each 0 to 1. If it passes, the smallest
            margin of its conditions, at most 1, with a negative sign.
    """

    statement: Statement
    passed: bool
    values: dict[str, float]
    obstacle: str = ""
    distance: float = 0.0

    @property
    def id(self) -> str:
        """Number of the statement."""
        return self.statement.id

    @property
    def text(self) -> str:
        """Words of the statement."""
        return self.statement.text


@dataclass(frozen=True)
class Scenario:
    """A manoeuvre of the paper: call it with recordings to check its statements.

    Attributes:
        what: Its name in errors.
        kind: Subject of its statements.
        statements: Its statements, in order.
        metrics: Function that evaluates a run.
        compared: Function that returns further metrics, by system or `together`, of all runs and their metrics. It is
            told whether the three runs are whole.
    """

    what: str
    kind: Kind
    statements: tuple[Statement, ...]
    metrics: Callable[[RecordingLike], Mapping[str, float]]
    compared: Callable[[Mapping[str, RecordingLike], RunMetrics, bool], RunMetrics] = lambda *_: {}

    def __call__(self, recordings: Mapping[str, RecordingLike]) -> list[Claim]:
        """Check the statements, in order."""
        if missing := [system for system in SYSTEMS if system not in recordings]:
            raise ParameterError(
                f"the claims about the {self.what} need the runs {', '.join(SYSTEMS)}; missing: {', '.join(missing)}",
                value=missing,
                allowed=SYSTEMS,
            )
        cut = [system for system in SYSTEMS if _is_cut_short(recordings[system])]
        metrics = {system: self._evaluated(recordings[system], system in cut) for system in SYSTEMS}
        metrics[TOGETHER] = defaultdict(lambda: math.nan)
        obstacle, hindrance = obstacle_of(recordings, cut)
        try:
            for system, more in self.compared(recordings, metrics, not cut).items():
                metrics[system].update(more)
            return [_judged(statement, metrics, obstacle, hindrance) for statement in self.statements]
        except KeyError as name:
            raise RecordingError(f"a run has no metric {name.args[0]}: its manoeuvre is of another kind") from None

    def _evaluated(self, recording: RecordingLike, cut: bool) -> dict[str, float]:
        """Return the metrics of a run. Those that an incomplete run does not have are nan."""
        if not cut:
            return dict(self.metrics(Evaluable(recording)))
        found: dict[str, float] = defaultdict(lambda: math.nan)
        with suppress(RecordingError):
            found.update(self.metrics(Evaluable(recording)))
        return found


def _judged(statement: Statement, metrics: RunMetrics, obstacle: str, hindrance: float) -> Claim:
    """Return the claim, which passes if all its conditions hold and there is no obstacle."""
    needed = {place for one in statement.requirements for place in one.metrics}
    runs: dict[EvaluatedRun, dict[str, float | None]] = {run: {} for _, run in needed}
    for name, run in needed:
        runs[run][name] = metrics[run.controller][name]
    margins = [requirement(runs) for requirement in statement.requirements]
    values = {
        name if system == TOGETHER else f"{system}_{name}": metrics[system][name]
        for systems, names in statement.values.items()
        for name in names
        for system in systems.split()
    }
    passed = all(margin >= 0.0 for margin in margins) and not obstacle
    gap = -min(1.0, *margins) if passed else sum(map(distance, margins)) + hindrance
    return Claim(statement, passed, values, obstacle, gap)


def _is_cut_short(recording: RecordingLike) -> bool:
    """Return whether a run ended before its manoeuvre. The last row of a whole run lies one step before the end."""
    maneuver: Any = recording.metadata.get("maneuver")
    duration_s = maneuver.get("duration_s") if isinstance(maneuver, Mapping) else None
    time_s = recording.time_s
    if not recording.metadata.get("complete", True) or len(time_s) < 2:
        return True
    end_s = float(time_s[-1]) + 1.5 * timestep(time_s)
    return isinstance(duration_s, (int, float)) and end_s < duration_s


def obstacle_of(recordings: Mapping[str, RecordingLike], cut: Sequence[str]) -> tuple[str, float]:
    """Return why no claim can pass on three runs, and the distance of this obstacle from vanishing, 0 to 1.

    A run must be whole. The run of ars must turn the rear wheels and the run of afs the superposition gear, by
    `metric_table.STEER_RAD` more than straight ahead and for longer than noise does (`largest_action`). No run may
    demand as much of an actuator that its system does not have: an action that a system did not perform proves nothing.
    """
    if cut:
        return ", ".join(f"the run {system} ends too early" for system in cut), 1.0
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


def straight_ahead(recording: RecordingLike) -> slice:
    """Return the rows before the steering wheel is first turned, or none if it is turned from the beginning."""
    turned = np.abs(recording["steering_wheel_rad"]) > AHEAD_RAD
    return slice(0, int(np.argmax(turned)) if turned.any() else len(turned))


def largest_action(recording: RecordingLike, demand: str) -> float:
    """Return by how much more a system turns wheels in a manoeuvre than straight ahead before it [rad].

    A controller responds to noise and offsets of its sensors too. Noise of an instant moves no car, and an offset acts
    the same straight ahead. Both angles are therefore largest magnitudes of the demanded angle's mean over `MEAN_S`.
    """
    step_s, values = timestep(recording.time_s), recording[demand]
    ahead = np.abs(_means(values[straight_ahead(recording)], step_s))
    return float(np.abs(_means(values, step_s)).max() - ahead.max(initial=0.0))


def _means(values: Array, timestep_s: float) -> Array:
    """Return the mean of a signal over `MEAN_S` around every sample, or over a shorter signal, shape (n,)."""
    width = min(len(values), max(1, round(MEAN_S / timestep_s)))
    return np.convolve(values, np.full(width, 1.0 / width), mode="same") if width else values


def mean_straight_ahead(recording: RecordingLike, channel: str) -> float:
    """Return the mean of a channel straight ahead, in its unit, or 0 if no part of the run is straight ahead."""
    ahead = recording[channel][straight_ahead(recording)]
    return float(np.mean(ahead)) if len(ahead) else 0.0

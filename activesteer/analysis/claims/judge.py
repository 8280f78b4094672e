"""Judgement of the paper's claims.

`statements.toml` has a row for each statement: its text, its criterion in words, the values that decide, and its
conditions. A condition is a requirement (`analysis.requirement`) on metrics of the runs none, ars and afs. The limits
come from the words of the statement and from what a driver or a sensor can notice (`metric_table`). The tests have
fakes on which each statement must not pass.
"""

from __future__ import annotations

import functools
import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.analysis import lanes, path_following, sine_with_dwell, step_response
from activesteer.analysis.harm import LOST_SIDESLIP_RAD
from activesteer.analysis.requirement import EvaluatedRun, Names, Requirement, distance
from activesteer.analysis.series import Array, crossing_time, rms, smooth, timestep
from activesteer.analysis.source import Evaluable, RecordingLike, read_course
from activesteer.config import Source, build, read_toml
from activesteer.core import metric_table
from activesteer.errors import ParameterError, RecordingError

SYSTEMS: Final = ("none", "ars", "afs")
"""Names of the compared runs: no control, active rear steering, active front superposition."""
TOGETHER: Final = "together"
"""Name in place of a system's name, for values of several runs together."""
# A car begins to respond in this time: the compact's lateral acceleration is at 90 % of its steady state 0.24 s after a
# step of the steering wheel. The noise of a production yaw rate sensor is 0.1 deg/s in samples of 10 ms. Times the
# largest gain of the paper's controllers, 0.42 s, it is 0.04 deg rms at one time and 0.01 deg in this mean.
MEAN_S: Final = 0.2
"""Time over which an angle is averaged [s]."""
AHEAD_RAD: Final = math.radians(1.0)
"""Steering wheel angle that ends the straight-ahead part when it is first exceeded [rad]."""

RunMetrics = dict[str, dict[str, float]]
"""Metrics by system, or by `together`."""


class Kind(StrEnum):
    """Subject of the statements about a manoeuvre: the systems, or also the driver."""

    SYSTEMS = "property of the systems"
    """The steering wheel follows a table. Car, road and system determine the result."""
    DRIVER = "depends on the driver"
    """A driver closes the loop and influences the result too."""


@dataclass(frozen=True)
class Statement:
    """A statement of the paper, and its criterion."""

    id: str
    """Number of the statement."""
    text: str
    """Text of the statement."""
    criterion: str
    """Condition for the statement to hold, in addition to the conditions of all statements (`obstacle_of`)."""
    values: dict[str, tuple[str, ...]]
    """Values to show: names of metrics by names of systems."""
    conditions: tuple[str, ...]
    """Requirements that must all hold."""

    @functools.cached_property
    def requirements(self) -> list[Requirement]:
        """Parsed conditions of the statement."""
        names = Names((*SYSTEMS, TOGETHER), ("",))
        return [Requirement(text, names, Source("the claims"), (self.id,)) for text in self.conditions]


@dataclass(frozen=True, slots=True)
class Claim:
    """A statement of the paper, judged on recordings.

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
        """Text of the statement."""
        return self.statement.text


@dataclass(frozen=True)
class Scenario:
    """A manoeuvre of the paper: call it with recordings to check its statements."""

    what: str
    kind: Kind
    statements: tuple[Statement, ...]
    metrics: Callable[[RecordingLike], Mapping[str, float]]  # function that evaluates a run
    # function that returns further metrics of all runs and their metrics; it is told whether the three runs are whole
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
        # Metrics that an incomplete run does not have are nan.
        metrics: RunMetrics = {name: defaultdict(lambda: math.nan) for name in (*cut, TOGETHER)}
        for system in SYSTEMS:
            with suppress(RecordingError) if system in cut else nullcontext():
                metrics.setdefault(system, {}).update(self.metrics(Evaluable(recordings[system])))
        obstacle, hindrance = obstacle_of(recordings, cut)
        try:
            for system, more in self.compared(recordings, metrics, not cut).items():
                metrics[system].update(more)
            return [_judged(statement, metrics, obstacle, hindrance) for statement in self.statements]
        except KeyError as name:
            raise RecordingError(f"a run has no metric {name.args[0]}: its manoeuvre is of another kind") from None


def _judged(statement: Statement, metrics: RunMetrics, obstacle: str, hindrance: float) -> Claim:
    """Return the claim, which passes if all its conditions hold and no `obstacle` prevents a pass."""
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
    """Return whether a run ended early. The last row may be one step before the end of the manoeuvre."""
    maneuver: Any = recording.metadata.get("maneuver")
    duration_s = maneuver.get("duration_s") if isinstance(maneuver, Mapping) else None
    time_s = recording.time_s
    if not recording.metadata.get("complete", True) or len(time_s) < 2:
        return True
    end_s = float(time_s[-1]) + 1.5 * timestep(time_s)
    return isinstance(duration_s, (int, float)) and end_s < duration_s


def obstacle_of(recordings: Mapping[str, RecordingLike], cut: Sequence[str]) -> tuple[str, float]:
    """Return the reason why no claim about three runs can pass, and how far the runs are from removing it, 0 to 1."""
    # A run must be whole. The run of ars must turn the rear wheels and the run of afs the superposition gear, by
    # `metric_table.STEER_RAD` more than straight ahead and for longer than noise does (`largest_action`). No run may
    # demand as much of an actuator that its system does not have: an action that was not performed proves nothing.
    if cut:
        return ", ".join(f"the run {system} ends too early" for system in cut), 1.0
    found: list[tuple[str, float]] = []
    for system in SYSTEMS:
        for name, owner in (("rear_steer", "ars"), ("superposition", "afs")):
            demand = f"{name}_demand_rad"
            angle = f"{math.degrees(metric_table.STEER_RAD):.2f} deg of {name.replace('_', ' ')}"
            if system != owner and float(np.abs(recordings[system][demand]).max()) >= metric_table.STEER_RAD:
                found.append((f"the run {system} demands {angle}", 1.0))
            if system == owner and not (action := largest_action(recordings[system], demand)) >= metric_table.STEER_RAD:
                words = f"the run {system} never demands {angle} more than straight ahead, as a mean over {MEAN_S:g} s"
                found.append((words, min(1.0, 1.0 - action / metric_table.STEER_RAD)))
    return (found[0][0], max(missing for _, missing in found)) if found else ("", 0.0)


def straight_ahead(recording: RecordingLike) -> slice:
    """Return the samples before the steering wheel is first turned, as a slice."""
    turned = np.abs(recording["steering_wheel_rad"]) > AHEAD_RAD
    return slice(0, int(np.argmax(turned)) if turned.any() else len(turned))


def largest_action(recording: RecordingLike, demand: str) -> float:
    """Return the largest wheel angle that a system adds in a manoeuvre, beyond the angle straight ahead [rad]."""
    # A controller responds to noise and offsets of its sensors too. Noise of an instant moves no car, and an offset
    # acts the same straight ahead. Both angles are therefore largest magnitudes of the demanded angle's mean over
    # `MEAN_S`.
    step_s, values = timestep(recording.time_s), recording[demand]
    ahead = np.abs(_means(values[straight_ahead(recording)], step_s))
    return float(np.abs(_means(values, step_s)).max() - ahead.max(initial=0.0))


def _means(values: Array, timestep_s: float) -> Array:
    """Return the mean of a signal over a window of `MEAN_S` around every sample, shape (n,)."""
    width = min(len(values), max(1, round(MEAN_S / timestep_s)))
    return np.convolve(values, np.full(width, 1.0 / width), mode="same") if width else values


LEVEL: Final = 0.9
"""Fraction of the steady-state value of `none` at which the delays of the step steer are compared."""
MIN_ANGLE_RAD: Final = math.radians(0.1)
"""Least size of two added angles that are compared [rad]."""
END_S: Final = 3.0
"""Length of the end of the slippery run, which the paper's figures show [s]."""
COMMON_DELAYS: Final = {"yaw_rate_delay_s": ("yaw_rate", "radps"), "ay_delay_s": ("ay", "mps2")}
"""Names and units of the signals whose times to a common level, 90 % of the steady state of `none`, are compared."""
TURNED: Final = (("rear_steer", "rad"), ("superposition", "rad"), ("sideslip", "rad"))
"""Settled angles that count from straight ahead, where the offset of a sensor also turns wheels."""
ADDED: Final = ("rear_steer_steady_state_rad", "superposition_steady_state_rad")
"""Angles that count without the compliance of the hinges, which the car without control has too."""


def _step_metrics(recording: RecordingLike) -> dict[str, float]:
    values = step_response.step_response_metrics(recording)
    for name, unit in TURNED:
        ahead = recording[f"{name}_{unit}"][straight_ahead(recording)]
        values[f"{name}_steady_state_{unit}"] -= float(np.mean(ahead)) if len(ahead) else 0.0
    return values | {"yaw_rate_peak_abs_radps": float(np.abs(recording["yaw_rate_radps"]).max())}


def _step_compared(recordings: Mapping[str, RecordingLike], metrics: RunMetrics, whole: bool) -> RunMetrics:
    """Return the added steer angles, and the time of each signal from step to common level, or nan."""
    found: RunMetrics = {}
    for system in SYSTEMS:
        own = metrics[system]
        values = {f"added_{name}": own[name] - metrics["none"][name] for name in ADDED}
        for delay, (name, unit) in COMMON_DELAYS.items():
            values[delay] = math.nan
            if whole:
                steady, begin_s = metrics["none"][f"{name}_steady_state_{unit}"], own["step_time_s"]
                time_s = recordings[system].time_s
                moving = math.copysign(1.0, steady) * smooth(recordings[system][f"{name}_{unit}"], timestep(time_s))
                after = time_s >= begin_s
                values[delay] = crossing_time(time_s[after], moving[after], LEVEL * abs(steady)) - begin_s
        found[system] = values
    return found


def _added_angles(recordings: Mapping[str, RecordingLike], _: RunMetrics, whole: bool) -> RunMetrics:
    """Compare the demanded rear and superposition angles from reversal to the end: correlation and opposite signs."""
    if not whole:
        return {TOGETHER: {"added_angles_common_s": 0.0}}
    ars, afs = recordings["ars"], recordings["afs"]
    times = sine_with_dwell.steering(ars)
    later_s = sine_with_dwell.steering(afs).begin_s - times.begin_s
    time_s = ars.time_s
    wanted = (time_s >= times.reversal_s) & (time_s <= times.completion_s + sine_with_dwell.INSTANTS_S[-1])
    rear = ars["rear_steer_demand_rad"][wanted]
    front = np.interp(time_s[wanted] + later_s, afs.time_s, afs["superposition_demand_rad"])
    both = (np.abs(rear) > MIN_ANGLE_RAD) & (np.abs(front) > MIN_ANGLE_RAD)
    scale = float(np.sqrt(np.sum(rear**2) * np.sum(front**2)))
    return {
        TOGETHER: {
            "added_angles_correlation": float(np.sum(rear * front)) / scale if scale > 0.0 else math.nan,
            "added_angles_opposite_share": float(np.mean(rear[both] * front[both] < 0.0)) if both.any() else math.nan,
            "added_angles_common_s": float(np.count_nonzero(both)) * float(time_s[1] - time_s[0]),
        }
    }


def _tracks(recordings: Mapping[str, RecordingLike], _: RunMetrics, whole: bool) -> RunMetrics:
    course = read_course(recordings["none"])
    first_m, last_m = course.first_gate_x_m, course.last_gate_x_m
    if last_m is None or not whole:
        return {}
    return {
        TOGETHER: {
            f"track_difference_{one}_{other}_m": lanes.largest_difference(
                recordings[one], recordings[other], first_m, last_m
            )
            for one, other in combinations(SYSTEMS, 2)
        }
    }


def _slippery_metrics(recording: RecordingLike) -> dict[str, float]:
    # A course without lanes has no track to stay on.
    without = dict.fromkeys((metric_table.LANE_OVERSTEP, metric_table.STAYS_IN_LANES, metric_table.CONES_HIT), math.nan)
    last = recording.time_s >= recording.time_s[-1] - END_S
    end = {
        "yaw_rate_end_rms_radps": rms(recording["yaw_rate_radps"][last]),
        "sideslip_end_rms_rad": rms(recording["sideslip_rad"][last]),
    }
    return without | path_following.path_following_metrics(recording) | end


class _Limit(float):
    """Number in a criterion. The format `{:%}` writes a space before the percent sign."""

    def __format__(self, spec: str) -> str:
        return f"{100.0 * self:.0f} %" if spec == "%" else f"{float(self):g}"


def _statements() -> dict[str, tuple[Statement, ...]]:
    """Return the claims of `statements.toml` by manoeuvre, with their limits."""
    table, source = read_toml(Path(__file__).with_name("statements.toml"), ParameterError)
    least = metric_table
    angles = {
        "steer_deg": least.STEER_RAD, "settled_deg": least.SETTLED_SIDESLIP_RAD, "sideslip_deg": least.SIDESLIP_RAD,
        "yaw_rate_degps": least.YAW_RATE_RADPS, "wheel_deg": least.STEERING_WHEEL_RAD, "lost_deg": LOST_SIDESLIP_RAD,
    }  # fmt: skip
    numbers = {name: math.degrees(angle) for name, angle in angles.items()} | table.pop("limits")
    numbers |= {"time_s": least.TIME_S, "time_ms": 1000.0 * least.TIME_S, "track_m": least.TRACK_M}
    limits = {name: _Limit(number) for name, number in numbers.items()}
    words = {name: text.format(**limits) for name, text in table.pop("words").items()}
    found: dict[str, tuple[Statement, ...]] = {}
    for scenario, rows in table.items():
        for place, row in enumerate(rows):
            one = build(Statement, row, source, (scenario, str(place)))
            conditions = [
                condition.format(x=system, **limits)
                for condition in one.conditions
                for system in (SYSTEMS[1:] if "{x}" in condition else ("",))
            ]
            one = replace(one, criterion=one.criterion.format(**limits, **words), conditions=tuple(conditions))
            found[scenario] = (*found.get(scenario, ()), one)
    return found


_ROWS: Final = _statements()
SCENARIOS: Final[dict[str, Scenario]] = {
    "step_steer": Scenario("step steer", Kind.SYSTEMS, _ROWS["step_steer"], _step_metrics, _step_compared),
    "sine_with_dwell": Scenario(
        "sine with dwell",
        Kind.SYSTEMS,
        _ROWS["sine_with_dwell"],
        sine_with_dwell.sine_with_dwell_metrics,
        _added_angles,
    ),
    "double_lane_change": Scenario(
        "double lane change",
        Kind.DRIVER,
        _ROWS["double_lane_change"],
        lambda run: {metric_table.CONES_HIT: math.nan} | path_following.path_following_metrics(run),
        _tracks,
    ),
    "slalom": Scenario("slalom", Kind.DRIVER, _ROWS["slalom"], path_following.path_following_metrics),
    "double_lane_change_low_mu": Scenario(
        "slippery double lane change", Kind.DRIVER, _ROWS["double_lane_change_low_mu"], _slippery_metrics
    ),
}
"""Claims by the name of their manoeuvre, in the order of the paper's sections."""
STATEMENTS: Final = {row.id: row for scenario in SCENARIOS.values() for row in scenario.statements}
"""Statements by number, in the same order."""
SCENARIO_OF: Final = {row.id: name for name, scenario in SCENARIOS.items() for row in scenario.statements}
"""Name of the manoeuvre of each statement, by the number of the statement."""

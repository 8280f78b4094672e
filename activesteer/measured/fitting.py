"""Fit of car parameters to recordings, which are driven again with their inputs.

All values are relative: differences to the noise of their channel, parameters to their range, 0 to 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.series import rms
from activesteer.config import Range, build, field_in_unit
from activesteer.core.conventions import Array
from activesteer.driver import is_driver_file
from activesteer.errors import ActiveSteerError, RecordingError, StudyError, nearest_names
from activesteer.measured.fit_result import Compared, Fit, Parameter, indistinguishable, intervals, without_effect
from activesteer.measured.signals import at_sensor, by_channel
from activesteer.recording import Recording
from activesteer.scenario import FileOrTable, resolve, value_of
from activesteer.scenario.scenario import is_recording, led, open_loop_of
from activesteer.simulation.runner import run_scenario
from activesteer.studies.engine.factor_values import FactorValues, label_of
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.runs import Settings, prepare
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.workers import Workers, in_parallel, workers_for


@dataclass(frozen=True)
class FitTable:
    """Table [fit] of a study file."""

    noise: dict[str, Annotated[float, Range(1e-12)]]
    """Standard deviation of the noise of each channel, in the unit of the key, such as `yaw_rate_degps`. It scales the
    differences."""
    start: dict[str, float] = field(default_factory=dict)
    """Start of the search for each factor; by default the value of the files, or the middle of the range."""
    from_s: float = -math.inf
    """Start of the compared part of the recordings [s]. Inputs are driven from the first row."""
    until_s: float = math.inf
    """End of the compared part [s]."""
    windows: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Start and end of the compared part of each recording, instead of `from_s` and `until_s` [s]."""
    intervals: Literal["residuals", "noise"] = "residuals"
    """Basis of the intervals: the final residuals with their autocorrelation, or the stated `noise`."""


def read_fit(given: FileOrTable) -> tuple[StudyFile, FitTable]:
    """Read a study file with a table [fit]."""
    study = read_study(given, "fit")
    fail = study.source.fail
    table = build(FitTable, study.fit or {}, study.source, ("fit",))
    if not table.noise:
        raise fail(("fit", "noise"), "is empty; give at least one channel, such as yaw_rate_degps = 0.2")
    if study.case_list is not None or not study.factors:
        raise fail(("factors",), "a fit needs factors with ranges")
    for key in ("vehicles", "controllers"):
        if len(getattr(study, key)) != 1:
            raise fail((key,), f"a fit needs exactly one, not {len(getattr(study, key))}")
    for maneuver in study.maneuvers:
        if not is_recording(maneuver):
            raise fail(("maneuvers",), f"{maneuver!r} is not a recording (.mcap) with inputs to drive", maneuver)
    for factor in study.factors:
        if factor.kind != "uniform":
            raise fail(("factors", factor.key, factor.kind), "a fit needs a range: uniform = [low, high]")
    ranges = {factor.key: Range(factor.low, factor.high) for factor in study.factors}
    for key, value in table.start.items():
        if key not in ranges:
            raise fail(("fit", "start", key), f"is not a factor; factors are {', '.join(ranges)}", value, list(ranges))
        if not ranges[key].low <= value <= ranges[key].high:
            raise fail(
                ("fit", "start", key), f"{value:g} is out of its range; that is {ranges[key]}", value, ranges[key]
            )
    return study, table


_FEWEST: Final = 20
"""Smallest number of samples of a channel in a recording."""


class Measured(NamedTuple):
    """Recording on the time axis of its manoeuvre."""

    name: str  # name of its file
    begin_s: float  # time of the recording at which the manoeuvre starts [s]
    channels: dict[str, tuple[Array, Array]]  # times at which a channel is compared [s], and measured values there, SI


def measured_of(
    recording: Recording, name: str, study: StudyFile, table: FitTable, channels: Collection[str]
) -> Measured:
    """Return the data of a recording for the comparison."""
    if not len(recording):
        raise RecordingError("has no rows", file=f"{name}.mcap")
    time_s = recording.time_s
    begin_s = float(time_s[0])
    # The last row of a run is one step before its end.
    begin, end = table.windows.get(name, (table.from_s, table.until_s))
    inside = (time_s >= begin) & (time_s <= min(end, time_s[-1] - study.timestep_s))
    found = {}
    for channel in channels:
        if channel not in recording:
            have = [each.name for each in recording.channels]
            key = next(key for key in table.noise if field_in_unit(key, (channel,))[0])
            raise study.source.fail(
                ("fit", "noise", key), f"{name} has no such channel; {nearest_names(channel, have)}", channel, have
            )
        values = recording[channel]
        kept = inside & np.isfinite(values)
        if (count := np.count_nonzero(kept)) < _FEWEST:
            raise RecordingError(
                f"has {count} samples to compare, and {_FEWEST} are needed; it is recorded from {time_s[0]:g} to "
                f"{time_s[-1]:g} s, and compared from fit.from_s to fit.until_s",
                file=f"{name}.mcap", key=channel,
            )  # fmt: skip
        found[channel] = time_s[kept] - begin_s, values[kept]
    return Measured(name, begin_s, found)


STEP: Final = 1e-3
"""Step of the derivatives, relative to the range: far above rounding, far below the curvature of a run."""
_SETTLED: Final = 1e-4
"""Largest step of a parameter, as a fraction of its range, at which the search ends. Gauss-Newton steps shrink
quadratically, so the remaining error is far smaller."""
_LESS: Final = 1e-8
"""Relative decrease of the sum of squares at or below which the search also ends."""
_MOST_ROUNDS: Final = 40
AT_END: Final = 1e-3
"""Distance from an end of its range, as a fraction of the range, at which a parameter counts as at the end."""

Answer = list[Array] | str
"""Differences of every channel of every recording for a set of parameters, or the reason why it cannot be driven."""


class Found(NamedTuple):
    """Result of the search for the parameters."""

    place: Array  # parameters, shape (p,)
    before: list[Array]  # differences at the start, a series per channel and recording
    after: list[Array]  # differences at the end
    slopes: list[Array]  # derivatives at the end, shape (n, p) each
    rounds: int  # number of parameter sets tried
    settled: bool  # whether the search converged


def search(
    answers: Callable[[list[Array]], Sequence[Answer]], start: Array, check: Callable[[list[Array]], None]
) -> Found:
    """Minimise the sum of squares of all differences (trust region reflective, SciPy)."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - slow to import

    rounds: dict[bytes, tuple[list[Array], list[Array]] | str] = {}

    def tried(place: Array) -> tuple[list[Array], list[Array]] | str:
        """Return differences and derivatives, or the reason why the runs failed."""
        name = place.tobytes()
        if name not in rounds:
            rounds[name] = _tried(answers, place)
        return rounds[name]

    def differences(place: Array) -> Array:
        found = tried(place)
        # The search shortens its step if a value is not finite.
        return np.full(size, np.nan) if isinstance(found, str) else np.concatenate(found[0])

    # Away from the ends of a range, so that the search can step to both sides.
    start = np.clip(start, STEP, 1.0 - STEP)
    begun = tried(start)
    if isinstance(begun, str):
        raise StudyError(f"the car cannot be driven at the start of the search: {begun}", value=begun)
    check(begun[1])
    size = sum(map(len, begun[0]))
    # SciPy asks for derivatives at drivable parameters only. It declares no types for them.
    derivatives, unused = cast(Any, lambda place: np.concatenate(tried(place)[1])), cast(Any, None)
    found = least_squares(
        differences, start, derivatives, (0.0, 1.0), xtol=_SETTLED, ftol=_LESS, gtol=unused, max_nfev=_MOST_ROUNDS
    )
    last = tried(found.x)
    assert not isinstance(last, str)
    return Found(found.x, begun[0], *last, len(rounds), found.status > 0)


def _tried(answers: Callable[[list[Array]], Sequence[Answer]], place: Array) -> tuple[list[Array], list[Array]] | str:
    steps = np.where(place + STEP > 1.0, -STEP, STEP)
    here, *there = answers([place, *(place + step for step in np.diag(steps))])
    if isinstance(here, str):
        return here
    slopes: list[list[Array]] = [[] for _ in here]
    for beside, step in zip(there, steps, strict=True):
        if isinstance(beside, str):
            raise StudyError(f"the car can be driven with some parameters, but not with values close to them: {beside}")
        for columns, side, series in zip(slopes, beside, here, strict=True):
            columns.append((side - series) / step)
    return here, [np.column_stack(columns) for columns in slopes]


SPEED_HOLD: Final = {"driver.speed_gain_1ps": 8.0, "driver.speed_integral_gain_1ps2": 8.0}
"""Gains that hold the recorded speed to 0.1 %, unless the study sets them. A driver's gains leave 0.3 %, which the fit
would attribute to the car."""


FitProgress = Callable[[int, int, int, float], None]
"""Callback with the number of the tried set, finished and all runs of it, and least misfit (nan before the first)."""


def fit(
    study_file: FileOrTable,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: FitProgress = lambda *_: None,
) -> Fit:
    """Find the values of factors that best match a car to recordings."""
    problem = _Problem(*read_fit(study_file))
    with workers_for(jobs, scheduler=scheduler) as workers:
        prepare(workers, problem.settings)
        found = search(partial(problem.answers, workers, progress), problem.start, problem.check)
    return problem.result(found)


class _Problem:
    """Recordings, runs that repeat them, and their differences."""

    def __init__(self, study: StudyFile, table: FitTable) -> None:
        recordings = [Recording.open(Path(str(path))) for path in study.maneuvers]
        names = [label_of(path) for path in study.maneuvers]
        held = SPEED_HOLD if is_driver_file(study.driver) else {}
        known = {key: value for key, value in held.items() if key not in study.keys} | study.overrides
        inputs = open_loop_of(recordings[0], names[0])
        first = resolve(inputs, study.vehicles[0], known, study.driver, study.controllers)
        car = first.car.on(first.maneuver.ground, study.timestep_s)
        channels = [channel.name for channel in car.channels.channels]
        noise = by_channel(table.noise, channels, study.source, ("fit", "noise"))
        self._noise = {name: factor * size for name, (_, factor, size) in noise.items()}
        self._measured = [
            measured_of(recording, name, study, table, self._noise)
            for recording, name in zip(recordings, names, strict=True)
        ]
        maneuvers = [
            led(open_loop_of(recording, measured.name), car.steering_lag_s)
            for recording, measured in zip(recordings, self._measured, strict=True)
        ]
        self._study = replace(study, maneuvers=tuple(maneuvers), overrides=known)
        self._plan = Plan(self._study)
        self._table = table
        self._low, self._high = (np.array([getattr(each, end) for each in study.factors]) for end in ("low", "high"))
        self.settings: Settings = self._plan.settings
        start = np.array([_start(factor, table, first, study) for factor in study.factors])
        self.start = (start - self._low) / (self._high - self._low)
        self.runs, self._rounds, self._best = 0, 0, math.nan

    def _factor_values(self, place: Array) -> dict[str, Any]:
        values = self._low + (self._high - self._low) * place
        return dict(zip(self._study.keys, values.tolist(), strict=True))

    def answers(self, workers: Workers, progress: FitProgress, places: list[Array]) -> list[Answer]:
        """Repeat every recording with each of several sets of parameters, on the workers."""
        self._rounds += 1
        calls, count = [], len(self._measured)
        for place in places:
            for recording, measured in enumerate(self._measured):
                overrides = self._plan.request_with(0, 0, (recording, 0, 0), self._factor_values(place)).overrides
                times = {name: time_s for name, (time_s, _) in measured.channels.items()}
                calls.append((self.settings, recording, overrides, times))

        def report(_: int, done: int) -> None:
            self.runs += 1
            progress(self._rounds, done, len(calls), self._best)

        driven = in_parallel(drive, calls, report=report, workers=workers)
        found = [self._answer(driven[first : first + count]) for first in range(0, len(driven), count)]
        if not isinstance(found[0], str):
            self._best = np.fmin(self._best, rms(np.concatenate(found[0])))
        return found

    def _answer(self, driven: Sequence[dict[str, Array] | str]) -> Answer:
        series = []
        for run, measured in zip(driven, self._measured, strict=True):
            if isinstance(run, str):
                return f"{measured.name}: {run}"
            series += [(run[name] - values) / self._noise[name] for name, (_, values) in measured.channels.items()]
        return series

    def check(self, slopes: list[Array]) -> None:
        """Check that every factor has a measured effect that differs from the effects of the others."""
        source, keys = self._study.source, self._study.keys
        for place in without_effect(slopes):
            raise source.fail(
                ("factors", keys[place]),
                "has no effect above the noise on these channels in these recordings; leave it out",
            )
        if together := indistinguishable(slopes):
            first, *others = same = [keys[place] for place in together]
            raise source.fail(
                ("factors", first),
                f"cannot be separated from {' and '.join(others)} by these recordings: a combined change leaves these "
                "channels unchanged; set all but one of them in [overrides]",
                same,
            )

    def result(self, found: Found) -> Fit:
        """Return the result of the search."""
        free: NDArray[np.bool_] = (found.place > AT_END) & (found.place < 1.0 - AT_END)
        self.check(found.slopes)
        half_widths, correlations, samples, freedom = intervals(
            found.after, found.slopes, free, stated=self._table.intervals == "noise"
        )
        values, start = self._factor_values(found.place), self._factor_values(self.start)
        parameters = tuple(
            Parameter(factor.key, values[factor.key], float(half), start[factor.key], factor.low, factor.high)
            for factor, half in zip(self._study.factors, (self._high - self._low) * half_widths, strict=True)
        )
        places = [(measured, *each) for measured in self._measured for each in measured.channels.items()]
        compared = tuple(
            Compared(
                measured.name, name, self._noise[name], measured.begin_s + time_s, values, before, after, independent
            )
            for (measured, name, (time_s, values)), before, after, independent in zip(
                places, found.before, found.after, samples, strict=True
            )
        )
        factors = FactorValues(self._study)
        everywhere = {factor.key for factor in self._study.factors if not factor.maneuvers}
        overrides = [factors.overrides(number, 0, values) for number in range(len(self._measured))]
        return Fit(
            parameters, correlations, compared, self._table.intervals, freedom, rms(np.concatenate(found.after)),
            found.rounds, self.runs, found.settled,
            {key: value for key, value in overrides[0].items() if key in everywhere},
            {measured.name: own for measured, each in zip(self._measured, overrides, strict=True)
             if (own := {key: value for key, value in each.items() if key not in everywhere})},
        )  # fmt: skip


def drive(
    settings: Settings, recording: int, overrides: dict[str, Any], times: dict[str, Array]
) -> dict[str, Array] | str:
    """Drive once, and return the compared channels, or the reason for a failure."""
    try:
        scenario = settings.study.scenario(recording, 0, overrides)
        run = run_scenario(scenario, settings.study.controllers[0], timestep_s=settings.study.timestep_s)
    except ActiveSteerError as error:
        return str(error)
    run = at_sensor(run)
    return {name: np.interp(time_s, run.time_s, run[name]) for name, time_s in times.items()}


def _start(factor: Factor, table: FitTable, scenario: Any, study: StudyFile) -> float:
    """Return the start value of a factor."""
    if factor.key in table.start:
        return table.start[factor.key]
    if factor.nominal:
        here: Any = 1.0 if factor.nominal == "times" else 0.0
    else:
        here = value_of(scenario, factor.key, study.controllers)
    if isinstance(here, (int, float)) and not isinstance(here, bool) and factor.low <= here <= factor.high:
        return float(here)
    return 0.5 * (factor.low + factor.high)

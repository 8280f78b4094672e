"""Fit of car parameters: recordings are driven again with their inputs until the differences are smallest."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array
from activesteer.driver import is_driver_file
from activesteer.errors import ActiveSteerError
from activesteer.measured.fit_data import measured_of, noise_of
from activesteer.measured.fit_file import FitTable, read_fit
from activesteer.measured.fit_result import Compared, Fit, Parameter, notes_of
from activesteer.measured.intervals import intervals, told_apart, without_effect
from activesteer.measured.least_squares import AT_END, Answer, Found, search
from activesteer.measured.motion import at_sensor
from activesteer.recording import Recording
from activesteer.scenario import FileOrTable, resolve, value_of
from activesteer.scenario.recorded_inputs import led, open_loop_of
from activesteer.simulation.runner import run_scenario
from activesteer.studies.engine.factor_values import FactorValues, label_of
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.run_settings import Settings, prepare, scenario_of
from activesteer.studies.engine.study_file import StudyFile
from activesteer.studies.engine.task_queue import TaskQueue
from activesteer.studies.engine.workers import Workers, workers_for

SPEED_HOLD: Final = {"driver.speed_gain_1ps": 8.0, "driver.speed_integral_gain_1ps2": 8.0}
"""Gains that hold the recorded speed to 0.1 %, unless the study sets them. A driver's gains leave 0.3 %, which the fit
would attribute to the car."""


class FitProgress(NamedTuple):
    """Progress of a fit.

    Attributes:
        round: Number of the parameter set that is tried with its derivatives.
        done: Finished runs of this round.
        total: Runs of this round.
        misfit: Rms of all differences relative to their noise, of the best set so far; nan before the first.
    """

    round: int
    done: int
    total: int
    misfit: float


def fit(
    study_file: FileOrTable,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[FitProgress], None] | None = None,
) -> Fit:
    """Find values of factors for which the car, driven by recorded inputs, matches recordings best.

    Args:
        study_file: Name or path of a study file with a table [fit], or its table.
        jobs: Number of processes; the number of processors by default.
        scheduler: Address or file of a Dask scheduler to use instead.
        progress: Called after every run.

    Returns:
        Values, intervals and residuals.

    Raises:
        StudyError: the file is wrong, a factor has no measured effect or cannot be separated from another, or the car
            cannot be driven.
        ActiveSteerError: a recording, the vehicle, the controller or a key is wrong.
    """
    problem = _Problem(*read_fit(study_file))
    with workers_for(jobs, scheduler=scheduler) as workers:
        prepare(workers, problem.settings)
        found = search(problem.answers_by(workers, progress or (lambda _: None)), problem.start, problem.check)
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
        self._noise = noise_of(study, table, [channel.name for channel in car.channels.channels])
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
        self._values = FactorValues(self._study)
        self._table = table
        self._factors = study.factors
        self._low, self._high = (np.array([getattr(each, end) for each in study.factors]) for end in ("low", "high"))
        self.settings: Settings = self._plan.settings
        self.start = self._unit([_start(factor, table, first, study) for factor in study.factors])
        self.runs = 0

    def _unit(self, values: Sequence[float]) -> Array:
        return (np.array(values) - self._low) / (self._high - self._low)

    def _factor_values(self, place: Array) -> dict[str, Any]:
        values = self._low + (self._high - self._low) * place
        return dict(zip(self._study.keys, values.tolist(), strict=True))

    def answers_by(
        self, workers: Workers, progress: Callable[[FitProgress], None]
    ) -> Callable[[list[Array]], list[Answer]]:
        """Return a function that drives sets of parameters: each set in each recording, spread over workers."""
        rounds, best = 0, math.nan

        def answers(places: list[Array]) -> list[Answer]:
            nonlocal rounds, best
            rounds += 1
            queue = TaskQueue(workers)
            for number, place in enumerate(places):
                for recording, measured in enumerate(self._measured):
                    overrides = self._plan.request_with(0, 0, (recording, 0, 0), self._factor_values(place)).overrides
                    queue.add((number, recording), drive, self.settings, recording, overrides, measured.time_s,
                              tuple(self._noise))  # fmt: skip
            driven: dict[tuple[int, int], dict[str, Array] | str] = {}
            total = len(places) * len(self._measured)
            for outcome in queue.outcomes():
                driven[outcome.key] = outcome.result()
                self.runs += 1
                progress(FitProgress(rounds, len(driven), total, best))
            found = [self._answer([driven[number, each] for each in range(len(self._measured))])
                     for number in range(len(places))]  # fmt: skip
            if not isinstance(found[0], str):
                best = np.fmin(best, _misfit(found[0]))
            return found

        return answers

    def _answer(self, driven: Sequence[dict[str, Array] | str]) -> Answer:
        series = []
        for run, measured in zip(driven, self._measured, strict=True):
            if isinstance(run, str):
                return f"{measured.name}: {run}"
            for name, noise in self._noise.items():
                kept = np.isfinite(measured.channels[name])
                series.append((run[name][kept] - measured.channels[name][kept]) / noise)
        return series

    def check(self, slopes: list[Array]) -> None:
        """Check that every factor has a measured effect that differs from the effects of the others.

        Raises:
            StudyError: a factor has none.
        """
        source, keys = self._study.source, self._study.keys
        for place in without_effect(slopes):
            raise source.fail(
                ("factors", keys[place]),
                "has no effect above the noise on these channels in these recordings; leave it out",
            )
        if together := told_apart(slopes):
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
        known = intervals(found.after, found.slopes, free, stated=self._table.intervals == "noise")
        values, start = self._factor_values(found.place), self._factor_values(self.start)
        half_widths = (self._high - self._low) * known.half_widths
        parameters = tuple(
            Parameter(factor.key, values[factor.key], float(half), start[factor.key], factor.low, factor.high)
            for factor, half in zip(self._factors, half_widths, strict=True)
        )
        places = [(measured, name) for measured in self._measured for name in self._noise]
        compared = []
        for (measured, name), before, after, independent in zip(
            places, found.before, found.after, known.independent, strict=True
        ):
            kept = np.isfinite(measured.channels[name])
            compared.append(
                Compared(
                    measured.name, name, self._noise[name], measured.begin_s + measured.time_s[kept],
                    measured.channels[name][kept], before, after, independent,
                )
            )  # fmt: skip
        everywhere = {factor.key for factor in self._factors if not factor.maneuvers}
        overrides = [self._values.overrides(number, 0, values) for number in range(len(self._measured))]
        made = Fit(
            parameters, known.correlations, tuple(compared), self._table.intervals, known.freedom, _misfit(found.after),
            found.rounds, self.runs, found.settled,
            {key: value for key, value in overrides[0].items() if key in everywhere},
            {measured.name: own for measured, each in zip(self._measured, overrides, strict=True)
             if (own := {key: value for key, value in each.items() if key not in everywhere})},
        )  # fmt: skip
        return made._replace(notes=notes_of(made))


def drive(
    settings: Settings, recording: int, overrides: dict[str, Any], time_s: Array, channels: tuple[str, ...]
) -> dict[str, Array] | str:
    """Drive once; return channels at the times of a recording, or the reason of a failure.

    Args:
        settings: What all runs of the study share.
        recording: Number of its manoeuvre.
        overrides: Overrides of this run.
        time_s: Instants [s], shape (n,).
        channels: Names of the channels.
    """
    try:
        scenario = scenario_of(settings, recording, 0, overrides)
        run = run_scenario(scenario, settings.controllers[0][1], timestep_s=settings.study.timestep_s)
    except ActiveSteerError as error:
        return str(error)
    run = at_sensor(run)
    return {name: np.interp(time_s, run.time_s, run[name]) for name in channels}


def _start(factor: Factor, table: FitTable, scenario: Any, study: StudyFile) -> float:
    """Return the start of the search for a factor."""
    if factor.key in table.start:
        return table.start[factor.key]
    if factor.nominal:
        here: Any = 1.0 if factor.nominal == "times" else 0.0
    else:
        here = value_of(scenario, factor.key, study.controllers)
    if isinstance(here, (int, float)) and not isinstance(here, bool) and factor.low <= here <= factor.high:
        return float(here)
    return 0.5 * (factor.low + factor.high)


def _misfit(series: Sequence[Array]) -> float:
    return math.sqrt(float(np.mean(np.concatenate(series) ** 2)))

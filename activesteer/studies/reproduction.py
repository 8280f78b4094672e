"""Reproduction of the paper: five scenarios with three systems, and the check of its claims.

Runs are independent, so they are distributed over processes. Each process writes its own file, and the scorecard is
made from the files.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from activesteer.analysis.claims.judge import SCENARIOS, SYSTEMS
from activesteer.analysis.claims.scorecard import LITERATURE, PAPER, VEHICLE, Scorecard, read_setting, scorecard
from activesteer.analysis.figures import FORMATS, figure_2
from activesteer.analysis.figures import draw_all as draw_runs
from activesteer.analysis.report import write_report
from activesteer.controllers import SingleTrackParameters
from activesteer.core.conventions import Array
from activesteer.core.files import make_folder
from activesteer.errors import ActiveSteerError, ParameterError, RecordingError
from activesteer.plotting import save
from activesteer.recording import Recording, check_target
from activesteer.rigs.kc import kinematics_compliance, rear_camber_figure
from activesteer.scenario import FileOrTable, Scenario, resolve
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.simulation.runner import run_scenario
from activesteer.studies.engine.workers import Progress, TaskQueue, workers_for
from activesteer.studies.linear.identification import single_track_response
from activesteer.studies.linear.linearisation import linear_response, linearise


@dataclass
class Reproduction:
    """Result of a reproduction: recordings, failures and scorecard."""

    paths: dict[str, dict[str, Path]] = field(default_factory=dict)  # scenario -> system -> MCAP file
    # (scenario, system) -> reason why that run ended early; its file holds the rows up to then
    failures: dict[tuple[str, str], str] = field(default_factory=dict)
    # Claims of the scenarios whose three runs are complete
    scorecard: Scorecard = field(default_factory=lambda: scorecard([]))
    setting: str = LITERATURE

    @property
    def exit_status(self) -> int:
        """Exit status: 0 if all runs are complete and no claim fails unexpectedly, else 1."""
        return 1 if self.failures else self.scorecard.exit_status

    def recordings(self) -> dict[str, dict[str, Recording]]:
        """Return the recordings of the complete runs, by scenario and system."""
        return {
            scenario: {system: Recording.open(path) for system, path in systems.items()}
            for scenario, systems in self.paths.items()
            if all((scenario, system) not in self.failures for system in systems)
        }


def reproduce(
    folder: str | os.PathLike[str],
    vehicle: FileOrTable = "compact",
    *,
    setting: str = LITERATURE,
    jobs: int | None = None,
    progress: Progress = lambda *_: None,
) -> Reproduction:
    """Drive all five scenarios with all three systems and check the paper's claims.

    With more than one job, the runs are made in newly started processes: a script that calls this function needs `if
    __name__ == "__main__":`. The recordings are SCENARIO-SYSTEM.mcap in the folder. The setting is `literature` or
    `paper`, see `activesteer.analysis.claims.scorecard`. A failed run stops no other run; `failures` names it.
    """
    if setting == PAPER and vehicle != VEHICLE:
        raise ParameterError(
            f"is a setting of the {VEHICLE}; leave out --vehicle", key=f"--setting {PAPER}", value=vehicle
        )
    numbers = read_setting(setting)
    scenarios = {name: resolve(name, vehicle, numbers.overrides(name)) for name in SCENARIOS}
    target = make_folder(folder, ParameterError)
    paths = {name: {system: target / f"{name}-{system}.mcap" for system in SYSTEMS} for name in scenarios}
    result = Reproduction(paths, setting=setting)
    for systems in result.paths.values():
        for path in systems.values():
            check_target(path)
    total = len(scenarios) * len(SYSTEMS)
    for done, (name, system, problem) in enumerate(drive(scenarios, result.paths, jobs), 1):
        if problem:
            result.failures[name, system] = problem
        progress(f"{name} {system}" + (" FAILED" if problem else ""), done, total)
    claims = [claim for name, runs in result.recordings().items() for claim in SCENARIOS[name](runs)]
    result.scorecard = scorecard(claims, next(iter(scenarios.values())).car.name, setting=setting)
    return result


def drive(
    scenarios: Mapping[str, Scenario], paths: Mapping[str, Mapping[str, Path]], jobs: int | None
) -> Iterator[tuple[str, str, str]]:
    """Drive all runs; yield scenario, system, and the reason of an early end or an empty string, as each ends."""
    with workers_for(jobs) as workers:
        queue = TaskQueue(workers)
        for name, scenario in scenarios.items():
            queue.add((name, None), with_amplitude_found, scenario)
        for (name, system), value, error in queue.outcomes():
            if error is not None and not isinstance(error, ActiveSteerError):
                raise error
            if system is not None:
                yield name, system, str(error or value)
            elif error is not None:
                yield from ((name, other, str(error)) for other in paths[name])
            else:
                for other in paths[name]:
                    queue.add((name, other), _run, value, other, paths[name][other])


def _run(scenario: Scenario, system: str, path: Path) -> str:
    """Drive one run in a separate process, and return its error."""
    try:
        run_scenario(scenario, system, path=path)
    except ActiveSteerError as error:
        return "; ".join([str(error), *getattr(error, "__notes__", [])])
    return ""


def write_page(results: Iterable[Reproduction], folder: Path) -> Path | None:
    """Write a page with all runs, including incomplete ones, and return its path."""
    recordings: dict[str, Recording] = {}
    for result in results:
        for scenario, systems in result.paths.items():
            for system, path in systems.items():
                with suppress(RecordingError):
                    recording = Recording.open(path, recover=True)
                    # A complete file of a run that failed now is left from an earlier call.
                    if len(recording) and recording.metadata["complete"] is ((scenario, system) not in result.failures):
                        recordings[str(path)] = recording
    return write_report(recordings, folder / "report.html") if recordings else None


def draw_figures(recordings: Mapping[str, Mapping[str, Any]], folder: Path, vehicle: str) -> list[Path]:
    """Draw all figures whose runs are complete, and the figure of the suspension."""
    files = draw_runs(recordings, folder)
    camber = rear_camber_figure(kinematics_compliance(vehicle))
    files += [save(camber, folder / f"figure_01_rear_camber{ending}") for ending in FORMATS]
    if step_steers := recordings.get("step_steer"):
        run = step_steers["none"]
        models = models_beside(run)
        files += [figure_2(run, folder / f"figure_02_step_steer_models{ending}", models) for ending in FORMATS]
    return sorted(files)


def models_beside(run: Recording) -> dict[str, dict[str, Array]]:
    """Return the responses of linear models to the steering of a run: single track and full car."""
    maneuver, vehicle = run.metadata["maneuver"], run.metadata["vehicle"]
    single_track = SingleTrackParameters(**vehicle["single_track"])
    models = {"single-track model": single_track_response(run, single_track, vehicle["steering"]["ratio"])}
    if maneuver["road"]["grade"] == 0.0:
        linear = linearise(vehicle, maneuver["speed_mps"], {"road.mu": maneuver["road"]["mu"]})
        models["linear car"] = linear_response(run, linear)
    return models

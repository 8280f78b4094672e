"""One run from its inputs to a recording: `simulate`, and the same with a file written on the way."""

from __future__ import annotations

import dataclasses
import functools
import platform
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.analysis.metrics import metrics
from activesteer.controllers import find_controller
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.driver import find_driver
from activesteer.errors import ActiveSteerError, RecordingError
from activesteer.plugins import Plugin
from activesteer.recording import McapWriter, Recording, ScenePart
from activesteer.scenario import FileOrTable, Scenario, describe, resolve
from activesteer.signals import Channel
from activesteer.simulation.amplitude_search import amplitude
from activesteer.simulation.appearance import scene_of
from activesteer.simulation.recorder import Recorder, channels_of
from activesteer.simulation.simulation import Simulation
from activesteer.simulation.single_track_search import with_identified_single_track
from activesteer.theory.single_track import IDENTIFY
from activesteer.version import __version__

MAX_KEPT_VALUES: Final = 2**25
"""Values of a run that stay in memory beside its file, 256 MiB: some three minutes. Those of a longer run are read from
the file where they are needed, so that its memory does not grow with its length."""


def simulate(
    maneuver: FileOrTable,
    controller: Any = "none",
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    *,
    driver: Any = "standard",
    timestep_s: float = DEFAULT_TIMESTEP_S,
) -> Recording:
    """Drives a manoeuvre and returns what happened.

    Args:
        maneuver: Name, path, or table of a manoeuvre.
        controller: `none`, `ars`, `afs`, or a user's own: `my_file.py:MyController?gain=2`, a class, an object (the run
            works on a copy of it), or a function that makes one; see `activesteer.plugins.find`.
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key -> value, as `{"speed_kmh": 100, "road.mu": 0.4, "controllers.ars.limit_deg": 2}`.
        driver: `standard`, or a user's own in the same forms as a controller.
        timestep_s: Step of engine, driver and controller [s].

    Returns:
        The recording, with metrics.

    Raises:
        ActiveSteerError: an input is wrong, or the run failed; a failed run's recording is the error's `recording`.

    Example:
        >>> import activesteer
        >>> none, ars = (
        ...     activesteer.simulate("step_steer", controller, overrides={"speed_kmh": 100, "road.mu": 0.9})
        ...     for controller in ("none", "ars")
        ... )
        >>> ars.metrics["yaw_rate_overshoot"] < 0.5 * none.metrics["yaw_rate_overshoot"]
        True
        >>> none["yaw_rate_radps"].shape == none.time_s.shape
        True
    """
    controller, driver = find_controller(controller), find_driver(driver)
    scenario = prepared(resolve(maneuver, vehicle, overrides), timestep_s)
    return run_scenario(scenario, controller, driver=driver, timestep_s=timestep_s)


def prepared(scenario: Scenario, timestep_s: float = DEFAULT_TIMESTEP_S) -> Scenario:
    """The scenario with everything known that must be found by driving first: steering angle, single-track model.

    Args:
        scenario: A scenario.
        timestep_s: Step of the simulation [s].

    Returns:
        A scenario that can be run with any controller, always with the same input.

    Raises:
        ManeuverError: no amplitude gives what is asked for.
    """
    if scenario.car.config.single_track.source == IDENTIFY:
        scenario = with_identified_single_track(scenario, run_scenario)
    search = scenario.maneuver.search
    if search is None:
        return scenario
    return dataclasses.replace(scenario, maneuver=search.accept(amplitude(scenario, search, timestep_s)))


def run_scenario(
    scenario: Scenario,
    controller: Any = "none",
    *,
    driver: Any = "standard",
    path: Path | None = None,
    timestep_s: float = DEFAULT_TIMESTEP_S,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Runs a prepared scenario, and writes the recording while it runs where a path is given.

    Args:
        scenario: What to run; see `prepared`.
        controller: The controller, as in `simulate`.
        driver: The driver, likewise.
        path: MCAP file to write.
        timestep_s: Step of the simulation [s].
        progress: Called about every simulated second with the share that is done, 0 to 1.

    Returns:
        The recording, with metrics; where the run cannot be evaluated, as when it is too short, there are none and
        the metadata's `metrics_error` says why. That of a run too long for memory (`MAX_KEPT_VALUES`) reads from the
        file, which holds most channels to 32 bit.

    Raises:
        ActiveSteerError: the run failed. What was recorded until then is in the file, and in the error's `recording`.
    """
    controller, driver = find_controller(controller), find_driver(driver)
    simulation = Simulation(scenario, controller, timestep_s, driver=driver)
    context = RunContext.of(scenario, simulation, controller, driver)
    outcome: dict[str, Any] = {"complete": True}
    failure: ActiveSteerError | None = None
    # Whatever else goes wrong, the writer ends its file, marked as incomplete.
    with context.writer(path) if path is not None else nullcontext() as writer:
        keep = writer is None or simulation.steps * len(context.channels) <= MAX_KEPT_VALUES
        recorder = Recorder(simulation.vehicle, simulation.steps, writer, keep=keep)
        try:
            _drive(simulation, recorder, progress)
            recorder.flush()
        except ActiveSteerError as error:
            failure = error
            outcome = {"complete": False, "error": f"{type(error).__name__}: {error}"}
            recorder.flush(checked=False)
        except BaseException:
            recorder.flush(checked=False)
            raise
        recording = context.recording(recorder) if keep or writer is None else Recording.open(writer.flush())
        recording.metadata |= outcome
        if failure is None:
            outcome |= _evaluate(recording)
        if writer is not None:
            writer.close(outcome | {"metrics": recording.metrics})
    if failure is not None:
        failure.recording = recording
        saved = f"; what was recorded until then is in {path}" if path is not None else ""
        failure.add_note(f"controller {controller.name}: {len(recording)} steps were made{saved}")
        raise failure
    return recording


def _evaluate(recording: Recording) -> dict[str, str]:
    """Puts the metrics into a recording; returns what there is to say where that cannot be done."""
    try:
        recording.metrics.update(metrics(recording))
    except RecordingError as error:
        problem = {"metrics_error": str(error)}
        recording.metadata.update(problem)
        return problem
    return {}


class RunContext(NamedTuple):
    """What goes into a recording beside its rows: all that is needed to make the run again.

    Attributes:
        channels: The table of channels.
        body_names: Bodies whose poses are recorded.
        metadata: Resolved parameters, versions.
        files: Manoeuvre, vehicle, model and tyre files, and a user's own controller and driver.
        scene: What the car looks like.
    """

    channels: tuple[Channel, ...]
    body_names: tuple[str, ...]
    metadata: dict[str, Any]
    files: dict[str, bytes]
    scene: tuple[ScenePart, ...]

    @classmethod
    def of(cls, scenario: Scenario, simulation: Simulation, *plugins: Plugin) -> RunContext:
        """Collects it."""
        vehicle = simulation.vehicle
        metadata = {
            **{plugin.kind.word: plugin.name for plugin in plugins},
            **{f"{plugin.kind.word}_parameters": dict(plugin.parameters) for plugin in plugins if plugin.parameters},
            **describe(scenario),
            "car": vehicle.dimensions(),
            "timestep_s": vehicle.timestep_s,
            "versions": _versions(),
        }
        if (course := scenario.maneuver.course) is not None:
            metadata["course"] = course.to_table()
        files = scenario.files | {name: text for plugin in plugins for name, text in plugin.files.items()}
        return cls(channels_of(vehicle), vehicle.body_names, metadata, files, scene_of(vehicle.model))

    def recording(self, recorder: Recorder) -> Recording:
        """What a recorder that keeps all rows has taken."""
        time_s, values, poses = recorder.result()
        return Recording(
            self.channels, time_s, values, poses=poses, metadata=self.metadata, attachments=self.files, scene=self.scene
        )

    def writer(self, path: Path) -> McapWriter:
        """A file that rows can be written to.

        Raises:
            RecordingError: the file cannot be written.
        """
        return McapWriter(path, self.channels, self.body_names, self.metadata, self.files, self.scene)


def _drive(simulation: Simulation, recorder: Recorder, progress: Callable[[float], None] | None) -> None:
    if progress is None:
        simulation.run(recorder)
        return
    steps, chunk = simulation.steps, round(1.0 / simulation.vehicle.timestep_s)
    for done in range(0, steps, chunk):
        simulation.advance(min(chunk, steps - done), recorder)
        progress(min(1.0, (done + chunk) / steps))


@functools.cache
def _versions() -> dict[str, str]:
    found = {"activesteer": __version__, "python": platform.python_version(), "platform": platform.platform()}
    for package in ("mujoco", "numpy", "numba"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found

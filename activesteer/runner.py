"""One run from its inputs to a recording: `simulate`, and the same with a file written on the way."""

from __future__ import annotations

import dataclasses
import functools
import json
import platform
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.analysis.metrics import metrics
from activesteer.controllers.loading import user_file
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.errors import ActiveSteerError, ManeuverError, RecordingError
from activesteer.maneuver import StepSteer
from activesteer.recorder import Recorder, channels_of
from activesteer.recording import McapWriter, Primitive, Recording
from activesteer.scenario import FileOrTable, Scenario, describe, resolve
from activesteer.scene import primitives_of
from activesteer.signals import Channel
from activesteer.simulation import Simulation
from activesteer.version import __version__

_SEARCH_TOLERANCE: Final = 5e-4
"""Relative error of the lateral acceleration at which the search for the step's amplitude ends."""
_SEARCH_RUNS: Final = 8
_SEARCH_S: Final = 4.5
"""Time after the beginning of the step that a run of the search takes, however long the manoeuvre is [s]."""
_STEADY_S: Final = 0.5
"""Length of the end of such a run over which the steady state is taken [s]."""


def simulate(
    maneuver: FileOrTable,
    controller: str = "none",
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    *,
    timestep_s: float = DEFAULT_TIMESTEP_S,
) -> Recording:
    """Drives a manoeuvre and returns what happened.

    Args:
        maneuver: Name, path, or table of a manoeuvre.
        controller: `none`, `ars`, `afs`, or a user's own as `my_file.py:MyController`.
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key -> value, as `{"speed_kmh": 100, "road.mu": 0.4, "controllers.ars.limit_deg": 2}`.
        timestep_s: Step of engine, driver and controller [s].

    Returns:
        The recording, with metrics.

    Raises:
        ActiveSteerError: an input is wrong, or the run failed; a failed run's recording is the error's `recording`.
    """
    return run_scenario(prepared(resolve(maneuver, vehicle, overrides), timestep_s), controller, timestep_s=timestep_s)


def prepared(scenario: Scenario, timestep_s: float = DEFAULT_TIMESTEP_S) -> Scenario:
    """The scenario with everything known that a search must find first: the amplitude of a step steer.

    Args:
        scenario: A scenario.
        timestep_s: Step of the simulation [s].

    Returns:
        A scenario that can be run with any controller, always with the same input.

    Raises:
        ManeuverError: no amplitude gives what is asked for.
    """
    maneuver = scenario.maneuver
    if not isinstance(maneuver, StepSteer) or maneuver.steer.steering_wheel_rad is not None:
        return scenario
    described = json.dumps([describe(scenario), timestep_s], sort_keys=True, default=str)
    key = (described, scenario.mjcf, *sorted(scenario.files.items()))
    amplitude = _amplitudes.get(key)
    if amplitude is None:
        amplitude = _amplitudes[key] = _search_amplitude(scenario, maneuver, timestep_s)
    return _replace_maneuver(scenario, maneuver.with_amplitude(amplitude))


_amplitudes: dict[tuple[object, ...], float] = {}
"""Results of searches of this process, by everything that they depend on."""


def _replace_maneuver(scenario: Scenario, maneuver: StepSteer) -> Scenario:
    return Scenario(maneuver, scenario.car, scenario.mjcf, scenario.tyres, scenario.overrides, scenario.files)


def _search_amplitude(scenario: Scenario, maneuver: StepSteer, timestep_s: float) -> float:
    """Steering wheel angle that gives the wanted steady-state lateral acceleration without control [rad]."""
    wanted = maneuver.steer.lateral_acceleration_mps2
    assert wanted is not None  # StepSteer has checked it
    if wanted == 0.0:
        return 0.0
    maneuver = dataclasses.replace(maneuver, duration_s=maneuver.steer.start_s + _SEARCH_S)
    simulation = Simulation(scenario, "none", timestep_s)
    start = simulation.save_state()
    car, speed = scenario.car.single_track, max(maneuver.speed_mps, 1.0)
    wheelbase = car.cg_to_front_m + car.cg_to_rear_m
    # First guess: Ackermann angle with the understeer of a usual car, some 2.5 deg per g.
    angle = scenario.car.steering.ratio * wanted * (wheelbase / speed**2 + 0.0044)
    tried: list[tuple[float, float]] = []
    for _ in range(_SEARCH_RUNS):
        reached = _steady_acceleration(simulation, maneuver.with_amplitude(angle), start)
        if abs(reached / wanted - 1.0) < _SEARCH_TOLERANCE:
            return angle
        tried.append((angle, reached))
        if len(tried) == 1:
            angle *= wanted / reached if reached * wanted > 0.0 else 1.2
        else:
            (a0, r0), (a1, r1) = tried[-2:]
            if r1 == r0:
                break
            angle = a1 + (wanted - r1) * (a1 - a0) / (r1 - r0)
    best = min(tried, key=lambda pair: abs(pair[1] - wanted))
    msg = (
        f"{maneuver.name}: no steering wheel angle found that gives {wanted:.3g} m/s2 in the control-free car; the "
        f"closest was {np.degrees(best[0]):.1f} deg with {best[1]:.3g} m/s2: is the road too slippery "
        f"(road.mu {maneuver.road.mu:g})?"
    )
    raise ManeuverError(msg)


def _steady_acceleration(simulation: Simulation, maneuver: StepSteer, start: Any) -> float:
    simulation.restore_state(start)
    simulation.maneuver = maneuver
    recorder = Recorder(simulation.vehicle, simulation.steps)
    simulation.run(recorder)
    _, values, _ = recorder.result()
    column = [channel.name for channel in recorder.channels].index("ay_mps2")
    return float(values[-round(_STEADY_S / simulation.vehicle.timestep_s) :, column].mean())


def run_scenario(
    scenario: Scenario,
    controller: str = "none",
    *,
    path: Path | None = None,
    timestep_s: float = DEFAULT_TIMESTEP_S,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Runs a prepared scenario, and writes the recording while it runs where a path is given.

    Args:
        scenario: What to run; see `prepared`.
        controller: Name or file of the controller.
        path: MCAP file to write.
        timestep_s: Step of the simulation [s].
        progress: Called about every simulated second with the share that is done, 0 to 1.

    Returns:
        The recording, with metrics; where the run cannot be evaluated, as when it is too short, there are none and
        the metadata's `metrics_error` says why.

    Raises:
        ActiveSteerError: the run failed. What was recorded until then is in the file, and in the error's `recording`.
    """
    simulation = Simulation(scenario, controller, timestep_s)
    context = RunContext.of(scenario, controller, simulation)
    outcome: dict[str, Any] = {"complete": True}
    failure: ActiveSteerError | None = None
    # Whatever else goes wrong, the writer ends its file, marked as incomplete.
    with context.writer(path) if path is not None else nullcontext() as writer:
        recorder = Recorder(simulation.vehicle, simulation.steps, writer)
        try:
            _drive(simulation, recorder, progress)
        except ActiveSteerError as error:
            failure = error
            outcome = {"complete": False, "error": f"{type(error).__name__}: {error}"}
        except BaseException:
            recorder.flush()
            raise
        time_s, values, poses = recorder.result()
        recording = Recording(
            recorder.channels,
            time_s,
            values,
            poses=poses,
            metadata=context.metadata | outcome,
            attachments=context.files,
            scene=context.scene,
        )
        if failure is None:
            outcome |= _evaluate(recording)
        if writer is not None:
            writer.close(outcome | {"metrics": recording.metrics})
    if failure is not None:
        failure.recording = recording
        saved = f"; what was recorded until then is in {path}" if path is not None else ""
        failure.add_note(f"controller {controller}: {len(recording)} steps were made{saved}")
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
        files: Manoeuvre, vehicle, model and tyre files, and a user's own controller.
        scene: What the bodies look like.
    """

    channels: tuple[Channel, ...]
    body_names: tuple[str, ...]
    metadata: dict[str, Any]
    files: dict[str, bytes]
    scene: tuple[Primitive, ...]

    @classmethod
    def of(cls, scenario: Scenario, controller: str, simulation: Simulation) -> RunContext:
        """Collects it."""
        vehicle = simulation.vehicle
        metadata = {
            "controller": controller,
            **describe(scenario),
            "timestep_s": vehicle.timestep_s,
            "versions": _versions(),
        }
        files = scenario.files | user_file(controller)
        return cls(channels_of(vehicle), vehicle.body_names, metadata, files, primitives_of(vehicle.model))

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

"""Complete runs: `simulate`, and a run of a scenario into a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from activesteer.core.conventions import DEFAULT_TIMESTEP_S
from activesteer.errors import ActiveSteerError
from activesteer.recording import Recording
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, Scenario
from activesteer.simulation.simulation import Link, Simulation


def simulate(
    maneuver: FileOrTable,
    controller: Any = "none",
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    *,
    driver: Any = DEFAULT_DRIVER,
    timestep_s: float = DEFAULT_TIMESTEP_S,
) -> Recording:
    """Drive a manoeuvre and return its recording.

    Args:
        maneuver: Name, path, or table of a manoeuvre.
        controller: `none`, `ars`, `afs`, or your own: `my_file.py:MyController?gain=2`, a class, an object (the run
            uses a copy), or a function that returns one; see `activesteer.plugins.find`.
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key -> value, such as `{"speed_kmh": 100, "road.mu": 0.4, "controllers.ars.limit_deg": 2}`.
        driver: Name, path or table of a driver, or your own code in the same forms as a controller.
        timestep_s: Step of engine, driver and controller [s].

    Returns:
        The recording, with metrics.

    Raises:
        ActiveSteerError: an input is wrong, or the run failed; `recording` of the error then holds the recorded rows.

    Examples:
        >>> import activesteer
        >>> none, ars = (
        ...     activesteer.simulate("step_steer", controller, overrides={"speed_kmh": 100, "road.mu": 0.9})
        ...     for controller in ("none", "ars")
        ... )
        >>> abs(ars.metrics["sideslip_peak_rad"]) < 0.5 * abs(none.metrics["sideslip_peak_rad"])
        True
        >>> none["yaw_rate_radps"].shape == none.time_s.shape
        True
    """
    return _driven(Simulation(maneuver, controller, vehicle, overrides, driver=driver, timestep_s=timestep_s))


def run_scenario(
    scenario: Scenario,
    controller: Any = "none",
    *,
    path: Path | None = None,
    timestep_s: float = DEFAULT_TIMESTEP_S,
    progress: Callable[[float], None] | None = None,
    realtime: bool | float = False,
    link: Link | None = None,
) -> Recording:
    """Run a scenario, and record it to a file if a path is given.

    If a path is given, write the recording during the run.

    Args:
        scenario: Scenario to run. An amplitude that is not known yet is searched for first.
        controller: The controller, as in `simulate`.
        path: MCAP file to write.
        timestep_s: Step of the simulation [s].
        progress: Function that is called about every simulated second with the completed fraction, 0 to 1.
        realtime: Whether to pace the steps to the clock, and how fast; see `Simulation`.
        link: Link to another process that gives commands; see `Simulation`.

    Returns:
        The recording, with metrics. A run that cannot be evaluated, for example because it is too short, has no
        metrics, and its metadata `metrics_error` gives the reason. The recording of a run too long for memory
        (`MAX_KEPT_VALUES`) reads from the file, which holds most channels with 32 bits.

    Raises:
        ActiveSteerError: the run failed. The rows recorded until then are in the file, and in the error's `recording`.
    """
    simulation = Simulation(scenario, controller, timestep_s=timestep_s, realtime=realtime, link=link)
    return _driven(simulation, path, progress)


def _driven(
    simulation: Simulation, path: Path | None = None, progress: Callable[[float], None] | None = None
) -> Recording:
    loop, steps, failure = simulation.loop, simulation.steps, None
    chunk = steps if progress is None else round(1.0 / loop.vehicle.timestep_s)
    with simulation.recorded_to(path) if path is not None else nullcontext():
        try:
            while not simulation.done:
                simulation.advance(min(chunk, steps - loop.step_count))
                if progress is not None:
                    progress(loop.step_count / steps)
        except ActiveSteerError as error:
            failure = error
        recording = simulation.recording()
        simulation.end_file(recording)
    if failure is not None:
        failure.recording = recording
        saved = f"; what was recorded until then is in {path}" if path is not None else ""
        failure.add_note(
            f"controller {simulation.context.metadata['controller']}: {len(recording)} steps were made{saved}"
        )
        raise failure
    return recording

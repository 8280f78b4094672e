"""One run from its inputs to a recording: `simulate`, and the same with a file written on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.errors import ActiveSteerError
from activesteer.recording import Recording
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, Scenario
from activesteer.simulation.simulation import Simulation


def simulate(
    maneuver: FileOrTable,
    controller: Any = "none",
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    *,
    driver: Any = DEFAULT_DRIVER,
    timestep_s: float = DEFAULT_TIMESTEP_S,
) -> Recording:
    """Drives a manoeuvre and returns what happened.

    Args:
        maneuver: Name, path, or table of a manoeuvre.
        controller: `none`, `ars`, `afs`, or a user's own: `my_file.py:MyController?gain=2`, a class, an object (the run
            works on a copy of it), or a function that makes one; see `activesteer.plugins.find`.
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key -> value, as `{"speed_kmh": 100, "road.mu": 0.4, "controllers.ars.limit_deg": 2}`.
        driver: Name, path or table of a driver, or a user's own code in the same forms as a controller.
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
) -> Recording:
    """Runs a scenario, and writes the recording while it runs where a path is given.

    Args:
        scenario: What to run; an amplitude that has to be found by driving is found first, if it is not known yet.
        controller: The controller, as in `simulate`.
        path: MCAP file to write.
        timestep_s: Step of the simulation [s].
        progress: Called about every simulated second with the fraction that is done, 0 to 1.

    Returns:
        The recording, with metrics; where the run cannot be evaluated, as when it is too short, there are none and
        the metadata's `metrics_error` says why. That of a run too long for memory (`MAX_KEPT_VALUES`) reads from the
        file, which holds most channels to 32 bit.

    Raises:
        ActiveSteerError: the run failed. What was recorded until then is in the file, and in the error's `recording`.
    """
    return _driven(Simulation(scenario, controller, timestep_s=timestep_s), path, progress)


def _driven(
    simulation: Simulation, path: Path | None = None, progress: Callable[[float], None] | None = None
) -> Recording:
    failure: ActiveSteerError | None = None
    with simulation.recorded_to(path) if path is not None else nullcontext():
        try:
            _drive(simulation, progress)
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


def _drive(simulation: Simulation, progress: Callable[[float], None] | None) -> None:
    if progress is None:
        simulation.run()
        return
    steps, chunk = simulation.steps, round(1.0 / simulation.loop.vehicle.timestep_s)
    for done in range(0, steps, chunk):
        simulation.advance(min(chunk, steps - done))
        progress(min(1.0, (done + chunk) / steps))

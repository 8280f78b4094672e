"""Identification of a car by driving it: steady-state handling (ISO 4138) and the matching single-track model.

The tests are slowly increasing steer at 80 and 100 km/h and a circle of 100 m. Mass, yaw inertia and axle distances
come from the model at static ride. Axle stiffnesses and characteristic speed come from the two tests at constant speed,
from 0.5 to 2 m/s2. They are effective values for the driver's angle (steering wheel angle over overall ratio), so they
contain roll steer, compliance and the column.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.source import RecordingLike
from activesteer.analysis.tables import comparison
from activesteer.controllers import SingleTrackParameters
from activesteer.core.metric_table import metric
from activesteer.errors import RecordingError
from activesteer.scenario import FileOrTable, check_gains, check_parts, resolve
from activesteer.scenario.vehicle_file import write_values
from activesteer.simulation.preparation import (
    CONSTANT_SPEED_TESTS,
    body_of,
    fitted,
    handling_in,
)
from activesteer.simulation.runner import run_scenario
from activesteer.simulation.two_track_search import two_track_lines, two_track_of
from activesteer.studies.linear.linearisation import outputs_of
from activesteer.theory.single_track import SingleTrack, TwoTrackParameters

RADIUS_TEST: Final = "100 m"
"""The test on a circle."""


@dataclass(frozen=True)
class Identification:
    """Result of an identification: handling metrics and models.

    Attributes:
        vehicle: Name of the vehicle.
        tests: Name of a test -> steady-state handling in it.
        single_track: The matching single-track model.
        two_track: Load transfer, roll and pitch.
    """

    vehicle: str
    tests: dict[str, dict[str, float]]
    single_track: SingleTrackParameters
    two_track: TwoTrackParameters

    def table(self) -> str:
        """Return the result as lines: a column per test, then the keys of [single_track] and [two_track]."""
        shown = comparison(self.tests)
        for name, lines in self.lines().items():
            shown += "\n".join([f"\n\n[{name}]", *(f"{key} = {value}" for key, value in lines.items())])
        return shown

    def lines(self) -> dict[str, dict[str, str]]:
        """Return the tables of the vehicle file, with formatted values by key."""
        return {"single_track": single_track_lines(self.single_track), "two_track": two_track_lines(self.two_track)}

    def to_json(self) -> dict[str, Any]:
        """Return the metrics and both models as JSON values in SI units."""
        metrics = [
            {"name": name.rpartition("_")[0], "test": test, "value": value * unit.factor, "unit": unit.name}
            for test, handling in self.tests.items()
            for name, value in handling.items()
            if not math.isnan(value)
            for unit in (metric(name).unit,)
        ]
        known = {key: value for key, value in vars(self.single_track).items() if value is not None}
        return {"vehicle": self.vehicle, "metrics": metrics, "single_track": known, "two_track": vars(self.two_track)}


def identify(
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Identification:
    """Drive the tests and evaluate them.

    Args:
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key -> value, for the vehicle (`factors.mass`) or the road (`road.mu`).
        progress: Called with the name of every test before its drive.

    Returns:
        Steady-state handling, the single-track model and the two-track properties.

    Raises:
        ActiveSteerError: an input is wrong, or the car cannot drive the tests.
        ModelError: the car oversteers and has no characteristic speed.
    """
    scenarios = {
        name: resolve("slowly_increasing_steer", vehicle, {**(overrides or {}), "speed_kmh": speed})
        for name, speed in CONSTANT_SPEED_TESTS.items()
    }
    scenarios[RADIUS_TEST] = resolve("constant_radius", vehicle, overrides)
    check_parts(overrides or {}, scenarios[RADIUS_TEST], ("vehicle",))
    check_gains(overrides or {}, ())
    body = body_of(scenarios[RADIUS_TEST].car)
    tests = {}
    for name, scenario in scenarios.items():
        if progress is not None:
            progress(name)
        tests[name] = handling_in(scenario, body, run_scenario)
    found = fitted(body, [tests[name] for name in CONSTANT_SPEED_TESTS])
    if progress is not None:
        progress("roll and pitch")
    two_track = two_track_of(vehicle, run_scenario, overrides)
    return Identification(scenarios[RADIUS_TEST].car.name, tests, found, two_track)


def single_track_lines(parameters: SingleTrackParameters) -> dict[str, str]:
    """Return the entries of the table [single_track], rounded to the resolution of the tests."""
    p = parameters
    lines = {
        "mass_kg": f"{p.mass_kg:.1f}",
        "yaw_inertia_kgm2": f"{p.yaw_inertia_kgm2:.1f}",
        "cg_to_front_m": f"{p.cg_to_front_m:.4f}",
        "cg_to_rear_m": f"{p.cg_to_rear_m:.4f}",
        "front_stiffness_Nprad": f"{p.front_stiffness_Nprad:.0f}",
        "rear_stiffness_Nprad": f"{p.rear_stiffness_Nprad:.0f}",
    }
    if p.characteristic_speed_mps is not None:
        lines["characteristic_speed_kmh"] = f"{3.6 * p.characteristic_speed_mps:.2f}"
    return lines


def write_identified(vehicle_file: Path, result: Identification, command: str, date: str) -> None:
    """Write [single_track] and [two_track] into a vehicle file, and leave the rest unchanged.

    Args:
        vehicle_file: The file, as from `resources.find_vehicle`.
        result: Result of the identification.
        command: Command that identified it, kept in a comment.
        date: Date of the identification, such as 2026-11-21, kept in the comment.

    Raises:
        ParameterError: the file cannot be read or written.
    """
    for table, lines in result.lines().items():
        write_values(vehicle_file, table, lines, command, date)


def single_track_response(
    recording: RecordingLike, parameters: SingleTrackParameters, steering_ratio: float
) -> dict[str, NDArray[np.float64]]:
    """Return the response of the linear single-track model to the steering of a run, for comparison.

    Args:
        recording: A run at constant speed that begins straight ahead.
        parameters: The model.
        steering_ratio: Steering wheel angle over road-wheel angle [-].

    Returns:
        `yaw_rate_radps` and `sideslip_rad` over the time of the recording.

    Raises:
        RecordingError: the recording is too short, or a channel is missing.
    """
    time_s = np.asarray(recording.time_s, dtype=np.float64)
    if len(time_s) < 2:
        raise RecordingError(f"{len(time_s)} samples are too few for a response; at least 2 are needed")
    system = SingleTrack(parameters).state_space(float(np.mean(recording["speed_mps"])))
    front = np.asarray(recording["steering_wheel_rad"]) / steering_ratio + np.asarray(recording["superposition_rad"])
    return outputs_of(system, ("yaw_rate_radps", "sideslip_rad"), time_s, [front, recording["rear_steer_rad"]])

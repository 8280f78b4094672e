"""Identification of a car by driving it: steady-state handling after ISO 4138, and the single-track model that fits it.

Slowly increasing steer at 80 and at 100 km/h and a circle of 100 m. Mass, yaw inertia and axle distances are those of
the model at static ride. Axle stiffnesses and characteristic speed come from the two tests at constant speed and are
effective ones: they belong to the driver's angle (steering wheel over overall ratio), so they contain roll steer,
compliance and the column. They are those of the range from 0.5 to 2 m/s2.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.handling import Car, Handling, evaluate
from activesteer.analysis.source import RecordingLike
from activesteer.analysis.tables import comparison
from activesteer.controllers import SingleTrackParameters
from activesteer.errors import ModelError, RecordingError
from activesteer.quantities import metric_label
from activesteer.scenario import Car as CarFiles
from activesteer.scenario import FileOrTable, Scenario, resolve
from activesteer.scenario.vehicle_file import write_values
from activesteer.simulation.runner import run_scenario
from activesteer.theory.single_track import SingleTrack, characteristic_speed
from activesteer.vehicle.mass_properties import mass_properties

CONSTANT_SPEED_TESTS: Final = {"80 km/h": 80.0, "100 km/h": 100.0}
"""Tests at constant speed: name and speed [km/h]; the single-track model comes from these."""
RADIUS_TEST: Final = "100 m"
"""The test on a circle."""

_LINEAR: Final = {"duration_s": 12.0, "steer.end_deg": 50.0}
"""What a test at constant speed is cut to where only the linear range is wanted."""

CLASS_BANDS: Final = {
    "understeer_gradient_radpmps2": (2.2, 3.2, "computed for axle stiffnesses of 80-110 and 120-155 kN/rad"),
    "characteristic_speed_mps": (77.0, 93.0, "computed for axle stiffnesses of 80-110 and 120-155 kN/rad"),
    "roll_gradient_radpmps2": (3.9, 6.4, "computed for a roll stiffness of 95 to 60 kNm/rad"),
}
"""What is expected of a car of the compact class: metric -> low, high (in the unit shown), source."""


class Body(NamedTuple):
    """Mass properties of the whole car at static ride.

    Attributes:
        mass_kg: Mass [kg].
        yaw_inertia_kgm2: Inertia about the vertical axis through the centre of gravity [kg m2].
        cg_to_front_m: l_V [m].
        cg_to_rear_m: l_H [m].
    """

    mass_kg: float
    yaw_inertia_kgm2: float
    cg_to_front_m: float
    cg_to_rear_m: float


@dataclass(frozen=True)
class Identification:
    """What was found.

    Attributes:
        vehicle: Name of the vehicle.
        tests: Name of a test -> steady-state handling in it.
        single_track: The single-track model that fits.
    """

    vehicle: str
    tests: dict[str, Handling]
    single_track: SingleTrackParameters

    def table(self) -> str:
        """Both as text: a column per test, then the keys of [single_track]."""
        shown = comparison({name: handling._asdict() for name, handling in self.tests.items()})
        keys = "\n".join(f"{key} = {value}" for key, value in single_track_lines(self.single_track).items())
        return f"{shown}\n\n[single_track]\n{keys}"

    def to_json(self) -> str:
        """The same as JSON: `metrics` with name, test, value, unit, band, inside, source; `single_track` in SI."""
        metrics = []
        for test, handling in self.tests.items():
            for name, value in handling._asdict().items():
                if math.isnan(value):
                    continue
                _, unit, factor = metric_label(name)
                shown = value * factor
                low, high, source = CLASS_BANDS.get(name, (None, None, None))
                inside = None if low is None or high is None else low <= shown <= high
                band = None if low is None else [low, high]
                metrics.append(
                    {
                        "name": name.rpartition("_")[0], "test": test, "value": shown, "unit": unit, "band": band,
                        "inside": inside, "source": source,
                    }
                )  # fmt: skip
        known = {key: value for key, value in vars(self.single_track).items() if value is not None}
        return json.dumps({"vehicle": self.vehicle, "metrics": metrics, "single_track": known}, indent=2)


def identify(
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Identification:
    """Drives the tests and evaluates them.

    Args:
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key -> value, for the vehicle (`factors.mass`) or the road (`road.mu`).
        progress: Called with the name of every test before it is driven.

    Returns:
        Steady-state handling and the single-track model.

    Raises:
        ActiveSteerError: an input is wrong, or the car cannot be driven so.
        ModelError: the car oversteers; it has no characteristic speed.
    """
    scenarios = {
        name: resolve("slowly_increasing_steer", vehicle, {**(overrides or {}), "speed_kmh": speed})
        for name, speed in CONSTANT_SPEED_TESTS.items()
    }
    scenarios[RADIUS_TEST] = resolve("constant_radius", vehicle, overrides)
    body = _body(scenarios[RADIUS_TEST].car)
    tests = {}
    for name, scenario in scenarios.items():
        if progress is not None:
            progress(name)
        tests[name] = _drive(scenario, body)
    found = _single_track(body, [tests[name] for name in CONSTANT_SPEED_TESTS])
    return Identification(scenarios[RADIUS_TEST].car.name, tests, found)


def identify_single_track(
    vehicle: FileOrTable = "compact", overrides: Mapping[str, Any] | None = None
) -> SingleTrackParameters:
    """The single-track model alone, as `identify` finds it, from tests that end behind the linear range.

    Args:
        vehicle: Name, path, or table of a vehicle.
        overrides: As for `identify`.

    Raises:
        ActiveSteerError: as for `identify`.
    """
    scenarios = [
        resolve("slowly_increasing_steer", vehicle, {**(overrides or {}), **_LINEAR, "speed_kmh": speed})
        for speed in CONSTANT_SPEED_TESTS.values()
    ]
    body = _body(scenarios[0].car)
    return _single_track(body, [_drive(scenario, body) for scenario in scenarios])


def _body(car: CarFiles) -> Body:
    """Mass properties of the whole car, from the model at static ride."""
    vehicle = car.on()
    body = mass_properties(vehicle.model, vehicle.data)
    front, rear = (vehicle.data.xpos[vehicle.model.body(f"{axle}l_wheel").id, 0] for axle in "fr")
    x_m = body.cg_m[0]
    return Body(body.mass_kg, float(body.inertia_kgm2[2, 2]), float(front - x_m), float(x_m - rear))


def _drive(scenario: Scenario, body: Body) -> Handling:
    recording = run_scenario(scenario)
    return evaluate(recording, Car(body.cg_to_front_m, body.cg_to_rear_m, scenario.car.config.steering.ratio))


def _single_track(body: Body, tests: list[Handling]) -> SingleTrackParameters:
    """The model whose slip angles and understeer are the mean of those of the tests at constant speed."""
    wheelbase = body.cg_to_front_m + body.cg_to_rear_m

    def mean(name: str) -> float:
        return float(np.mean([getattr(test, name) for test in tests]))

    understeer, front, rear = (mean(f"{name}_gradient_radpmps2") for name in ("understeer", "front_slip", "rear_slip"))
    if understeer <= 0.0:
        msg = (
            f"the car oversteers: its understeer gradient is {math.degrees(understeer) * 9.81:.3g} deg/g, and the "
            "characteristic speed of the single-track model needs one above 0"
        )
        raise ModelError(msg)
    return SingleTrackParameters(
        mass_kg=body.mass_kg,
        yaw_inertia_kgm2=body.yaw_inertia_kgm2,
        cg_to_front_m=body.cg_to_front_m,
        cg_to_rear_m=body.cg_to_rear_m,
        front_stiffness_Nprad=body.mass_kg * body.cg_to_rear_m / wheelbase / front,
        rear_stiffness_Nprad=body.mass_kg * body.cg_to_front_m / wheelbase / rear,
        characteristic_speed_mps=characteristic_speed(wheelbase, understeer),
    )


def single_track_lines(parameters: SingleTrackParameters) -> dict[str, str]:
    """Keys and values of the table [single_track] in a vehicle file, rounded to what the tests can tell."""
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


def write_single_track(vehicle_file: Path, result: Identification, command: str, date: str) -> None:
    """Writes the single-track model into a vehicle file; everything else in it stays.

    Args:
        vehicle_file: The file, as from `resources.find_vehicle`.
        result: What was identified.
        command: Command that identified it, kept in a comment.
        date: Its date, as 2026-11-21, kept there too.

    Raises:
        ParameterError: the file cannot be read or written, or has no table [single_track].
    """
    write_values(vehicle_file, "single_track", single_track_lines(result.single_track), command, date)


def single_track_response(
    recording: RecordingLike, parameters: SingleTrackParameters, steering_ratio: float
) -> dict[str, NDArray[np.float64]]:
    """What the linear single-track model does with the steering of a run, to stand beside the multibody car.

    Args:
        recording: A run at constant speed that begins straight ahead.
        parameters: The model.
        steering_ratio: Steering wheel angle over road-wheel angle [-].

    Returns:
        `yaw_rate_radps` and `sideslip_rad` over the time of the recording.

    Raises:
        RecordingError: the recording is too short, or a channel is missing.
    """
    import control  # noqa: PLC0415 - takes longer to import than a run takes to start

    time_s = np.asarray(recording.time_s, dtype=np.float64)
    if len(time_s) < 2:
        msg = f"{len(time_s)} samples are too few for a response, at least 2 are needed"
        raise RecordingError(msg)
    system = SingleTrack(parameters).state_space(float(np.mean(recording["speed_mps"])))
    front = np.asarray(recording["steering_wheel_rad"]) / steering_ratio + np.asarray(recording["superposition_rad"])
    inputs = np.array([front, np.asarray(recording["rear_steer_rad"])], dtype=np.float64)
    outputs = control.forced_response(
        system,
        time_s,
        inputs,  # type: ignore[reportArgumentType] - the type is guessed from the default 0.0
        squeeze=False,
    ).outputs
    return {name: np.asarray(outputs[index]) for index, name in enumerate(("yaw_rate_radps", "sideslip_rad"))}

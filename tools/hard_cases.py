"""Drive controllers on the cars people drive: loads, slow actuators, other tyres, other cars.

    python tools/hard_cases.py [--controllers C,C...] [--vehicles V,V...] [--amplitudes DEG,DEG...]
                               [--cars NAME,NAME...] [--courses NAME,NAME...] [--direction left] [--seed 1] [--jobs N]

It prints one table with a row for each case and controller, with production sensors. FMVSS 126 allows 35 and 20 % of
the yaw rate 1.00 and 1.75 s after the sine with dwell, and asks for 1.83 m of displacement. To repeat a row, drive its
manoeuvre with the `--set` keys of `CARS` or `COURSES`.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from activesteer import simulate
from activesteer.errors import ModelError, SimulationDiverged
from activesteer.studies.engine.workers import in_parallel

CARS: Final[dict[str, dict[str, Any]]] = {
    "nominal": {},
    "payload_250": {"load.payload_kg": 250.0},
    "rear_stiffness_0.7": {"factors.rear_cornering_stiffness": 0.7},
    "rear_friction_0.8": {"factors.rear_tyre_friction": 0.8},
    "screw_3deg": {"rear_actuator.preset": "screw_3deg"},
    "screw_10deg": {"rear_actuator.preset": "screw_10deg"},
}
"""Car of the sine with dwell -> its departure from the vehicle file."""
AMPLITUDES_DEG: Final = (100.0, 140.0, 180.0, 220.0, 250.0, 270.0)
LIMITS: Final = (0.35, 0.20, 1.83)
"""Yaw-rate ratios after 1.00 and 1.75 s, and displacement [m]; FMVSS 126 S5.2."""
_SINE: Final = {"steer.start_s": 1.5, "duration_s": 5.6}


class Course(NamedTuple):
    """Manoeuvre, vehicle, changes, driver, and the metrics to print."""

    maneuver: str
    vehicle: str | None
    changes: dict[str, Any]
    driver: str
    metrics: tuple[str, ...]


_STOP: Final = ("stopping_distance_m", "lateral_deviation_max_m", "heading_end_rad")
COURSES: Final[dict[str, Course]] = {
    "mu_jump_loaded": Course(
        "mu_jump",
        "compact",
        {
            "factors.mass": 1.26,
            "factors.front_cornering_stiffness": 0.87,
            "road.mu": 0.98,
            "road.patches.0.mu": 0.40,
            "speed_kmh": 86.9,
            "duration_s": 9.58,
        },
        "expert",
        ("track_deviation_max_m", "sideslip_peak_abs_rad"),
    ),
    "sedan_step_50": Course(
        "step_steer",
        "sedan",
        {"steer.steering_wheel_deg": 50.0},
        "typical",
        ("ay_steady_mps2", "sideslip_peak_rad"),
    ),
    "tesla_lane_change_95": Course(
        "double_lane_change",
        "tesla_model_s",
        {"speed_kmh": 95.0},
        "typical",
        ("lane_overstep_m", "cones_hit", "sideslip_peak_abs_rad"),
    ),
    "split_nominal": Course("split_mu_braking", None, {}, "typical", _STOP),
    "split_light": Course("split_mu_braking", None, {"factors.mass": 0.9, "road.mu_right": 0.2}, "typical", _STOP),
    "split_payload": Course("split_mu_braking", None, {"load.payload_kg": 250.0}, "novice", _STOP),
    "split_slippery": Course(
        "split_mu_braking", None, {"road.mu_left": 0.7, "road.mu_right": 0.15, "duration_s": 14.0}, "typical", _STOP
    ),
}
"""Other cases. Without a vehicle they drive that of the command line."""


def sine_with_dwell(
    vehicle: str, controller: str, car: str, amplitude_deg: float, direction: str, seed: int
) -> dict[str, float] | str:
    """Return yaw-rate ratios [-], displacement [m] and peak of the sideslip angle [deg] of a sine with dwell.

    The values of a run that diverges are nan. If the car cannot carry the actuator, the error is returned.
    """
    changes = {**CARS[car], **_SINE, "steer.steering_wheel_deg": amplitude_deg, "steer.direction": direction}
    try:
        found = _metrics("sine_with_dwell", controller, vehicle, changes, "typical", seed)
    except ModelError as error:  # a rear suspension without a toe link for the screw
        return str(error)
    return {
        "ratio_1000ms": found.get("yaw_rate_after_1000ms_share", math.nan),
        "ratio_1750ms": found.get("yaw_rate_after_1750ms_share", math.nan),
        "displacement_m": found.get("lateral_displacement_by_ay_m", math.nan),
        "sideslip_deg": math.degrees(found.get("sideslip_peak_abs_rad", math.nan)),
    }


def passes(row: Mapping[str, float]) -> bool:
    """Return whether a sine with dwell keeps the limits, the displacement at all amplitudes."""
    ratio_1000ms, ratio_1750ms, displacement_m = LIMITS
    return (
        abs(row["ratio_1000ms"]) <= ratio_1000ms
        and abs(row["ratio_1750ms"]) <= ratio_1750ms
        and row["displacement_m"] >= displacement_m
    )


def course(vehicle: str, controller: str, name: str, seed: int) -> dict[str, float]:
    """Return the metrics of another case [SI], nan if the run diverges."""
    case = COURSES[name]
    found = _metrics(case.maneuver, controller, case.vehicle or vehicle, case.changes, case.driver, seed)
    return {metric: found.get(metric, math.nan) for metric in case.metrics}


def _metrics(
    maneuver: str, controller: str, vehicle: str, changes: dict[str, Any], driver: str, seed: int
) -> dict[str, float]:
    sensors = {"sensors.preset": "production", "sensors.seed": seed}
    try:
        run = simulate(maneuver, controller, vehicle, {**sensors, **changes}, driver=driver)
    except SimulationDiverged:
        return {}
    last = run.time_s > run.time_s[-1] - 1.0
    return {**run.metrics, "ay_steady_mps2": abs(float(run["ay_mps2"][last].mean()))}


def _names(text: str) -> list[str]:
    return [name for name in text.split(",") if name]


def main() -> None:
    """Run the tool."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--controllers", type=_names, default=["none", "lqr", "integrated", "esc"], metavar="C,C...")
    parser.add_argument("--vehicles", type=_names, default=["compact"], metavar="V,V...")
    parser.add_argument("--cars", type=_names, default=list(CARS), metavar="NAME,NAME...", help=", ".join(CARS))
    parser.add_argument(
        "--courses", type=_names, default=list(COURSES), metavar="NAME,NAME...", help=", ".join(COURSES)
    )
    parser.add_argument(
        "--amplitudes", type=_names, default=[f"{each:g}" for each in AMPLITUDES_DEG], metavar="DEG,..."
    )
    parser.add_argument("--direction", choices=("left", "right"), default="left")
    parser.add_argument("--seed", type=int, default=1, help="of the sensors")
    parser.add_argument("--jobs", type=int)
    asked = parser.parse_args()
    amplitudes_deg = [float(each) for each in asked.amplitudes]
    groups = [(vehicle, car, name) for vehicle in asked.vehicles for car in asked.cars for name in asked.controllers]
    sines = [
        (vehicle, name, car, amplitude_deg, asked.direction, asked.seed)
        for vehicle, car, name in groups
        for amplitude_deg in amplitudes_deg
    ]
    found = iter(in_parallel(sine_with_dwell, sines, asked.jobs))
    heads = " ".join(f"{amplitude_deg:14.0f}" for amplitude_deg in amplitudes_deg)
    print("sine with dwell: peak of the sideslip angle [deg], displacement [m]; * misses a limit of FMVSS 126")
    print(f"{'vehicle':17}{'car':20}{'controller':12}{'missed':>7}  {heads}  deg")
    for vehicle, car, name in groups:
        results = [next(found) for _ in amplitudes_deg]
        rows = [row for row in results if not isinstance(row, str)]
        if not rows:
            print(f"{vehicle:17}{car:20}{name:12}{'-':>7}  {results[0]}")
            continue
        cells = " ".join(
            f"{row['sideslip_deg']:7.1f} {row['displacement_m']:5.2f}{' ' if passes(row) else '*'}" for row in rows
        )
        missed = f"{sum(not passes(row) for row in rows)}/{len(rows)}"
        print(f"{vehicle:17}{car:20}{name:12}{missed:>7}  {cells}")
    others = [
        (vehicle, controller, name, asked.seed)
        for name in asked.courses
        for vehicle in (asked.vehicles if COURSES[name].vehicle is None else asked.vehicles[:1])
        for controller in asked.controllers
    ]
    for arguments, values in zip(others, in_parallel(course, others, asked.jobs), strict=True):
        vehicle, controller, name, _ = arguments
        cells = ", ".join(
            f"{metric.replace('_rad', '_deg')} {math.degrees(value) if metric.endswith('_rad') else value:.3g}"
            for metric, value in values.items()
        )
        print(f"{COURSES[name].vehicle or vehicle:17}{name:22}{controller:12}{cells}")


if __name__ == "__main__":
    main()

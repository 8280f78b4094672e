"""The tasks: a manoeuvre, what the agent commands, what its reward consists of, and when an episode ends."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from activesteer.studies.engine.factor_values import FactorValues
from activesteer.studies.engine.study_file import read_study

ACTUATORS: Final[dict[str, tuple[tuple[str, float, float], ...]]] = {
    "rear": (("rear_steer_demand_rad", -1.0, math.radians(3.0)),),
    "front": (("superposition_demand_rad", -1.0, math.radians(3.0)),),
    "brakes": tuple((f"{corner}_brake_torque_demand_Nm", 0.0, 1500.0) for corner in ("fl", "fr", "rl", "rr")),
}
"""Actuators of a controller -> number of the action, its lower bound, and the command at its upper bound 1."""
HANDS: Final = (
    ("steering_wheel_demand_rad", -1.0, 2.0 * math.pi),
    ("drive_torque_demand_Nm", -1.0, 2500.0),
    ("brake_pedal", 0.0, 1.0),
)
"""Actions of an agent who drives."""
_POPULATION: Final = "population"
"""Study whose ranges cars are drawn from."""


@dataclass(frozen=True)
class Task:
    """A task.

    Attributes:
        maneuver: Name of the manoeuvre.
        driver: `driver` or `agent`: who drives.
        actuators: Names from `ACTUATORS`.
        weights: Term of the reward -> weight; see `Episodes`.
        overrides: Overrides of manoeuvre and vehicle.
        most_offset_m: Distance from the path at which the course is left [m].
        most_sideslip_rad: Sideslip angle at which the car is lost [rad].
        radius_m: Radius of the circle to the left on which a drift is held [m]; 0 for the path of the manoeuvre.
        sideslip_rad: Sideslip angle of the drift [rad].
    """

    maneuver: str
    driver: str = "driver"
    actuators: tuple[str, ...] = ("rear",)
    weights: Mapping[str, float] = field(default_factory=dict)
    overrides: Mapping[str, Any] = field(default_factory=dict)
    most_offset_m: float = math.inf
    most_sideslip_rad: float = math.radians(30.0)
    radius_m: float = 0.0
    sideslip_rad: float = 0.0


_STEADY: Final = {"sideslip": 1.0, "effort": 0.02, "lost": 20.0}
TASKS: Final[dict[str, Task]] = {
    "SineWithDwell": Task("sine_with_dwell", weights={**_STEADY, "yaw_rate": 1.0}),
    "DoubleLaneChange": Task("double_lane_change", weights={**_STEADY, "offset": 1.0}, most_offset_m=4.0),
    "Slalom": Task("slalom", weights={**_STEADY, "offset": 1.0}, most_offset_m=4.0),
    "SplitMuBraking": Task(
        "split_mu_braking", weights={**_STEADY, "yaw_rate": 1.0, "offset": 1.0, "braking": 0.5}, most_offset_m=4.0
    ),
    "Drift": Task(
        "straight_line",
        driver="agent",
        actuators=(),
        weights={"drift": 1.0, "circle": 1.0, "effort": 0.02, "lost": 20.0},
        overrides={"powertrain.front_fraction": 0.0, "road.mu": 0.5, "speed_kmh": 36.0, "duration_s": 15.0},
        most_offset_m=15.0,
        most_sideslip_rad=math.radians(80.0),
        radius_m=25.0,
        sideslip_rad=-math.radians(25.0),
    ),
}
"""Name of an environment -> its task."""


def sampled_overrides(task: Task, vehicle: Any, count: int, seed: int) -> list[dict[str, Any]]:
    """Draw cars, roads and drivers from the ranges of the package's population.

    Args:
        task: The task.
        vehicle: The vehicle.
        count: Number of samples.
        seed: Seed; the samples of another seed are independent.

    Returns:
        Overrides of each sample, beside those of the task. What the task sets itself does not vary.
    """
    population = read_study(_POPULATION)
    keys = [key for key in population.keys if not key.startswith(("controllers.", "sensors."))]
    factors = [one for one in population.factors if one.key in keys and one.key not in task.overrides]
    if task.maneuver == "split_mu_braking":
        factors = [one for one in factors if one.key != "road.mu"]  # its sides have their own friction
    if task.driver == "agent":
        factors = [one for one in factors if not one.key.startswith("driver.")]
    table = {
        "maneuvers": [task.maneuver],
        "vehicles": [vehicle],
        "controllers": ["none"],
        "factors": {one.key: {k: v for k, v in one.to_table().items() if k != "maneuvers"} for one in factors
                    if not one.maneuvers or task.maneuver in one.maneuvers},
        "design": {"kind": "random", "samples": count},
        "seed": seed,
    }  # fmt: skip
    study = read_study(table)
    to_overrides, (samples, *_) = FactorValues(study), study.samples()
    return [dict(to_overrides.overrides(0, 0, samples[number])) for number in range(count)]


def bounds(parts: Sequence[tuple[str, float, float]]) -> tuple[Any, Any]:
    """Return lower and upper bounds of a space as float32."""
    return np.array([low for _, low, _ in parts], np.float32), np.array([high for _, _, high in parts], np.float32)

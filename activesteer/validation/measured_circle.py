"""Steering wheel angle of a car on a circle, compared with the angle measured on a real car.

No parameter of the car is fitted to the measurement. The uncertain values (mass, lateral acceleration, tyre, radius)
are sampled. Each effect that contributes to the angle is switched off alone, and each decision that the car's data
leave open is reversed alone, to show its influence (`circle_variations`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.stats import gaussian_kde

from activesteer.config import read_toml
from activesteer.conventions import Array
from activesteer.errors import ParameterError
from activesteer.files import is_file
from activesteer.resources import find_vehicle, models_dir
from activesteer.simulation.runner import simulate
from activesteer.studies.engine.task_queue import in_parallel
from activesteer.validation.circle_variations import DECISIONS, EFFECTS

DATA: Final = "measured_circle.json"
SAMPLES: Final = 200
"""Default number of samples of the uncertain values."""
TOLERANCE_DEG: Final = 5.0
TOLERANCE_FRACTION: Final = 0.03
"""Tolerance of the steering wheel angle in ISO 19364: 5 deg plus 3 % of the measured value."""
_SIGMAS: Final = {"mass": 0.01, "tyre": 0.05, "ay_mps2": 0.1, "radius": 0.01}
"""Standard deviations: mass 1 % (assumed), tyre side force 5 %, lateral acceleration 0.1 m/s2, radius 1 % (assumed)."""
_SEED: Final = 20121121
_ENTRY_S: Final = 3.0
_SETTLED_S: Final = 2.0
_RISE_MPS2: Final = 0.15


@dataclass(frozen=True)
class Variation:
    """A car with one change.

    Attributes:
        name: The change.
        angle_deg: Steering wheel angle with this change.
    """

    name: str
    angle_deg: float


@dataclass(frozen=True)
class CircleResult:
    """Result of the comparison with a measured circle.

    Attributes:
        vehicle: The car.
        measured_deg: Measured steering wheel angles, shape (n,).
        nominal_deg: Our angle with the mean of every uncertain value.
        samples_deg: Our angles of the samples, shape (m,).
        effects: The angles with one effect each switched off.
        decisions: The angles with one open decision each reversed.
    """

    vehicle: str
    measured_deg: Array
    nominal_deg: float
    samples_deg: Array
    effects: tuple[Variation, ...]
    decisions: tuple[Variation, ...]

    @property
    def difference_deg(self) -> float:
        """Mean of our samples minus mean of the measured angles."""
        return float(self.samples_deg.mean() - self.measured_deg.mean())

    @property
    def tolerance_deg(self) -> float:
        """Tolerance by ISO 19364."""
        return TOLERANCE_DEG + TOLERANCE_FRACTION * float(self.measured_deg.mean())

    @property
    def inside(self) -> bool:
        """True if the difference of the means is within the tolerance."""
        return abs(self.difference_deg) <= self.tolerance_deg

    @property
    def area_metric_deg(self) -> float:
        """Area between the two cumulative distributions (Ferson, Oberkampf, Ginzburg 2008)."""
        grid = np.sort(np.concatenate([self.samples_deg, self.measured_deg]))
        ours, theirs = (
            np.searchsorted(np.sort(values), grid[:-1], side="right") / len(values)
            for values in (self.samples_deg, self.measured_deg)
        )
        return float(np.sum(np.abs(ours - theirs) * np.diff(grid)))

    @property
    def overlap(self) -> float:
        """Common area of the two densities, 0 to 1."""
        both = np.concatenate([self.samples_deg, self.measured_deg])
        grid = np.linspace(both.min() - 10.0, both.max() + 10.0, 2000)
        least = np.minimum(gaussian_kde(self.samples_deg)(grid), gaussian_kde(self.measured_deg)(grid))
        return float(least.sum() * (grid[1] - grid[0]))

    def contribution_deg(self, effect: Variation) -> float:
        """Return the contribution of an effect to the nominal angle."""
        return self.nominal_deg - effect.angle_deg

    def as_table(self) -> dict[str, Any]:
        """Return the JSON values."""
        return {
            "vehicle": self.vehicle,
            "measured_deg": {
                "mean": self.measured_deg.mean(), "std": self.measured_deg.std(ddof=1), "n": len(self.measured_deg),
            },
            "ours_deg": {
                "nominal": self.nominal_deg, "mean": self.samples_deg.mean(), "std": self.samples_deg.std(ddof=1),
                "n": len(self.samples_deg),
            },
            "difference_deg": self.difference_deg, "tolerance_deg": self.tolerance_deg, "inside": self.inside,
            "area_metric_deg": self.area_metric_deg, "overlap": self.overlap,
            "effects": {effect.name: self.contribution_deg(effect) for effect in self.effects},
            "decisions": {decision.name: decision.angle_deg for decision in self.decisions},
        }  # fmt: skip

    def text(self) -> str:
        """Return the text that the command prints."""
        ours, theirs = self.samples_deg, self.measured_deg
        lines = [
            f"{self.vehicle}: steering wheel angle on the measured circle",
            f"  measured   {theirs.mean():7.1f} +- {theirs.std(ddof=1):.1f} deg  ({len(theirs)} values)",
            f"  predicted  {ours.mean():7.1f} +- {ours.std(ddof=1):.1f} deg  ({len(ours)} samples, nominal "
            f"{self.nominal_deg:.1f})",
            f"  difference {self.difference_deg:+7.1f} deg, tolerance of ISO 19364 {self.tolerance_deg:.1f} deg: "
            + ("inside" if self.inside else "OUTSIDE"),
            f"  area metric {self.area_metric_deg:.1f} deg, overlap of the distributions {100.0 * self.overlap:.0f} %",
            "contribution of each effect, switched off alone:",
            *(f"  {effect.name:66} {self.contribution_deg(effect):+7.1f} deg" for effect in self.effects),
            "angle with each open decision reversed, one at a time:",
            *(f"  {decision.name:66} {decision.angle_deg:7.1f} deg" for decision in self.decisions),
        ]
        return "\n".join(lines)


def is_measured(name: str) -> bool:
    """Return whether the package contains a measured circle of a car."""
    return is_file(models_dir() / "reference" / name / DATA)


def validate_circle(
    name: str,
    samples: int = SAMPLES,
    jobs: int | None = None,
    *,
    scheduler: str | None = None,
    progress: Callable[[float, str], None] = lambda _share, _what: None,
) -> CircleResult:
    """Drive a car on the circle on which it was measured.

    Args:
        name: The car, and its folder in `models/reference`.
        samples: Number of samples of the uncertain values.
        jobs: Number of processes; by default the number of processors.
        scheduler: Address of a Dask scheduler.
        progress: Called with the finished fraction and the name of the step.

    Returns:
        The comparison.

    Raises:
        ParameterError: fewer than 10 samples.
        ActiveSteerError: a run failed.
    """
    if samples < 10:
        raise ParameterError(
            f"{samples} samples make no distribution; at least 10 are needed", key="samples", value=samples
        )
    data = json.loads((models_dir() / "reference" / name / DATA).read_text(encoding="utf-8"))
    ay, radius = float(data["ay_mean_mps2"]), float(data["radius_m"])
    table, _ = read_toml(find_vehicle(name))
    table["name"] = name
    draws = np.random.default_rng(_SEED).normal(size=(samples, 4))
    variations = [*EFFECTS.items(), *DECISIONS.items()]
    calls = [(changed, radius, ay, 1.0, 1.0) for changed in (table, *(change(table) for _, change in variations))]
    calls += [
        (table, radius * (1.0 + _SIGMAS["radius"] * r), ay + _SIGMAS["ay_mps2"] * a, 1.0 + _SIGMAS["mass"] * m,
         1.0 + _SIGMAS["tyre"] * t)
        for m, t, a, r in draws.tolist()
    ]  # fmt: skip
    angles = in_parallel(
        steering_wheel_deg, calls, jobs, lambda _place, done: progress(done / len(calls), "circle"), scheduler=scheduler
    )
    varied, sampled = angles[1 : 1 + len(variations)], np.array(angles[1 + len(variations) :])
    found = [Variation(what, angle) for (what, _), angle in zip(variations, varied, strict=True)]
    effects, decisions = tuple(found[: len(EFFECTS)]), tuple(found[len(EFFECTS) :])
    return CircleResult(name, np.array(data["steering_wheel_deg"]), angles[0], sampled, effects, decisions)


def steering_wheel_deg(table: Mapping[str, Any], radius_m: float, ay_mps2: float, mass: float, tyre: float) -> float:
    """Return the steering wheel angle that holds a laterally symmetric car on a circle.

    Args:
        table: The vehicle file.
        radius_m: Radius [m].
        ay_mps2: Lateral acceleration [m/s2].
        mass: Factor on the mass.
        tyre: Factor on the tyres' side force: on friction and cornering stiffness.

    Returns:
        The angle [deg].
    """
    slow, fast = (math.sqrt((ay_mps2 + beside) * radius_m) for beside in (-0.4, 0.2))
    overrides = {
        "circle.radius_m": radius_m,
        "circle.entry_s": _ENTRY_S,
        "circle.acceleration_mps2": _RISE_MPS2,
        "speed_mps": slow,
        "circle.end_speed_mps": fast,
        "duration_s": _ENTRY_S + (fast - slow) / _RISE_MPS2 + 0.5,
        "factors.mass": mass,
        "factors.tyre_friction": tyre,
        "factors.tyre_cornering_stiffness": tyre,
    }
    run = simulate("constant_radius", "none", dict(table), overrides)
    late = run.time_s > _ENTRY_S + _SETTLED_S
    # The speed range is narrow, so the angle over lateral acceleration is a straight line.
    line = np.polyfit(np.abs(run["ay_mps2"][late]), np.degrees(np.abs(run["steering_wheel_rad"][late])), 1)
    return float(np.polyval(line, ay_mps2))

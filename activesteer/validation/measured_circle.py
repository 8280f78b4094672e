"""Steering wheel angle of a car on a circle, compared with the angle measured on a real car.

No parameter of the car is fitted to the measurement. The main prediction uses measured kinematics and compliance
only; a second one adds compliances that are assumed. What varies from lap to lap (mass, lateral acceleration, radius)
is sampled, and what has one unknown value spans a probability box (`circle_box`). Each effect that contributes to the
angle is switched off alone, and each decision that the car's data leave open is reversed alone, to show its influence
(`circle_variations`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.stats import gaussian_kde

from activesteer.config import read_toml
from activesteer.conventions import Array
from activesteer.errors import ParameterError
from activesteer.files import is_file
from activesteer.resources import find_vehicle, models_dir
from activesteer.simulation.simulation import Simulation
from activesteer.studies.engine.task_queue import in_parallel
from activesteer.validation.circle_box import Box, Case, Step, at_end, intervals, measured_only, waterfall
from activesteer.validation.circle_variations import DECISIONS, EFFECTS

DATA: Final = "measured_circle.json"
SAMPLES: Final = 200
"""Default number of samples of the uncertain values."""
TOLERANCE_DEG: Final = 5.0
TOLERANCE_FRACTION: Final = 0.03
"""Tolerance of the steering wheel angle in ISO 19364: 5 deg plus 3 % of the measured value."""
_SIGMAS: Final = {"mass": 0.01, "ay_mps2": 0.1, "radius": 0.01}
"""Standard deviations from lap to lap: mass 1 % (assumed), lateral acceleration 0.1 m/s2, radius 1 % (assumed)."""
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
        nominal_deg: Main prediction: our angle with measured kinematics and compliance only.
        samples_deg: The same for the samples of mass, lateral acceleration and radius, shape (m,).
        assumed_deg: Second prediction: our angle with the assumed compliances too.
        effects: The angles of the second prediction with one effect each switched off.
        decisions: The angles of the second prediction with one open decision each reversed.
        steps: The waterfall from geometry to the second prediction.
        box: The probability box; None if it was not driven.
    """

    vehicle: str
    measured_deg: Array
    nominal_deg: float
    samples_deg: Array
    assumed_deg: float
    effects: tuple[Variation, ...] = ()
    decisions: tuple[Variation, ...] = ()
    steps: tuple[Step, ...] = ()
    box: Box | None = None

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
        """Return the contribution of an effect to the angle of the second prediction."""
        return self.assumed_deg - effect.angle_deg

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
            "with_assumptions_deg": self.assumed_deg,
            "box": None if self.box is None else self.box.as_table(self.measured_deg),
            "waterfall": [step._asdict() for step in self.steps],
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
            f"{self.nominal_deg:.1f}): measured kinematics and compliance only",
            f"             {self.assumed_deg:7.1f} deg with the assumed compliances too",
            f"  difference {self.difference_deg:+7.1f} deg, tolerance of ISO 19364 {self.tolerance_deg:.1f} deg: "
            + ("inside" if self.inside else "OUTSIDE"),
            f"  area metric {self.area_metric_deg:.1f} deg, overlap of the distributions {100.0 * self.overlap:.0f} %",
            *self._box_lines(),
            "contribution of each effect to the second prediction, switched off alone:",
            *(f"  {effect.name:66} {self.contribution_deg(effect):+7.1f} deg" for effect in self.effects),
            "angle with each open decision reversed, one at a time:",
            *(f"  {decision.name:66} {decision.angle_deg:7.1f} deg" for decision in self.decisions),
        ]
        return "\n".join(lines)

    def _box_lines(self) -> list[str]:
        if self.box is None:
            return []
        box, count = self.box, len(self.measured_deg)
        known = [f"  {name:48} {low:7.1f} to {high:5.1f} deg  ({source})" for name, source, low, high in box.ends_deg]
        return [
            f"probability box {box.low_deg:.1f} to {box.high_deg:.1f} deg, {box.high_deg - box.low_deg:.1f} deg wide: "
            f"{box.inside(self.measured_deg)} of {count} measured angles inside",
            "second prediction with the ends of each interval alone:",
            *known,
            "from geometry to the second prediction:",
            *(f"  {step.name:48} {step.angle_deg:7.1f} deg  ({step.kind})" for step in self.steps),
        ]


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
    measured = np.array(data["steering_wheel_deg"])
    table, _ = read_toml(find_vehicle(name))
    assumed = Case({**table, "name": name}, float(data["radius_m"]), float(data["ay_mean_mps2"]))
    main = measured_only(assumed)
    roll = _on_circle(main, "roll_rad")
    known = intervals(roll)
    draws = np.random.default_rng(_SEED).normal(size=(samples, 3))
    variations = [*EFFECTS.items(), *DECISIONS.items()]
    falls = waterfall(assumed)
    parts = {
        "nominal": [main, assumed],
        "varied": [assumed._replace(table=change(assumed.table)) for _, change in variations],
        "falls": [case for _, _, case in falls],
        "ends": [end(assumed) for interval in known for end in (interval.low, interval.high)],
        "samples": [_drawn(main, draw) for draw in draws],
        "lower": [at_end(_drawn(assumed, draw), known, high=False) for draw in draws[::2]],
        "upper": [at_end(_drawn(assumed, draw), known, high=True) for draw in draws[::2]],
    }
    calls = [(case,) for cases in parts.values() for case in cases]
    driven = iter(
        in_parallel(
            steering_wheel_deg, calls, jobs, lambda _, done: progress(done / len(calls), "circle"), scheduler=scheduler
        )
    )
    angles = {part: [next(driven) for _ in cases] for part, cases in parts.items()}
    found = tuple(Variation(what, angle) for (what, _), angle in zip(variations, angles["varied"], strict=True))
    ends = zip(known, angles["ends"][::2], angles["ends"][1::2], strict=True)
    return CircleResult(
        name, measured, angles["nominal"][0], np.array(angles["samples"]), angles["nominal"][1],
        found[: len(EFFECTS)], found[len(EFFECTS) :],
        tuple(Step(what, kind, angle) for (what, kind, _), angle in zip(falls, angles["falls"], strict=True)),
        Box(
            tuple((interval.name, interval.source, low, high) for interval, low, high in ends),
            np.sort(angles["lower"]), np.sort(angles["upper"]),
        ),
    )  # fmt: skip


def _drawn(case: Case, draw: Array) -> Case:
    """Return a case of another lap: mass, lateral acceleration and radius from standard normal numbers."""
    mass, ay, radius = draw.tolist()
    return case._replace(
        mass=case.mass * (1.0 + _SIGMAS["mass"] * mass),
        ay_mps2=case.ay_mps2 + _SIGMAS["ay_mps2"] * ay,
        radius_m=case.radius_m * (1.0 + _SIGMAS["radius"] * radius),
    )


def steering_wheel_deg(case: Case) -> float:
    """Return the steering wheel angle that holds a laterally symmetric car on a circle [deg]."""
    # With a stiff column, the rack shows the angle.
    return math.degrees(_on_circle(case, "rack_m" if case.stiff_column else "steering_wheel_rad")) + case.zero_deg


def _on_circle(case: Case, channel: str) -> float:
    """Return the size of a channel at the lateral acceleration of the circle, a rack as its steering wheel angle."""
    simulation, late = _driven(case)
    run = simulation.recording()
    values = run[channel]
    if channel == "rack_m":
        rack_m = simulation.loop.vehicle.rack_per_steering_wheel_m
        assert rack_m is not None
        values = values / rack_m
    # The speed range is narrow, so a channel over lateral acceleration is a straight line.
    line = np.polyfit(np.abs(run["ay_mps2"][late]), np.abs(values[late]), 1)
    return float(np.polyval(line, case.ay_mps2))


def _driven(case: Case) -> tuple[Simulation, slice]:
    """Return a run through the lateral acceleration of the circle, and its rows after the entry."""
    slow, fast = (math.sqrt((case.ay_mps2 + beside) * case.radius_m) for beside in (-0.4, 0.2))
    overrides = {
        "circle.radius_m": case.radius_m,
        "circle.entry_s": _ENTRY_S,
        "circle.acceleration_mps2": _RISE_MPS2,
        "speed_mps": slow,
        "circle.end_speed_mps": fast,
        "duration_s": _ENTRY_S + (fast - slow) / _RISE_MPS2 + 0.5,
        "factors.mass": case.mass,
        "factors.tyre_friction": case.tyre,
        "factors.tyre_cornering_stiffness": case.tyre,
    }
    simulation = Simulation("constant_radius", "none", dict(case.table), overrides)
    simulation.run()
    return simulation, slice(round((_ENTRY_S + _SETTLED_S) / simulation.loop.vehicle.timestep_s), None)

"""Steering wheel angle of a car on a measured circle: prediction, effects, and a probability box.

No parameter of the car is fitted. Values that vary from lap to lap are sampled. Values with one unknown true value (a
reading of the source, an assumption) are intervals. The box is the pair of distributions at the ends of all intervals;
every distribution that the intervals allow lies between them (Oberkampf and Roy, Verification and Validation in
Scientific Computing, 2010, section 13.4). The ends of each interval are driven alone to find which end has the smaller
angle; the angle is taken to be monotonic in each.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.stats import gaussian_kde, wasserstein_distance

from activesteer.core.conventions import GRAVITY_MPS2, Array
from activesteer.errors import ParameterError
from activesteer.measured.circle_changes import Case, ChangeTable
from activesteer.measured.folder_file import STEERING, MeasuredFile
from activesteer.simulation.simulation import Simulation
from activesteer.studies.engine.workers import in_parallel

SAMPLES: Final = 200
"""Default number of samples of the values that vary from lap to lap."""
_QUANTILES: Final = (2.5, 97.5)
_SEED: Final = 20121121
_ENTRY_S: Final = 3.0
_SETTLED_S: Final = 2.0
_RISE_MPS2: Final = 0.15


@dataclass(frozen=True)
class CircleValidation:
    """Result of the comparison with a measured circle; angles of the steering wheel [deg]."""

    file: MeasuredFile  # the checked file
    measured_deg: Array  # measured angles, shape (n,)
    nominal_deg: float  # main prediction, without the effects of assumed steps
    assumed_deg: float  # second prediction, with all effects
    effects: dict[str, float]  # effect -> second prediction without it
    decisions: dict[str, float]  # open decision -> second prediction with it reversed
    # name, origin and angle of each step from geometry to the second prediction
    steps: tuple[tuple[str, str, float], ...]
    # name and source of each interval, and the second prediction at its ends, the smaller angle first
    ends: tuple[tuple[str, str, float, float], ...]
    samples_deg: Array  # main prediction for samples of the values that vary from lap to lap, shape (m,)
    # second prediction for samples, with all intervals at the ends with the smaller angles, shape (m/2,)
    lower_deg: Array
    upper_deg: Array  # the same at the other ends

    @property
    def difference_deg(self) -> float:
        """Mean of our samples minus mean of the measured angles."""
        return float(self.samples_deg.mean() - self.measured_deg.mean())

    @property
    def tolerance_deg(self) -> float:
        """Tolerance of the mean."""
        return math.degrees(self.file.tolerances[STEERING].width(np.radians(self.measured_deg.mean())))

    @property
    def inside(self) -> bool:
        """True if the difference of the means is within the tolerance."""
        return abs(self.difference_deg) <= self.tolerance_deg

    @property
    def area_metric_deg(self) -> float:
        """Area between the two cumulative distributions (Ferson, Oberkampf, Ginzburg 2008)."""
        return float(wasserstein_distance(self.samples_deg, self.measured_deg))

    @property
    def overlap(self) -> float:
        """Common area of the two densities, 0 to 1."""
        both = np.concatenate([self.samples_deg, self.measured_deg])
        grid = np.linspace(both.min() - 10.0, both.max() + 10.0, 2000)
        least = np.minimum(gaussian_kde(self.samples_deg)(grid), gaussian_kde(self.measured_deg)(grid))
        return float(least.sum() * (grid[1] - grid[0]))

    @property
    def low_deg(self) -> float:
        """Lower end of the box: 2.5 % quantile of the lower distribution."""
        return float(np.percentile(self.lower_deg, _QUANTILES[0]))

    @property
    def high_deg(self) -> float:
        """Upper end of the box: 97.5 % quantile of the upper distribution."""
        return float(np.percentile(self.upper_deg, _QUANTILES[1]))

    @property
    def measured_inside(self) -> int:
        """Number of measured angles in the box."""
        return int(((self.measured_deg >= self.low_deg) & (self.measured_deg <= self.high_deg)).sum())

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""

        def spread(values: Array) -> dict[str, Any]:
            return {"mean": values.mean(), "std": values.std(ddof=1), "n": len(values)}

        box = {
            "low_deg": self.low_deg, "high_deg": self.high_deg, "width_deg": self.high_deg - self.low_deg,
            "measured_deg": float(self.measured_deg.mean()), "measured_inside": self.measured_inside,
            "measured_values": len(self.measured_deg),
            "intervals": [dict(zip(("name", "source", "low_deg", "high_deg"), end, strict=True)) for end in self.ends],
        } if self.ends else None  # fmt: skip
        return {
            "vehicle": self.file.table.vehicle, "title": self.file.table.title, "inside": self.inside,
            "measured_deg": spread(self.measured_deg),
            "ours_deg": {"nominal": self.nominal_deg, **spread(self.samples_deg)},
            "with_assumptions_deg": self.assumed_deg, "box": box,
            "waterfall": [dict(zip(("name", "kind", "angle_deg"), step, strict=True)) for step in self.steps],
            "difference_deg": self.difference_deg, "tolerance_deg": self.tolerance_deg,
            "area_metric_deg": self.area_metric_deg, "overlap": self.overlap,
            "effects": {name: self.assumed_deg - angle for name, angle in self.effects.items()},
            "decisions": self.decisions, "assumptions": list(self.file.table.assumptions),
        }  # fmt: skip


def validate_circle(
    file: MeasuredFile,
    samples: int = SAMPLES,
    jobs: int | None = None,
    *,
    scheduler: str | None = None,
    progress: Callable[[float, str], None] = lambda _share, _what: None,
) -> CircleValidation:
    """Drive a car on the circle on which it was measured."""
    if samples < 10:
        raise ParameterError(
            f"{samples} samples make no distribution; at least 10 are needed", key="samples", value=samples
        )
    table, circle = file.table, file.table.circle
    assert circle is not None
    full = file.case
    falls = [file.without(full, [name for step in table.steps[: place : -1] for name in step.adds])
             for place in range(len(table.steps))]  # fmt: skip
    main = next((case for case, step in zip(falls[::-1], table.steps[::-1], strict=True) if step.origin != "assumed"),
                full)  # fmt: skip
    per_ay = _on_circle(main, circle.ay_mps2, "roll_rad") / circle.ay_mps2
    ends = [[file.changed(full, side) for side in (each.low, each.high)] for each in table.intervals.values()]
    parts = {
        "nominal": [main, full], "falls": falls, "ends": [case for pair in ends for case in pair],
        "effects": [file.without(full, [name]) for name in table.effects],
        "decisions": [file.changed(full, changes) for changes in table.decisions.values()],
    }  # fmt: skip

    def drive(cases: dict[str, list[Case]], begin: float, end: float) -> dict[str, list[float]]:
        calls = [(case, per_ay) for each in cases.values() for case in each]

        def report(_: int, done: int) -> None:
            progress(begin + (end - begin) * done / len(calls), "circle")

        driven = iter(in_parallel(steering_wheel_deg, calls, jobs, report, scheduler=scheduler))
        return {part: [next(driven) for _ in each] for part, each in cases.items()}

    angles = drive(parts, 0.0, 0.15)
    nominal, assumed = angles["nominal"]
    pairs = list(zip(angles["ends"][::2], angles["ends"][1::2], strict=True))
    sides: dict[str, list[ChangeTable]] = {"lower": [], "upper": []}
    for each, (low, high) in zip(table.intervals.values(), pairs, strict=True):
        smaller, larger = (each.low, each.high) if low <= high else (each.high, each.low)
        sides["lower"] += smaller
        sides["upper"] += larger
    draws = np.random.default_rng(_SEED).normal(size=(samples, len(circle.spread)))
    box = {part: [file.changed(file.drawn(full, draw), side) for draw in draws[::2] if pairs]
           for part, side in sides.items()}  # fmt: skip
    angles |= drive({"samples": [file.drawn(main, draw) for draw in draws], **box}, 0.15, 1.0)
    return CircleValidation(
        file, np.degrees(circle.steering_wheel_rad), nominal, assumed,
        dict(zip(table.effects, angles["effects"], strict=True)),
        dict(zip(table.decisions, angles["decisions"], strict=True)),
        tuple((step.name, step.origin, angle) for step, angle in zip(table.steps, angles["falls"], strict=True)),
        tuple((name, each.source, min(pair), max(pair))
              for (name, each), pair in zip(table.intervals.items(), pairs, strict=True)),
        np.array(angles["samples"]), np.array(angles["lower"]), np.array(angles["upper"]),
    )  # fmt: skip


def steering_wheel_deg(case: Case, roll_per_ay: float = 0.0) -> float:
    """Return the steering wheel angle that holds a laterally symmetric car on a circle [deg]."""
    per_a, ay_mps2 = roll_per_ay * case.circle["body_roll"], case.circle["ay_mps2"]
    # A body that leans outwards by phi shows a cos(phi) + g sin(phi), and phi is proportional to a.
    for _ in range(20 if per_a else 0):
        ay_mps2 = (case.circle["ay_mps2"] - GRAVITY_MPS2 * math.sin(per_a * ay_mps2)) / math.cos(per_a * ay_mps2)
    # With a stiff column, the rack shows the angle.
    channel = "rack_m" if case.stiff_column else STEERING
    return math.degrees(_on_circle(case, ay_mps2, channel)) + case.circle["zero_deg"]


def _on_circle(case: Case, ay_mps2: float, channel: str) -> float:
    """Return the size of a channel at a lateral acceleration on the circle, a rack as its steering wheel angle."""
    slow, fast = (math.sqrt((ay_mps2 + beside) * case.circle["radius_m"]) for beside in (-0.4, 0.2))
    overrides = {
        **case.overrides,
        "circle.radius_m": case.circle["radius_m"],
        "circle.entry_s": _ENTRY_S,
        "circle.acceleration_mps2": _RISE_MPS2,
        "speed_mps": slow,
        "circle.end_speed_mps": fast,
        "duration_s": _ENTRY_S + (fast - slow) / _RISE_MPS2 + 0.5,
    }
    simulation = Simulation("constant_radius", "none", case.vehicle, overrides)
    simulation.run()
    late = slice(round((_ENTRY_S + _SETTLED_S) / simulation.loop.vehicle.timestep_s), None)
    run = simulation.recording()
    values = run[channel]
    if channel == "rack_m":
        rack_m = simulation.loop.vehicle.rack_per_steering_wheel_m
        assert rack_m is not None
        values = values / rack_m
    # The speed range is narrow, so a channel over lateral acceleration is a straight line.
    line = np.polyfit(np.abs(run["ay_mps2"][late]), np.abs(values[late]), 1)
    return float(np.polyval(line, ay_mps2))

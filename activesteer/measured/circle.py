"""Steering wheel angle of a car on a measured circle: prediction, and a probability box.

No parameter of the car is fitted. Values that vary from lap to lap are sampled. Values with one unknown true value (a
reading of the source, an assumption) are intervals. The box is the pair of distributions at the ends of all intervals;
every distribution that the intervals allow lies between them (Oberkampf and Roy, Verification and Validation in
Scientific Computing, 2010, section 13.4). The ends of each interval are driven alone to find which end has the smaller
angle; the angle is taken to be monotonic in each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.core.conventions import GRAVITY_MPS2, Array
from activesteer.errors import ParameterError
from activesteer.measured.folder_file import CIRCLE_KEYS, STEERING, MeasuredFile
from activesteer.simulation.simulation import Simulation
from activesteer.studies.engine.workers import in_parallel

SAMPLES: Final = 200
"""Default number of samples of the values that vary from lap to lap."""
_QUANTILES: Final = (2.5, 97.5)
_SEED: Final = 20121121
_ENTRY_S: Final = 3.0
_SETTLED_S: Final = 2.0
_RISE_MPS2: Final = 0.15


class CircleValidation(NamedTuple):
    """Result of the comparison with a measured circle; angles of the steering wheel [deg]."""

    file: MeasuredFile  # the checked file
    measured_deg: Array  # measured angles, shape (n,)
    nominal_deg: float  # prediction
    assumed_deg: float  # prediction without the overrides of `circle.prediction`, from which the intervals start
    # name and source of each interval, and the second prediction at its ends, the smaller angle first
    ends: tuple[tuple[str, str, float, float], ...]
    samples_deg: Array  # prediction for samples of the values that vary from lap to lap, shape (m,)
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
        from scipy.stats import wasserstein_distance  # noqa: PLC0415 - slow to import

        return float(wasserstein_distance(self.samples_deg, self.measured_deg))

    @property
    def overlap(self) -> float:
        """Common area of the two densities, 0 to 1."""
        from scipy.stats import gaussian_kde  # noqa: PLC0415 - slow to import

        both = np.concatenate([self.samples_deg, self.measured_deg])
        grid = np.linspace(both.min() - 10.0, both.max() + 10.0, 2000)
        least = np.minimum(gaussian_kde(self.samples_deg)(grid), gaussian_kde(self.measured_deg)(grid))
        return float(least.sum() * (grid[1] - grid[0]))

    @property
    def box_deg(self) -> tuple[float, float]:
        """Box: 2.5 % quantile of the lower distribution, and 97.5 % quantile of the upper one."""
        low, high = (np.percentile(each, end) for each, end in zip(self[-2:], _QUANTILES, strict=True))
        return float(low), float(high)

    @property
    def measured_inside(self) -> int:
        """Number of measured angles in the box."""
        low, high = self.box_deg
        return int(((self.measured_deg >= low) & (self.measured_deg <= high)).sum())

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""

        def spread(values: Array) -> dict[str, Any]:
            return {"mean": values.mean(), "std": values.std(ddof=1), "n": len(values)}

        box = None
        if self.ends:
            low, high = self.box_deg
            ends = [dict(zip(("name", "source", "low_deg", "high_deg"), end, strict=True)) for end in self.ends]
            box = {
                "low_deg": low, "high_deg": high, "width_deg": high - low,
                "measured_deg": float(self.measured_deg.mean()), "measured_inside": self.measured_inside,
                "measured_values": len(self.measured_deg), "intervals": ends,
            }  # fmt: skip
        return {
            "vehicle": self.file.table.vehicle, "title": self.file.table.title, "inside": self.inside,
            "measured_deg": spread(self.measured_deg),
            "ours_deg": {"nominal": self.nominal_deg, **spread(self.samples_deg)},
            "with_assumptions_deg": self.assumed_deg, "box": box,
            "difference_deg": self.difference_deg, "tolerance_deg": self.tolerance_deg,
            "area_metric_deg": self.area_metric_deg, "overlap": self.overlap,
            "assumptions": list(self.file.table.assumptions),
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
    circle, intervals = file.table.circle, file.table.intervals
    assert circle is not None
    full = file.on_circle
    main = file.changed(full, circle.prediction)
    per_ay = _on_circle(file.vehicle, main, circle.ay_mps2, "roll_rad") / circle.ay_mps2

    def drive(cases: list[dict[str, Any]], begin: float, end: float) -> list[float]:
        def report(_: int, done: int) -> None:
            progress(begin + (end - begin) * done / len(cases), "circle")

        calls = [(file.vehicle, case, per_ay) for case in cases]
        return in_parallel(steering_wheel_deg, calls, jobs, report, scheduler=scheduler)

    sides = [(each.low, each.high) for each in intervals.values()]
    cases = [main, full, *(file.changed(full, end) for pair in sides for end in pair)]
    nominal, assumed, *angles = drive(cases, 0.0, 0.15)
    pairs = list(zip(angles[::2], angles[1::2], strict=True))
    ordered = [side if pair[0] <= pair[1] else side[::-1] for side, pair in zip(sides, pairs, strict=True)]
    draws = np.random.default_rng(_SEED).normal(size=(samples, len(circle.spread)))
    half = draws[::2] if ordered else draws[:0]
    cases = [file.drawn(main, draw) for draw in draws]
    for place in (0, 1):
        ends = [side[place] for side in ordered]
        cases += [file.changed(file.drawn(full, draw), *ends) for draw in half]
    found = np.split(np.array(drive(cases, 0.15, 1.0)), [samples, samples + len(half)])
    return CircleValidation(
        file, np.degrees(circle.steering_wheel_rad), nominal, assumed,
        tuple((name, each.source, min(pair), max(pair))
              for (name, each), pair in zip(intervals.items(), pairs, strict=True)),
        *found,
    )  # fmt: skip


def steering_wheel_deg(vehicle: str, case: Mapping[str, Any], roll_per_ay: float = 0.0) -> float:
    """Return the steering wheel angle that holds a laterally symmetric car on a circle [deg]."""
    per_a, ay_mps2 = roll_per_ay * case["body_roll"], case["ay_mps2"]
    # A body that leans outwards by phi shows a cos(phi) + g sin(phi), and phi is proportional to a.
    for _ in range(20 if per_a else 0):
        ay_mps2 = (case["ay_mps2"] - GRAVITY_MPS2 * math.sin(per_a * ay_mps2)) / math.cos(per_a * ay_mps2)
    # With a stiff column, the rack shows the angle.
    channel = "rack_m" if case["stiff_column"] else STEERING
    return math.degrees(_on_circle(vehicle, case, ay_mps2, channel)) + case["zero_deg"]


def _on_circle(vehicle: str, case: Mapping[str, Any], ay_mps2: float, channel: str) -> float:
    """Return the size of a channel at a lateral acceleration on the circle, a rack as its steering wheel angle."""
    slow, fast = (math.sqrt((ay_mps2 + beside) * case["radius_m"]) for beside in (-0.4, 0.2))
    overrides = {
        **{key: value for key, value in case.items() if key not in CIRCLE_KEYS},
        "circle.radius_m": case["radius_m"],
        "circle.entry_s": _ENTRY_S,
        "circle.acceleration_mps2": _RISE_MPS2,
        "speed_mps": slow,
        "circle.end_speed_mps": fast,
        "duration_s": _ENTRY_S + (fast - slow) / _RISE_MPS2 + 0.5,
    }
    simulation = Simulation("constant_radius", "none", vehicle, overrides)
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

"""Steering wheel angle of a car on a measured circle: prediction and probability box.

No parameter of the car is fitted. Values that vary from lap to lap are sampled. Values with one unknown true value (a
reading of the source, an assumption) are intervals. The box is the pair of distributions at the ends of all intervals;
every distribution that the intervals allow is between them (Oberkampf and Roy, Verification and Validation in
Scientific Computing, 2010, section 13.4). Both ends of each interval are driven to find which end has the smaller
angle; the angle is taken to be monotonic in each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
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
    """Result of the comparison with a measured circle, with angles of the steering wheel [deg]."""

    file: MeasuredFile  # the checked file
    distributions: Sequence[Array]  # measured and predicted angles; second prediction at either end of all intervals
    numbers: dict[str, Any]  # JSON values

    @property
    def inside(self) -> bool:
        """True if the difference of the means is within the tolerance."""
        return self.numbers["inside"]

    def to_json(self) -> dict[str, Any]:
        """Return the result as JSON values."""
        return self.numbers


def judged(
    file: MeasuredFile, nominal_deg: float, assumed_deg: float, ends: Sequence[tuple[str, str, float, float]],
    distributions: Sequence[Array],
) -> CircleValidation:  # fmt: skip
    """Compare the distributions of measured and predicted angles."""
    # `assumed_deg` is the prediction without the overrides of `circle.prediction`. `ends` has name and source of each
    # interval, and this prediction at its ends, the smaller angle first.
    from scipy.stats import gaussian_kde, wasserstein_distance  # noqa: PLC0415 - slow to import

    measured, samples, lower, upper = distributions
    difference_deg = float(samples.mean() - measured.mean())
    tolerance_deg = math.degrees(file.tolerances[STEERING].width(np.radians(measured.mean())))
    both = np.concatenate([samples, measured])
    grid = np.linspace(both.min() - 10.0, both.max() + 10.0, 2000)
    least = np.minimum(gaussian_kde(samples)(grid), gaussian_kde(measured)(grid))
    box = None
    if ends:
        low, high = (float(np.percentile(each, end)) for each, end in zip((lower, upper), _QUANTILES, strict=True))
        box = {
            "low_deg": low, "high_deg": high, "width_deg": high - low, "measured_deg": float(measured.mean()),
            "measured_inside": int(((measured >= low) & (measured <= high)).sum()), "measured_values": len(measured),
            "intervals": [dict(zip(("name", "source", "low_deg", "high_deg"), end, strict=True)) for end in ends],
        }  # fmt: skip

    def spread(values: Array) -> dict[str, Any]:
        return {"mean": values.mean(), "std": values.std(ddof=1), "n": len(values)}

    numbers = {
        "vehicle": file.table.vehicle, "title": file.table.title, "inside": abs(difference_deg) <= tolerance_deg,
        "measured_deg": spread(measured), "ours_deg": {"nominal": nominal_deg, **spread(samples)},
        "with_assumptions_deg": assumed_deg, "box": box, "difference_deg": difference_deg,
        "tolerance_deg": tolerance_deg,
        # Area between the cumulative distributions (Ferson, Oberkampf, Ginzburg 2008), common area of the densities.
        "area_metric_deg": float(wasserstein_distance(samples, measured)),
        "overlap": float(least.sum() * (grid[1] - grid[0])), "assumptions": list(file.table.assumptions),
    }  # fmt: skip
    return CircleValidation(file, distributions, numbers)


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
            f"{samples} samples are too few for a distribution; at least 10 are needed", key="samples", value=samples
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
    named = [(name, each.source, min(pair), max(pair))
             for (name, each), pair in zip(intervals.items(), pairs, strict=True)]  # fmt: skip
    return judged(file, nominal, assumed, named, [np.degrees(circle.steering_wheel_rad), *found])


def steering_wheel_deg(vehicle: str, case: Mapping[str, Any], roll_per_ay: float = 0.0) -> float:
    """Return the steering wheel angle that holds a car without lateral asymmetry on a circle [deg]."""
    per_a, ay_mps2 = roll_per_ay * case["body_roll"], case["ay_mps2"]
    # A body that leans outwards by phi shows a cos(phi) + g sin(phi), and phi is proportional to a.
    for _ in range(20 if per_a else 0):
        ay_mps2 = (case["ay_mps2"] - GRAVITY_MPS2 * math.sin(per_a * ay_mps2)) / math.cos(per_a * ay_mps2)
    # With a stiff column, the rack shows the angle.
    channel = "rack_m" if case["stiff_column"] else STEERING
    return math.degrees(_on_circle(vehicle, case, ay_mps2, channel)) + case["zero_deg"]


def _on_circle(vehicle: str, case: Mapping[str, Any], ay_mps2: float, channel: str) -> float:
    """Return the magnitude of a channel at a lateral acceleration on the circle."""
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

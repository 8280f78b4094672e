"""Probability box of the steering wheel angle on a measured circle.

Values that have one unknown true value (a reading of the source, an assumption) are intervals. Values that vary from
lap to lap are random. The box is the pair of distributions at the ends of all intervals; every distribution that the
intervals allow lies between them (Oberkampf and Roy, Verification and Validation in Scientific Computing, 2010, section
13.4). The ends of each interval are driven alone to find their sign; the angle is taken to be monotonic in each.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.conventions import GRAVITY_MPS2, Array
from activesteer.validation.circle_variations import EFFECTS, WITHOUT_ALIGNING, combined, ratio

RATIO: Final = 15.48
"""Steering ratio of the vehicle file, `isteer` of the source [-]."""
_LEAST_RATIO: Final = 14.27
"""`isteer_skalar` of the source [-]; its single-track model has 14.7."""
_HALF_TRACK_M: Final = 0.83
"""Half of the track [m]: the wheels of one side may follow the line of the circle, and not the centre of gravity."""
_TYRE: Final = 0.05
"""Fraction by which the tyres' side force may be wrong [-]."""
_ZERO_DEG: Final = 1.0
"""Error of the zero of the steering wheel angle [deg], chosen: the source does not say whether the angle is the mean of
a left and a right circle, in which the error would cancel."""
_QUANTILES: Final = (2.5, 97.5)


class Case(NamedTuple):
    """A run on the circle.

    Attributes:
        table: The vehicle file.
        radius_m: Radius of the centre of gravity [m].
        ay_mps2: Horizontal lateral acceleration [m/s2].
        mass: Factor on the mass.
        tyre: Factor on the tyres' side force.
        stiff_column: Whether the angle is that of a column that does not twist.
        zero_deg: Error of the zero of the measured angle, added to ours [deg].
    """

    table: Mapping[str, Any]
    radius_m: float
    ay_mps2: float
    mass: float = 1.0
    tyre: float = 1.0
    stiff_column: bool = False
    zero_deg: float = 0.0


class Interval(NamedTuple):
    """A value with two ends.

    Attributes:
        name: What is unknown.
        source: Where the ends come from.
        low: Change of a case to the end with the smaller angle.
        high: Change to the other end.
    """

    name: str
    source: str
    low: Callable[[Case], Case]
    high: Callable[[Case], Case]


class Step(NamedTuple):
    """A step of the waterfall.

    Attributes:
        name: What is added.
        kind: `geometry`, `measured` or `assumed`.
        angle_deg: Angle with it and everything before it.
    """

    name: str
    kind: str
    angle_deg: float


class Box(NamedTuple):
    """A probability box.

    Attributes:
        ends_deg: For each interval its name, the source of its ends, and the second prediction with each end alone.
        lower_deg: Angles at the ends with the smaller angles, sorted, shape (n,).
        upper_deg: Angles at the other ends, likewise.
    """

    ends_deg: tuple[tuple[str, str, float, float], ...]
    lower_deg: Array
    upper_deg: Array

    @property
    def low_deg(self) -> float:
        """2.5 % quantile of the lower distribution [deg]."""
        return float(np.percentile(self.lower_deg, _QUANTILES[0]))

    @property
    def high_deg(self) -> float:
        """97.5 % quantile of the upper distribution [deg]."""
        return float(np.percentile(self.upper_deg, _QUANTILES[1]))

    def inside(self, measured_deg: Array) -> int:
        """Return how many measured angles lie between `low_deg` and `high_deg`."""
        return int(((measured_deg >= self.low_deg) & (measured_deg <= self.high_deg)).sum())

    def as_table(self, measured_deg: Array) -> dict[str, Any]:
        """Return the JSON values."""
        return {
            "low_deg": self.low_deg, "high_deg": self.high_deg, "width_deg": self.high_deg - self.low_deg,
            "measured_deg": float(measured_deg.mean()), "measured_inside": self.inside(measured_deg),
            "measured_values": len(measured_deg),
            "intervals": [
                {"name": name, "source": source, "low_deg": low, "high_deg": high}
                for name, source, low, high in self.ends_deg
            ],
        }  # fmt: skip


def measured_only(case: Case) -> Case:
    """Return a case without the compliances that the source does not have: aligning moment and column."""
    return case._replace(table=WITHOUT_ALIGNING(case.table), stiff_column=True)


def intervals(roll_rad: float) -> tuple[Interval, ...]:
    """Return the intervals.

    Args:
        roll_rad: Roll angle of the car on the circle, by which an accelerometer on the body tilts [rad].
    """

    def tilted(case: Case) -> Case:
        # A body that leans outwards by phi shows a cos(phi) + g sin(phi), and phi is proportional to a.
        per_a = roll_rad / case.ay_mps2
        a = case.ay_mps2
        for _ in range(20):
            a = (case.ay_mps2 - GRAVITY_MPS2 * math.sin(per_a * a)) / math.cos(per_a * a)
        return case._replace(ay_mps2=a)

    quick = ratio(RATIO / _LEAST_RATIO)
    return (
        Interval(
            "steering ratio", f"source: {_LEAST_RATIO} to {RATIO}",
            lambda case: case._replace(table=quick(case.table)), lambda case: case,
        ),
        Interval(
            "compliance to aligning moment and of the column", "ours: none to the compact's",
            measured_only, lambda case: case,
        ),
        Interval(
            "point that follows 30 m", f"source leaves it open: wheels of either side, {_HALF_TRACK_M} m",
            lambda case: case._replace(radius_m=case.radius_m + _HALF_TRACK_M),
            lambda case: case._replace(radius_m=case.radius_m - _HALF_TRACK_M),
        ),
        Interval(
            "tilt of the accelerometer", "source leaves it open: on the body, or levelled", tilted, lambda case: case,
        ),
        Interval(
            "zero of the steering wheel angle", f"ours: {_ZERO_DEG} deg",
            lambda case: case._replace(zero_deg=-_ZERO_DEG), lambda case: case._replace(zero_deg=_ZERO_DEG),
        ),
        Interval(
            "side force of the tyres", f"source: {100 * _TYRE:g} %",
            lambda case: case._replace(tyre=case.tyre * (1.0 + _TYRE)),
            lambda case: case._replace(tyre=case.tyre * (1.0 - _TYRE)),
        ),
    )  # fmt: skip


def at_end(case: Case, known: tuple[Interval, ...], *, high: bool) -> Case:
    """Return a case with all intervals at the ends with the smaller angles, or with the larger ones."""
    for interval in known:
        case = (interval.high if high else interval.low)(case)
    return case


_MEASURED: Final = {
    "camber over side force": ("camber over side force, front", "camber over side force, rear"),
    "static camber and toe": ("static camber, front", "static camber, rear", "static toe, rear"),
    "toe over travel (roll steer)": ("roll steer, front", "roll steer, rear"),
    "toe over side force": ("toe over side force, front", "toe over side force, rear"),
}
"""Step of the waterfall -> effects that it adds; all are in the source. Toe over side force is last: without the
assumed compliance to aligning moment, an axle cannot have it and no camber over side force."""


def waterfall(case: Case) -> list[tuple[str, str, Case]]:
    """Return the steps from geometry and tyres to the prediction with all assumptions, each with its case."""
    steps: list[tuple[str, str, Case]] = []
    bare = measured_only(case)
    for count in range(len(_MEASURED) + 1):
        missing = [EFFECTS[name] for names in reversed(list(_MEASURED.values())[count:]) for name in names]
        name = list(_MEASURED)[count - 1] if count else "geometry and tyres"
        table = combined(*missing)(bare.table)
        steps.append((name, "measured" if count else "geometry", bare._replace(table=table)))
    steps.append(("toe over aligning moment", "assumed", case._replace(stiff_column=True)))
    steps.append(("twist of the column", "assumed", case))
    return steps

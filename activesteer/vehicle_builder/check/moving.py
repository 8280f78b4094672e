"""Check of the K&C metrics against the usual ranges of passenger cars in usual.toml, which has the sources."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from activesteer.config import build, read_toml
from activesteer.rigs.kc import KcResult
from activesteer.vehicle_builder.check.findings import Finding, Usual, judged


@dataclass(frozen=True)
class UsualMetric:
    """Usual and possible range of one metric of the rig, in its unit."""

    topic: str
    axle: str
    name: str
    words: str
    """Name in the report."""
    usual: tuple[float, ...]
    """Lowest and highest usual value; a value outside is a warning."""
    possible: tuple[float, ...]
    """Lowest and highest possible value; a value outside is an error."""
    advice: str
    """Advice for a value outside."""


@dataclass(frozen=True)
class _File:
    metric: tuple[UsualMetric, ...]


@functools.cache
def usual_metrics() -> tuple[UsualMetric, ...]:
    """Return the metrics of usual.toml, in its order."""
    return build(_File, *read_toml(Path(__file__).with_name("usual.toml"))).metric


def moving(result: KcResult) -> Iterator[Finding]:
    """Return all findings from the rig.

    Args:
        result: Result of the rig.
    """
    yield from (finding for finding in _metrics(result) if finding.topic == "riding")
    front, rear = result["front", "ride_frequency"], result["rear", "ride_frequency"]
    yield judged(
        "riding", "rear over front ride frequency", rear / front, "", Usual(1.0, 1.4, 0.4, 3.0),
        "the car pitches least after a bump if the rear is slightly faster (Olley): change the springs of one axle",
    )  # fmt: skip
    yield from (finding for finding in _metrics(result) if finding.topic == "kinematics")
    yield _sign(result)
    yield from (finding for finding in _metrics(result) if finding.topic == "steering")
    known = result.measured.parameters.steering.ratio
    yield judged(
        "steering", "ratio in the vehicle file, against the measured ratio",
        100.0 * (known / result["front", "steering_ratio"] - 1.0), "%", Usual(-2.0, 2.0, -100.0, 100.0),
        "write the measured ratio into [steering]: controllers and driver rely on it",
    )  # fmt: skip


def _metrics(result: KcResult) -> Iterator[Finding]:
    units = {(entry.axle, entry.name): entry.unit for entry in result.metrics}
    for row in usual_metrics():
        unit = units[row.axle, row.name]
        yield judged(
            row.topic, row.words, result[row.axle, row.name], unit, Usual(*row.usual, *row.possible), row.advice
        )


def _sign(result: KcResult) -> Finding:
    """Check that a left turn of the steering wheel turns both wheels to the left."""
    sweep = result.curves["steering_rolling"]
    turned = sweep.steer_rad[-1, :2] - sweep.steer_rad[sweep.zero, :2]
    good = bool((turned > 0.0).all()) and float(sweep.x[-1]) > 0.0
    degrees = ", ".join(f"{math.degrees(angle):.1f}" for angle in np.asarray(turned))
    advice = "" if good else "reverse the axis of the joint `rack`: its positive travel has to steer left"
    return Finding(
        "steering",
        "left turn of the steering wheel steers left",
        "ok" if good else "error",
        f"{degrees} deg",
        "",
        advice,
    )

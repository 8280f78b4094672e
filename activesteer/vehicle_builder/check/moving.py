"""Check of the K&C metrics against the usual ranges of passenger cars in usual.toml, which has the sources."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from activesteer.rigs.kc import KcResult
from activesteer.vehicle_builder.check.findings import Finding, Level, judged, usual_values


def moving(result: KcResult) -> Iterator[Finding]:
    """Return all findings from the rig."""
    yield from (finding for finding in _metrics(result) if finding.topic == "riding")
    front, rear = result["front", "ride_frequency"], result["rear", "ride_frequency"]
    yield judged("ride_ratio", rear / front)
    yield from (finding for finding in _metrics(result) if finding.topic == "kinematics")
    yield _sign(result)
    yield from (finding for finding in _metrics(result) if finding.topic == "steering")
    known = result.measured.parameters.steering.ratio
    yield judged("ratio_error", 100.0 * (known / result["front", "steering_ratio"] - 1.0))


def _metrics(result: KcResult) -> Iterator[Finding]:
    units = {(entry.axle, entry.name): entry.unit for entry in result.metrics}
    for row in usual_values().metric:
        yield row.judged(result[row.axle, row.name], units[row.axle, row.name])


def _sign(result: KcResult) -> Finding:
    """Check that a left turn of the steering wheel turns both wheels to the left."""
    sweep = result.curves["steering_rolling"]
    turned = sweep.steer_rad[-1, :2] - sweep.steer_rad[sweep.zero, :2]
    good = bool((turned > 0.0).all()) and float(sweep.x[-1]) > 0.0
    degrees = ", ".join(f"{math.degrees(angle):.1f}" for angle in np.asarray(turned))
    advice = "" if good else "reverse the axis of the joint `rack`: its positive travel has to steer left"
    level: Level = "ok" if good else "error"
    return Finding("steering", "left turn of the steering wheel steers left", level, f"{degrees} deg", "", advice)

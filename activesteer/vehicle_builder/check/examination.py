"""The whole check, in the order of its stages. A stage that fails gives its reason."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator

import mujoco
import numpy as np

from activesteer.errors import ActiveSteerError
from activesteer.resources import find_vehicle
from activesteer.rigs.kc import KcResult, kinematics_compliance
from activesteer.scenario import load_car
from activesteer.vehicle_builder.check.findings import CheckReport, Finding, Level, judged, usual_values
from activesteer.vehicle_builder.check.geometry import geometry, missing_parts
from activesteer.vehicle_builder.check.standing import standing


def check_vehicle(vehicle: str | os.PathLike[str]) -> CheckReport:
    """Check a car before it is driven."""
    file = find_vehicle(vehicle)
    findings: list[Finding] = []
    try:
        car = load_car(file)
    except ActiveSteerError as reason:
        return CheckReport(file.stem, (Finding("parts", "vehicle file", "error", "wrong", "", str(reason)),))
    findings.append(Finding("parts", "vehicle file, MJCF and tyre files", "ok", "read"))
    name = car.name
    try:
        model = mujoco.MjModel.from_xml_path(str(car.mjcf))
    except ValueError as reason:
        findings.append(Finding("parts", "MJCF compiles", "error", "no", "", str(reason)))
        return CheckReport(name, tuple(findings))
    findings += missing_parts(model)
    if any(finding.level == "error" for finding in findings):
        return CheckReport(name, tuple(findings))
    findings += geometry(model)
    try:
        standing_car = car.on()
    except ActiveSteerError as reason:
        findings.append(Finding("standing", "static equilibrium", "error", "none", "", str(reason)))
        return CheckReport(name, tuple(findings))
    findings += standing(standing_car, car)
    try:
        findings += _riding(kinematics_compliance(file))
    except ActiveSteerError as reason:
        findings.append(Finding("riding", "kinematics and compliance", "error", "cannot be measured", "", str(reason)))
    return CheckReport(name, tuple(findings))


def _riding(result: KcResult) -> Iterator[Finding]:
    """Compare the metrics of the rig with the usual ones of passenger cars."""
    yield from _metrics(result, "riding")
    front, rear = result["front", "ride_frequency"], result["rear", "ride_frequency"]
    yield judged("ride_ratio", rear / front)
    yield from _metrics(result, "kinematics")
    yield _sign(result)
    yield from _metrics(result, "steering")
    known = result.measured.parameters.steering.ratio
    yield judged("ratio_error", 100.0 * (known / result["front", "steering_ratio"] - 1.0))


def _metrics(result: KcResult, topic: str) -> Iterator[Finding]:
    units = {(entry.axle, entry.name): entry.unit for entry in result.metrics}
    for row in (row for row in usual_values().metric if row.topic == topic):
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

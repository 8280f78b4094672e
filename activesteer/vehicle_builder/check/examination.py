"""The whole check, in the order of its stages; a stage that fails gives its reason."""

from __future__ import annotations

import os

import mujoco

from activesteer.errors import ActiveSteerError
from activesteer.resources import find_vehicle
from activesteer.rigs.kc import kinematics_compliance
from activesteer.scenario import load_car
from activesteer.vehicle_builder.check.findings import CheckReport, Finding
from activesteer.vehicle_builder.check.geometry import geometry
from activesteer.vehicle_builder.check.moving import moving
from activesteer.vehicle_builder.check.parts import missing_parts
from activesteer.vehicle_builder.check.standing import standing


def check_vehicle(vehicle: str | os.PathLike[str]) -> CheckReport:
    """Check a car before it is driven.

    Args:
        vehicle: A name, the path of a vehicle file, or a folder with one.

    Returns:
        The findings; the first stage that fails gives an error.

    Raises:
        ParameterError: there is no such vehicle.
    """
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
        findings += moving(kinematics_compliance(file))
    except ActiveSteerError as reason:
        findings.append(Finding("riding", "kinematics and compliance", "error", "cannot be measured", "", str(reason)))
    return CheckReport(name, tuple(findings))

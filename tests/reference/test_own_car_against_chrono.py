"""A car made from the hardpoints of Project Chrono's sedan moves its wheels as that code does.

Facts of the Sedan of chrono_models (commit 7689fbc, BSD-3-Clause); all of its joints are rigid, so its links are made
rigid here. `models/reference/sedan/travel_sweep.csv` was measured by running that code. Tolerances: angles 0.01 deg of
4.2 and 3.5 deg of range; dampers 1 % of their range, because what a damper's foot lies beside its arm's plane (25 mm in
front) or its link's line (80 mm behind) does not turn with it here (`vehicle_builder.axle_kinds`).
"""

from __future__ import annotations

import csv
import functools
import tempfile
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from activesteer.resources import models_dir
from activesteer.rigs.kc.held_car import Case, HeldCar
from activesteer.rigs.kc.programme import Sweep, run
from activesteer.scenario import load_car
from activesteer.vehicle_builder import new_vehicle

FRONT = """
wheel_centre, 1.388, 0.7979, 0.1301
uca_front_inner, 1.288, 0.47, 0.355
uca_rear_inner, 1.138, 0.51, 0.36
uca_outer, 1.348, 0.695, 0.355
lca_front_inner, 1.588, 0.42, -0.02
lca_rear_inner, 1.188, 0.47, -0.015
lca_outer, 1.388, 0.77, -0.07
tie_rod_inner, 1.188, 0.42, 0.13
tie_rod_outer, 1.238, 0.77, 0.13
spring_inner, 1.348, 0.52, 0.48
spring_outer, 1.388, 0.62, -0.02
damper_inner, 1.348, 0.52, 0.48
damper_outer, 1.388, 0.62, -0.02
"""
REAR = """
wheel_centre, -1.388, 0.8, 0.125
upper_front_inner, -1.328, 0.397, 0.207
upper_rear_inner, -1.545, 0.358, 0.187
upper_outer, -1.332, 0.714, 0.276
lateral_link_inner, -1.352, 0.188, -0.008
lateral_link_outer, -1.359, 0.692, 0.032
trailing_link_inner, -0.665, 0.449, 0.053
trailing_link_outer, -1.388, 0.714, -0.031
toe_link_inner, -1.645, 0.17, 0.009
toe_link_outer, -1.532, 0.712, 0.069
spring_inner, -1.207, 0.491, 0.235
spring_outer, -1.207, 0.419, -0.039
damper_inner, -1.217, 0.478, 0.44
damper_outer, -1.207, 0.519, -0.037
"""
REST = """
units, m
origin, 1.388, 0, -0.2
mass.total_kg, 1678
mass.front_fraction, 0.49
mass.cg_height_m, 0.41
mass.inertia_kgm2, 314, 1241, 1431
front.type, double_wishbone
rear.type, multilink
rear.spring_on, trailing_link
rear.damper_on, trailing_link
front.knuckle_mass_kg, 4
rear.knuckle_mass_kg, 15
"""
LINKS = {"front": ("uca_front", "uca_rear", "lca_front", "lca_rear", "tie_rod"),
         "rear": ("upper_front", "upper_rear", "lateral_link", "trailing_link", "toe_link")}  # fmt: skip
RIGID_NPM = "1e9"


@functools.cache
def travel() -> Sweep:
    """Return the parallel travel of the wheels without springs."""
    lines = REST.split("\n")
    for axle, points in (("front", FRONT), ("rear", REAR)):
        lines += [f"{axle}.{line}" for line in points.strip().split("\n")]
        lines += [f"{axle}.links.{link}.stiffness_Npm, {RIGID_NPM}" for link in LINKS[axle]]
        lines += [f"{axle}.tyre, sedan_pac02.tir", f"{axle}.toe_deg, 0", f"{axle}.camber_deg, 0"]
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "sedan.csv"
        table.write_text("\n".join(lines))
        car = HeldCar(load_car(new_vehicle("twin", table, Path(folder) / "twin").vehicle_file).on(), springs="out")
    cases = {x: Case(height_m=np.full(4, x)) for x in np.linspace(-0.08, 0.08, 33).tolist()}
    return run(car, "parallel wheel travel", "wheel travel", "m", cases)


@functools.cache
def reference() -> dict[str, np.ndarray]:
    with open(models_dir() / "reference" / "sedan" / "travel_sweep.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


@pytest.mark.parametrize(("axle", "corner"), [("front", 0), ("rear", 2)])
@pytest.mark.parametrize(("name", "share"), [("toe_in_deg", None), ("camber_deg", None), ("shock_len_mm", 0.01)])
def test_wheel_travel(axle: str, corner: int, name: str, share: float | None) -> None:
    sweep = travel()
    ours = {
        "toe_in_deg": np.degrees(sweep.toe_rad[:, corner]),
        "camber_deg": np.degrees(sweep.camber_rad[:, corner]),
        "shock_len_mm": 1e3 * sweep.damper_m[:, corner],
    }[name]
    # Both begin in the design position: there Chrono's travel is 0, and there the made car stands.
    height = 1e3 * (sweep.centre_m[:, corner, 2] - sweep.centre_m[sweep.zero, corner, 2])
    travel_mm, theirs = reference()["travel_mm"], reference()[f"{name}_{axle}"]
    difference = CubicSpline(height, ours - ours[sweep.zero])(travel_mm) - (theirs - np.interp(0.0, travel_mm, theirs))
    allowed = 0.01 if share is None else share * np.ptp(theirs)
    assert np.ptp(theirs) > 20.0 * allowed
    assert np.abs(difference).max() < allowed

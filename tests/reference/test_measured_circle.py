"""Comparison with a measured circle: its measures by hand, the angle against geometry, effects and open decisions.

The design rules of the source's numbers are from C. Angerer et al., NEVVE 2018, and S. Fuchs, TUM 2014, as in
TUMFTM/TOTEM.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from activesteer.config import read_toml
from activesteer.errors import ParameterError
from activesteer.resources import find_vehicle, models_dir
from activesteer.validation.circle_box import Box, Case, intervals, measured_only
from activesteer.validation.circle_variations import DECISIONS, EFFECTS
from activesteer.validation.measured_circle import CircleResult, is_measured, steering_wheel_deg, validate_circle
from tests.raising import raises


def result(ours: np.ndarray, measured: np.ndarray) -> CircleResult:
    return CircleResult("car", measured, float(ours.mean()), ours, 0.0)


def test_the_area_between_shifted_distributions_is_the_shift(rng: np.random.Generator) -> None:
    values = rng.normal(94.0, 1.3, 200)
    assert result(values + 5.0, values).area_metric_deg == pytest.approx(5.0, abs=1e-9)
    assert result(values, values).area_metric_deg == pytest.approx(0.0, abs=1e-9)


def test_distributions_apart_do_not_overlap_and_alike_ones_do(rng: np.random.Generator) -> None:
    values = rng.normal(94.0, 1.3, 200)
    assert result(values + 30.0, values).overlap < 1e-3
    assert result(values, values).overlap == pytest.approx(1.0, abs=0.01)


def test_the_tolerance_is_that_of_iso_19364() -> None:
    measured = np.array([99.0, 101.0])
    assert result(measured + 7.9, measured).inside
    assert not result(measured + 8.1, measured).inside


def test_too_few_samples_are_an_error() -> None:
    assert is_measured("tesla_model_s")
    assert not is_measured("sedan")
    with raises(ParameterError, key="samples"):
        validate_circle("tesla_model_s", 5)


def source() -> dict[str, Any]:
    text = (models_dir() / "reference" / "tesla_model_s" / "vehicle.json").read_text(encoding="utf-8")
    return json.loads(text)


def test_springs_and_dampers_of_the_source_are_of_an_axle_and_of_a_design_rule() -> None:
    """Rule: 1 Hz for the car, 1.1 times that at the rear; damping ratio 0.3, 1.6 times that at the rear."""
    given = source()
    shares = {"F": 1.0 - given["xSP"] / given["l"], "R": given["xSP"] / given["l"]}
    lowest = (2.0 * math.pi) ** 2 / (shares["F"] + 1.21 * shares["R"])
    rates = {"F": lowest * shares["F"] * given["mss"], "R": 1.21 * lowest * shares["R"] * given["mss"]}
    roots = {end: math.sqrt(rates[end] * shares[end]) for end in rates}
    front = 0.3 * math.sqrt(sum(rates.values())) / (roots["F"] + 1.6 * roots["R"])
    for end, ratio in (("F", front), ("R", 1.6 * front)):
        assert given[f"cs{end}"] == pytest.approx(rates[end], rel=1e-12)
        rate = 2.0 * ratio * roots[end] * math.sqrt(given["mss"])
        assert -given[f"dd{end}_comp"][0] == pytest.approx(4.0 / 7.0 * rate, rel=1e-12)
        assert -given[f"dd{end}_reb"][0] == pytest.approx(10.0 / 7.0 * rate, rel=1e-12)


def test_the_wheel_inertia_of_the_source_is_that_of_both_wheels_of_an_axle() -> None:
    given = source()
    diameter_m = 19 * 0.0254 + 2.0 * 0.45 * 0.245
    both_kg = diameter_m * 245.0 * 0.27641 - 0.4682
    assert given["Iwf"] == pytest.approx(0.5 * both_kg * given["r_stat0"] ** 2, rel=1e-12)


def toe_deg(table: dict[str, Any], axle: str, side_N: float, aligning_Nm: float) -> float:
    """Return the rotation of the left wheel to the left under forces at the road."""
    matrix = np.zeros((5, 5))
    matrix[np.triu_indices(5)] = table["curves"][axle]["stiffness"]
    moved = np.linalg.solve(matrix + np.triu(matrix, 1).T, [0.0, side_N, 0.335 * side_N, 0.0, aligning_Nm])
    return float(np.degrees(moved[4]))


def test_switching_an_effect_off_changes_no_other_effect() -> None:
    table, _ = read_toml(find_vehicle("tesla_model_s"))
    for axle, sign in (("front", 1.0), ("rear", -1.0)):
        side, aligning = toe_deg(table, axle, -1e3, 0.0), toe_deg(table, axle, 0.0, 100.0)
        assert side * sign > 0.03, "towards the middle of the car: front toe-out, rear toe-in"
        assert aligning > 0.4
        no_side = EFFECTS[f"toe over side force, {axle}"](table)
        assert toe_deg(no_side, axle, -1e3, 0.0) == pytest.approx(0.0, abs=1e-4)
        assert toe_deg(no_side, axle, 0.0, 100.0) == pytest.approx(aligning, rel=1e-4)
        no_moment = EFFECTS[f"toe over aligning moment, {axle} (assumed)"](table)
        assert toe_deg(no_moment, axle, -1e3, 0.0) == pytest.approx(side, rel=1e-3)
        assert toe_deg(no_moment, axle, 0.0, 100.0) < 0.5 * aligning
        no_camber = EFFECTS[f"camber over side force, {axle}"](table)
        assert toe_deg(no_camber, axle, -1e3, 0.0) == pytest.approx(side, rel=1e-2)
        turned = DECISIONS["elkin_y_toe of both axles reversed (used: understeering)"](table)
        assert toe_deg(turned, axle, -1e3, 0.0) == pytest.approx(-side, rel=1e-3)


@pytest.mark.slow
def test_without_changes_of_toe_the_angle_is_that_of_geometry_and_tyres() -> None:
    """Tyres add some degrees to the Ackermann angle of 87: the front carries more load and more roll moment."""
    table, _ = read_toml(find_vehicle("tesla_model_s"))
    changed = EFFECTS["all six effects on toe"]({**table, "name": "tesla_model_s"})
    angle = steering_wheel_deg(Case(changed, 30.0, 5.65))
    assert 88.0 < angle < 98.0


@pytest.mark.slow
def test_without_lateral_acceleration_the_angle_is_that_of_ackermann() -> None:
    """A line through two low accelerations must reach 5.64 deg at the wheels (30 m) times the ratio of 15.5."""
    table, _ = read_toml(find_vehicle("tesla_model_s"))
    low, high = (steering_wheel_deg(Case({**table, "name": "tesla_model_s"}, 30.0, ay)) for ay in (0.6, 1.2))
    assert low < high
    assert 2.0 * low - high == pytest.approx(15.48 * math.degrees(math.atan(2.96 / 30.0)), rel=0.02)


def test_the_box_lies_between_the_ends_of_the_intervals_and_counts_what_is_inside() -> None:
    box = Box((), np.linspace(80.0, 90.0, 101), np.linspace(110.0, 120.0, 101))
    assert box.low_deg == pytest.approx(80.25)
    assert box.high_deg == pytest.approx(119.75)
    assert box.inside(np.array([80.0, 81.0, 100.0, 119.0, 120.0])) == 3
    assert box.as_table(np.array([94.0]))["measured_deg"] == 94.0


def test_a_tilted_accelerometer_shows_more_than_the_horizontal_acceleration() -> None:
    """By hand: a cos(phi) + g sin(phi) = 5.65 with phi = 0.0458 rad * a / 5.65 gives 5.24 m/s2."""
    tilt = next(interval for interval in intervals(0.0458) if "tilt" in interval.name)
    assert tilt.low(Case({}, 30.0, 5.65)).ay_mps2 == pytest.approx(5.238, abs=2e-3)


@pytest.mark.slow
def test_without_the_assumed_compliances_the_angle_is_smaller_and_a_quicker_ratio_makes_it_smaller_still() -> None:
    table, _ = read_toml(find_vehicle("tesla_model_s"))
    case = Case({**table, "name": "tesla_model_s"}, 30.0, 5.65)
    main = measured_only(case)
    quick = next(interval for interval in intervals(0.05) if interval.name == "steering ratio").low(main)
    angles = [steering_wheel_deg(each) for each in (quick, main, case)]
    assert angles[2] - angles[1] == pytest.approx(8.2, abs=0.3)  # 10.4 - 5.3 + 3.1 deg
    # The wheels need the same angle, so the steering wheel turns less in proportion to the ratio.
    assert angles[0] == pytest.approx(angles[1] * 14.27 / 15.48, rel=0.01)

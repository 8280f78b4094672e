"""Comparison with a measured circle: its measures by hand, the angle against geometry, and the effects of the Tesla.

The design rules of the source's numbers are from C. Angerer et al., NEVVE 2018, and S. Fuchs, TUM 2014, as in
TUMFTM/TOTEM.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.config import read_toml
from activesteer.errors import ActiveSteerError, ParameterError
from activesteer.measured.circle import judged, steering_wheel_deg, validate_circle
from activesteer.measured.folder_file import MeasuredFile, read_measured
from activesteer.measured.pages import measured_page
from activesteer.resources import find_vehicle
from tests.raising import raises
from tools.tesla_circle import (
    DECISIONS,
    FOLDER,
    PREDICTION,
    QUICK_RATIO,
    STEPS,
    VEHICLE,
    Case,
    changed,
    fall,
    without,
)

KC_OFF = [
    f"{effect}, {axle}"
    for effect in ("toe over side force", "roll steer", "static toe", "camber over side force")
    for axle in ("rear", "front")
    if (effect, axle) != ("static toe", "front")
]
"""Effects that the two-track model of the source does not have; its camber over travel is in the car's curves."""


@pytest.fixture(scope="module")
def file() -> MeasuredFile:
    return read_measured(FOLDER)


def result(file: MeasuredFile, ours: np.ndarray, measured: np.ndarray) -> dict[str, Any]:
    box = np.linspace(80.0, 90.0, 101), np.linspace(110.0, 120.0, 101)
    return judged(file, float(ours.mean()), 0.0, [("ratio", "source", 80.0, 120.0)], [measured, ours, *box]).to_json()


def test_the_area_between_shifted_distributions_is_the_shift(file: MeasuredFile, rng: np.random.Generator) -> None:
    values = rng.normal(94.0, 1.3, 200)
    assert result(file, values + 5.0, values)["area_metric_deg"] == pytest.approx(5.0, abs=1e-9)
    assert result(file, values, values)["area_metric_deg"] == pytest.approx(0.0, abs=1e-9)


def test_distributions_apart_do_not_overlap_and_alike_ones_do(file: MeasuredFile, rng: np.random.Generator) -> None:
    values = rng.normal(94.0, 1.3, 200)
    assert result(file, values + 30.0, values)["overlap"] < 1e-3
    assert result(file, values, values)["overlap"] == pytest.approx(1.0, abs=0.01)


def test_the_tolerance_is_that_of_iso_19364(file: MeasuredFile) -> None:
    measured = np.array([99.0, 101.0])
    assert result(file, measured + 7.9, measured)["inside"]
    assert not result(file, measured + 8.1, measured)["inside"]


def test_too_few_samples_are_an_error(file: MeasuredFile) -> None:
    with raises(ParameterError, key="samples"):
        validate_circle(file, 5)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("radius_m = 30.0", "radius_m = -30.0", "circle.radius_m"),
        (
            "93.7879010565951, 93.3886776207234, 97.4933780151733, 91.0079809633492,",
            '"a",',
            "circle.steering_wheel_deg",
        ),
        ('spread = { "factors.mass"', 'spread = { "factors.mas"', "circle.spread.factors.mas"),
        ("stiff_column = true", "stiff_column = 1", "circle.prediction.stiff_column"),
        ('"curves.front.stiffness" = [\n  4079964.0, ', '"curves.front.stiffness" = [', "circle.prediction"),
        ('"factors.tyre_friction" = 1.05', '"factors.tyre" = 1.05', "intervals.side force of the tyres.low"),
        ("{ radius_m = 30.83 }", "{ radius = 30.83 }", "intervals.point that follows 30 m.low"),
        ("{ radius_m = 30.83 }", '{ radius_m = "a" }', "intervals.point that follows 30 m.low.radius_m"),
        ("low = { body_roll = 1.0 }", "ends = [1.0]", "intervals.tilt of the accelerometer"),
        ("[circle]", '[[runs]]\nname = "a"\nfiles = ["a.csv"]\n\n[circle]', "runs"),
        ("[circle]", "[quantities]\nay_mps2 = {}\n\n[circle]", "quantities"),
        ("[circle]", "[effects]\n\n[circle]", "effects"),
        ('vehicle = "tesla_model_s"', 'vehicle = "compact"', "circle.prediction"),
    ],
)
def test_a_wrong_key_or_value_is_one_error_with_file_and_key(tmp_path: Path, old: str, new: str, key: str) -> None:
    text = (FOLDER / "validation.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "validation.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    with raises(ActiveSteerError, key=key, file="validation.toml") as caught:
        read_measured(tmp_path)
    assert "\n" not in str(caught.value)


def test_two_laps_alike_or_no_spread_make_no_distribution(tmp_path: Path) -> None:
    for laps, spread in (("94.0, 94.0", "ay_mps2 = 0.1"), ("94.0, 95.0", "")):
        circle = f"radius_m = 30.0\nay_mps2 = 5.0\nsteering_wheel_deg = [{laps}]\nspread = {{ {spread} }}\n"
        (tmp_path / "validation.toml").write_text(f'vehicle = "compact"\n[circle]\n{circle}', encoding="utf-8")
        with raises(ActiveSteerError, key="circle"):
            read_measured(tmp_path)


@pytest.mark.slow
def test_a_circle_of_any_car_needs_no_effects_and_its_intervals_may_be_keys(tmp_path: Path) -> None:
    text = (
        'vehicle = "compact"\n[circle]\nradius_m = 40.0\nay_mps2 = 3.0\nsteering_wheel_deg = [80.0, 81.0]\n'
        'spread = { ay_mps2 = 0.1 }\n[intervals]\nradius_m = { ends = [39.0, 41.0], source = "tape" }\n'
        '"factors.front_cornering_stiffness" = { ends = [0.9, 1.1], source = "guess" }\n'
    )
    (tmp_path / "validation.toml").write_text(text, encoding="utf-8")
    found = validate_circle(read_measured(tmp_path), 10, 1)
    by_hand = 2.57 / 40.0 * 16.0  # wheelbase and ratio of some such car, within a half
    numbers = found.numbers
    nominal_deg, box = numbers["ours_deg"]["nominal"], numbers["box"]
    assert nominal_deg == numbers["with_assumptions_deg"] == pytest.approx(math.degrees(by_hand), rel=0.5)
    # A smaller radius and softer front tyres both need more angle: the lower ends of these keys are the upper angles.
    for end, larger in zip(box["intervals"], ("39.0", "0.9"), strict=True):
        assert end["low_deg"] < nominal_deg < end["high_deg"], larger
    assert box["low_deg"] < min(end["low_deg"] for end in box["intervals"])
    assert box["high_deg"] > max(end["high_deg"] for end in box["intervals"])
    lines = "\n".join(measured_page(found).lines())
    assert "factors.front_cornering_stiffness" in lines


def source() -> dict[str, Any]:
    text = (FOLDER / "vehicle.json").read_text(encoding="utf-8")
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


def toe_deg(case: Case, axle: str, side_N: float, aligning_Nm: float) -> float:
    """Return the rotation of the left wheel to the left under forces at the road."""
    table, _ = read_toml(find_vehicle(VEHICLE))
    matrix = np.zeros((5, 5))
    matrix[np.triu_indices(5)] = case.get(f"curves.{axle}.stiffness", table["curves"][axle]["stiffness"])
    moved = np.linalg.solve(matrix + np.triu(matrix, 1).T, [0.0, side_N, 0.335 * side_N, 0.0, aligning_Nm])
    return float(np.degrees(moved[4]))


def test_switching_an_effect_off_changes_no_other_effect(file: MeasuredFile) -> None:
    case = file.on_circle
    for axle, sign in (("front", 1.0), ("rear", -1.0)):
        side, aligning = toe_deg(case, axle, -1e3, 0.0), toe_deg(case, axle, 0.0, 100.0)
        assert side * sign > 0.03, "towards the middle of the car: front toe-out, rear toe-in"
        assert aligning > 0.4
        no_side = without(case, f"toe over side force, {axle}")
        assert toe_deg(no_side, axle, -1e3, 0.0) == pytest.approx(0.0, abs=1e-4)
        assert toe_deg(no_side, axle, 0.0, 100.0) == pytest.approx(aligning, rel=1e-4)
        no_moment = without(case, f"toe over aligning moment, {axle} (assumed)")
        assert toe_deg(no_moment, axle, -1e3, 0.0) == pytest.approx(side, rel=1e-3)
        assert toe_deg(no_moment, axle, 0.0, 100.0) < 0.5 * aligning
        no_camber = without(case, f"camber over side force, {axle}")
        assert toe_deg(no_camber, axle, -1e3, 0.0) == pytest.approx(side, rel=1e-2)
        turned = changed(case, *DECISIONS["elkin_y_toe of both axles reversed (used: understeering)"])
        assert toe_deg(turned, axle, -1e3, 0.0) == pytest.approx(-side, rel=1e-3)


def test_the_file_has_the_numbers_of_the_effects(file: MeasuredFile) -> None:
    circle, intervals = file.table.circle, file.table.intervals
    assert circle is not None
    assert circle.prediction == changed({}, PREDICTION)
    assert circle.prediction == intervals["compliance to aligning moment and of the column"].low
    assert intervals["steering ratio"].low == changed({}, QUICK_RATIO)
    full = file.on_circle
    assert file.changed(full, circle.prediction) == fall(full, len(STEPS) - 3), "all but the assumed steps"
    assert fall(full, len(STEPS) - 1) == full


@pytest.mark.slow
def test_without_changes_of_toe_the_angle_is_that_of_geometry_and_tyres(file: MeasuredFile) -> None:
    """Tyres add some degrees to the Ackermann angle of 87: the front carries more load and more roll moment."""
    assert 88.0 < steering_wheel_deg(VEHICLE, without(file.on_circle, "all six effects on toe")) < 98.0


@pytest.mark.slow
def test_without_lateral_acceleration_the_angle_is_that_of_ackermann(file: MeasuredFile) -> None:
    """A line through two low accelerations must reach 5.64 deg at the wheels (30 m) times the ratio of 15.5."""
    low, high = (steering_wheel_deg(VEHICLE, file.on_circle | {"ay_mps2": ay}) for ay in (0.6, 1.2))
    assert low < high
    assert 2.0 * low - high == pytest.approx(15.48 * math.degrees(math.atan(2.96 / 30.0)), rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mass_kg", "ay_mps2", "theirs_deg"),
    [(2374.0, 5.65, 30.43), (2347.0, 3.01, 28.41), (2863.0, 4.69, 30.45), (2076.0, 6.99, 31.46), (2977.0, 6.87, 32.36)],
)
def test_with_the_settings_of_the_source_the_angle_is_that_of_its_own_model(
    file: MeasuredFile, mass_kg: float, ay_mps2: float, theirs_deg: float
) -> None:
    """Medians of its figure `Framework - TotalUC-ZSMValidation-Concluded.pdf`: 100 m, no toe and no compliance.

    Each median is of four samples with 5 % of tyre force and 0.1 m/s2, which vary by up to 2 %, and the method by which
    the source's driver reaches the circle is not published. The differences of all its sets below 7 m/s2 are -6.8 to
    +5.7 % (docs/measured_cars_data.md), the worst two among these: 7.5 % notices a changed car, it is no target.
    """
    case = without(changed(file.on_circle, PREDICTION), *KC_OFF)
    case |= {"radius_m": 100.0, "ay_mps2": ay_mps2, "factors.mass": mass_kg / 2374.0}
    assert steering_wheel_deg(VEHICLE, case) == pytest.approx(theirs_deg, rel=0.075)


def test_the_box_lies_between_the_ends_of_the_intervals_and_counts_what_is_inside(file: MeasuredFile) -> None:
    box = result(file, np.array([94.0, 95.0]), np.array([80.0, 81.0, 100.0, 119.0, 120.0]))["box"]
    assert (box["low_deg"], box["high_deg"]) == pytest.approx((80.25, 119.75))
    assert box["measured_inside"] == 3
    assert box["measured_deg"] == 100.0


@pytest.mark.slow
def test_a_tilted_accelerometer_shows_more_than_the_horizontal_acceleration(file: MeasuredFile) -> None:
    """By hand: a cos(phi) + g sin(phi) = 5.65 with phi = 0.0458 rad * a / 5.65 gives 5.24 m/s2."""
    full = file.on_circle
    change = file.table.intervals["tilt of the accelerometer"].low
    tilted = steering_wheel_deg(VEHICLE, file.changed(full, change), 0.0458 / 5.65)
    assert tilted == pytest.approx(steering_wheel_deg(VEHICLE, full | {"ay_mps2": 5.238}), abs=0.01)


@pytest.mark.slow
def test_without_the_assumed_compliances_the_angle_is_smaller_and_a_quicker_ratio_makes_it_smaller_still(
    file: MeasuredFile,
) -> None:
    main = changed(file.on_circle, PREDICTION)
    quick = file.changed(main, file.table.intervals["steering ratio"].low)
    angles = [steering_wheel_deg(VEHICLE, each) for each in (quick, main, file.on_circle)]
    assert angles[2] - angles[1] == pytest.approx(8.2, abs=0.3)  # 10.4 - 5.3 + 3.1 deg
    # The wheels need the same angle, so the steering wheel turns less in proportion to the ratio.
    assert angles[0] == pytest.approx(angles[1] * 14.27 / 15.48, rel=0.01)

"""The measured double lane change of the BMW M8: import, prediction, and what a wrong file says."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import activesteer
from activesteer.errors import ActiveSteerError
from activesteer.measured.folder import validate_measured
from activesteer.measured.folder_file import measured_folder, read_measured, write_template
from activesteer.measured.importing import import_file
from activesteer.measured.pages import measured_page
from activesteer.measured.signals import at_sensor
from activesteer.pages import render_page
from activesteer.recording import Recording
from activesteer.resources import models_dir
from tests.raising import raises

FOLDER = models_dir() / "reference" / "bmw_m8"
FILES = [FOLDER / f"double_lane_change_{who}.csv" for who in ("car", "driver")]


@pytest.fixture(scope="module")
def measured() -> Recording:
    return import_file(FILES, FOLDER / "map.toml")


def test_the_files_are_imported_with_the_scale_of_the_steering_as_the_only_doubt(measured: Recording) -> None:
    notes = import_file(FILES, FOLDER / "map.toml").metadata["measured"]["notes"]
    assert [note for note in notes if "time begins" not in note] == [
        note for note in notes if "has another scale" in note
    ]
    assert len(notes) == 2
    # Values of the README, read from the files by hand.
    assert np.abs(measured["yaw_rate_radps"]).max() == pytest.approx(0.32, abs=0.005)
    assert 5.6 < np.abs(measured["ay_mps2"]).max() < 6.25
    assert measured.time_s[-1] == pytest.approx(7.3, abs=0.03)


def test_acceleration_and_lateral_speed_are_of_one_point_without_gravity(measured: Recording) -> None:
    # If the acceleration contained g sin(roll), the residual would follow the roll angle: 0.3 m/s2 of it.
    step = float(measured.time_s[1])
    smooth = {name: np.convolve(measured[name], np.hanning(21) / np.hanning(21).sum(), "same")
              for name in ("ay_mps2", "vy_mps", "vx_mps", "yaw_rate_radps", "roll_rad")}  # fmt: skip
    own = np.gradient(smooth["vy_mps"], step) + smooth["vx_mps"] * smooth["yaw_rate_radps"]
    rest = (smooth["ay_mps2"] - own)[20:-20]
    roll = 9.81 * smooth["roll_rad"][20:-20]
    assert rest.std() < 0.03
    assert abs(rest @ roll / (roll @ roll)) < 0.1


def test_motion_at_the_sensor_is_that_of_a_rigid_body() -> None:
    steering = {"time_s": [0.2, 0.4, 0.8, 1.0], "steering_wheel_deg": [0, 40, 40, -40]}
    table = {"kind": "open_loop", "speed_kmh": 70.0, "duration_s": 1.5, "hold_last": True, "steering": steering}
    run = activesteer.simulate(table, overrides={"sensor_ahead_m": 1.2})
    there = at_sensor(run)
    x = run["x_m"] + 1.2 * np.cos(run["yaw_rad"])
    y = run["y_m"] + 1.2 * np.sin(run["yaw_rad"])
    vx, vy = np.gradient(x, run.time_s), np.gradient(y, run.time_s)
    across = -np.sin(run["yaw_rad"]) * vx + np.cos(run["yaw_rad"]) * vy
    np.testing.assert_allclose(there["vy_mps"][5:-5], across[5:-5], atol=5e-3)
    assert np.abs(run["vy_mps"] - there["vy_mps"]).max() > 0.1
    assert at_sensor(activesteer.simulate("straight_line", overrides={"duration_s": 0.1})).metadata["maneuver"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("double_lane_change_car.csv", "double_lane_change_driver.csv", "map.toml", "validation.toml"):
        shutil.copy(FOLDER / name, tmp_path / name)
    return tmp_path


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('vehicle = "bmw_m8"', 'vehicle = "bmw_m9"', "vehicle"),
        ('"double_lane_change_car.csv"', '"lane.csv"', "runs.0.files"),
        ('map = "map.toml"', 'map = "maps.toml"', "runs.0.map"),
        ("fit_s = [9.5, 12.5]", "fit_s = [12.5, 9.5]", "runs.0.fit_s"),
        ("yaw_rate_degps = { noise", "yaw_rat_degps = { noise", "quantities.yaw_rat_degps"),
        ("roll_deg = { noise = 0.1", "roll_deg = { noise = -0.1", "quantities.roll_deg.noise"),
        ("roll_deg = { noise", "roll_rate_degps = { noise", "quantities.roll_rate_degps"),
        ('"steering.factor" = { uniform', '"steering.facto" = { uniform', "factors.steering.facto"),
        ('"steering.factor" = { uniform', '"steering.factor" = { grid', "factors.steering.factor"),
        ("ends = [0.9, 1.1]", "ends = [1.1, 0.9]", "intervals.factors.tyre_friction"),
        ('"factors.yaw_inertia"', '"factors.yaw_inerti"', "factors.factors.yaw_inerti"),
        ('"powertrain.front_fraction"', '"powertrain.front"', "intervals.powertrain.front"),
        ("filter", "filters", "filters"),
    ],
)
def test_a_wrong_key_or_value_is_one_error_with_file_and_key(folder: Path, old: str, new: str, key: str) -> None:
    path = folder / "validation.toml"
    text = path.read_text(encoding="utf-8")
    text = text.replace(old, new, 1) if old in text else f'{new} = "iso15037"\n{text}'
    path.write_text(text, encoding="utf-8")
    with raises(ActiveSteerError, key=key, file="validation.toml") as caught:
        read_measured(folder)
    assert "\n" not in str(caught.value)


def test_a_file_that_nothing_could_fail_is_an_error(folder: Path) -> None:
    path = folder / "validation.toml"
    text = path.read_text(encoding="utf-8")
    for pattern, key in ((r"^check_s = .*$", "runs"), (r"^\[quantities\]\n(?:[^\[\n].*\n)+", "quantities")):
        shorter = re.sub(pattern, "", text, flags=re.MULTILINE)
        assert shorter != text
        path.write_text(shorter, encoding="utf-8")
        with raises(ActiveSteerError, key=key, file="validation.toml"):
            read_measured(folder)


def test_a_window_outside_the_imported_part_is_an_error(folder: Path) -> None:
    path = folder / "validation.toml"
    path.write_text(path.read_text(encoding="utf-8").replace("[12.5, 15.2]", "[12.5, 15.9]"), encoding="utf-8")
    with raises(ActiveSteerError, key="runs.0.check_s", file="validation.toml"):
        validate_measured(read_measured(folder), 1)


def test_a_folder_without_the_file_is_an_error(tmp_path: Path) -> None:
    assert measured_folder("bmw_m8") == FOLDER
    with raises(ActiveSteerError, value="sedan"):
        measured_folder("sedan")
    with raises(ActiveSteerError, value=str(tmp_path)):
        measured_folder(str(tmp_path))
    with raises(ActiveSteerError, value=str(tmp_path / "none")):
        measured_folder(str(tmp_path / "none"))


def test_the_example_is_complete_and_is_never_written_over(tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    files = write_template(folder)
    assert {path.name for path in files} == {"run.csv", "map.toml", "validation.toml"}
    file = read_measured(folder)
    assert set(file.tolerances) == {"yaw_rate_radps", "ay_mps2"}
    run = import_file(folder / "run.csv", folder / "map.toml")
    assert run.metadata["measured"]["notes"] == []
    with raises(ActiveSteerError, value=str(folder)):
        write_template(folder)


@pytest.mark.slow
def test_the_example_finds_the_parameters_of_its_car_and_predicts_the_second_lane_change(tmp_path: Path) -> None:
    write_template(tmp_path / "mine")
    result = validate_measured(read_measured(tmp_path / "mine"), 1)
    assert result.inside
    assert result.fitted is not None
    truth = {"steering.factor": 1.25, "factors.front_cornering_stiffness": 0.9}
    for one in result.fitted.parameters:
        assert abs(one.value - truth[one.key]) < 1.5 * one.half_width  # one noise, 95 % intervals
    page = render_page(measured_page(result))
    assert page.count('<div class="plots"') == 4
    assert "The road is level and dry." in page
    assert {row["part"] for row in result.to_json()["quantities"]} == {"fit", "check"}


@pytest.mark.slow
def test_the_fitted_m8_predicts_the_second_lane_change_better_than_the_first_guess(folder: Path) -> None:
    path = folder / "validation.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: text.index("[intervals]")], encoding="utf-8")
    result = validate_measured(read_measured(folder), 1)
    checked = {(one.stage, one.compared.channel): one.compared for one in result.parts if one.part == "check"}
    # As written in docs/measured_cars.md.
    assert checked["predicted", "yaw_rate_radps"].share_inside == pytest.approx(0.96, abs=0.02)
    assert not checked["predicted", "roll_rad"].inside
    assert checked["fitted", "yaw_rate_radps"].inside
    assert checked["fitted", "ay_mps2"].inside
    assert not result.inside  # the roll angle

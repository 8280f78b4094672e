"""Cars of a user's own: what estimators know of them comes from drives, and every built-in controller drives them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from activesteer import simulate
from activesteer.analysis.harm import LOST_SIDESLIP_RAD
from activesteer.commands.cli import main
from activesteer.controllers import CONTROLLER
from activesteer.errors import ControllerError
from activesteer.resources import find_vehicle, models_dir
from activesteer.scenario import load_car
from activesteer.simulation.runner import run_scenario
from activesteer.simulation.two_track_search import _roll, _roll_arm, two_track_lines, two_track_of
from activesteer.standards.examination import examine
from activesteer.studies.linear.margins import loop_margins
from tests.raising import raises

SHORT = {"settle_s": 0.2, "duration_s": 0.5, "steer.start_s": 0.05}
NEEDS_MOTORS = "tv"
"""Controller for cars with electric axles that split the torque; it refuses other cars."""
CALM_RAD = math.radians(5.0)
"""Sideslip angle up to which a controller need not have less than none."""
NAMES = [name for name in CONTROLLER.names() if name != NEEDS_MOTORS]
WITHOUT_STEERING = {"none", "observer", "esc"}
"""Controllers without a steering loop."""


@pytest.fixture(scope="module")
def hardpoints(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hardpoints") / "mine"
    assert (
        main(["vehicle", "new", "mine", "--table", str(models_dir() / "tables/wishbone.csv"), "-o", str(folder)]) == 0
    )
    return folder / "mine.toml"


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("measured") / "mine"
    rig = models_dir() / "reference/tesla_model_s/kc"
    assert main(["vehicle", "new", "mine", "--kc", str(rig), "-o", str(folder)]) == 0
    return folder / "mine.toml"


@pytest.fixture(scope="module")
def other_tyres(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the compact with the tyres of the Tesla, and with what a drive of this car says."""
    path = tmp_path_factory.mktemp("tyres") / "mine.toml"
    text = find_vehicle("compact").read_text(encoding="utf-8")
    path.write_text(text.replace("compact_205_55R16.tir", "tesla_245_45R19.tir"), encoding="utf-8")
    assert main(["identify", "--vehicle", str(path), "--write"]) == 0
    return path


def drive_all(vehicle: Path, maneuver: str, overrides: dict[str, float]) -> None:
    peaks_rad = {}
    for name in NAMES:
        run = simulate(maneuver, name, vehicle, overrides)
        assert np.isfinite(run["yaw_rate_radps"]).all(), name
        peaks_rad[name] = np.abs(run["sideslip_rad"]).max()
        assert name in ("none", "observer") or peaks_rad[name] <= max(peaks_rad["none"], CALM_RAD), name
        assert name in ("none", "observer") or peaks_rad[name] < LOST_SIDESLIP_RAD, name


def test_every_controller_drives_a_car_from_hardpoints(hardpoints):
    drive_all(hardpoints, "step_steer", SHORT)
    with raises(ControllerError, key="motors"):
        simulate("step_steer", NEEDS_MOTORS, hardpoints, SHORT)


def test_two_track_properties_are_those_of_earlier_tests():
    """The compact's file has values of slalom, lane change, step steer and full braking, fitted by hand."""
    known, found = load_car("compact").config.two_track, two_track_of("compact", run_scenario)
    assert known is not None
    assert found.load_height_m == pytest.approx(known.load_height_m, rel=0.02)
    assert found.front_track_m == pytest.approx(known.front_track_m, abs=0.003)
    assert found.rear_track_m == pytest.approx(known.rear_track_m, abs=0.003)
    assert found.front_load_transfer_fraction == pytest.approx(known.front_load_transfer_fraction, abs=0.01)
    assert found.roll_gradient_radpmps2 == pytest.approx(known.roll_gradient_radpmps2, rel=0.02)
    assert found.roll_frequency_Hz == pytest.approx(known.roll_frequency_Hz, rel=0.05)
    assert found.roll_damping == pytest.approx(known.roll_damping, abs=0.06)
    # The file has the excess of load_height_m over the height of the centre of gravity, over the roll angle per g.
    assert found.front_roll_arm_m == pytest.approx(known.front_roll_arm_m, rel=0.1)
    assert found.rear_roll_arm_m == pytest.approx(known.rear_roll_arm_m, rel=0.1)
    assert found.pitch_gradient_radpmps2 == pytest.approx(known.pitch_gradient_radpmps2, rel=0.2)
    assert found.wheel_inertia_kgm2 == pytest.approx(known.wheel_inertia_kgm2, rel=0.01)
    # The written table rounds to 1 mm and to 1e-5 rad/(m/s2), 0.3 % of the gradients.
    for key, text in two_track_lines(found).items():
        assert float(text) == pytest.approx(vars(found)[key], abs=0.6e-5 if "gradient" in key else 0.6e-3), key


def test_frequency_and_damping_of_a_known_roll_are_found():
    time_s = np.arange(0.0, 5.0, 1e-3)
    ay = np.where(time_s < 2.5, 2.0, -2.0)
    speed, damping, gradient = 2.0 * math.pi * 1.7, 0.35, 0.01
    _, roll, _ = lsim(([gradient * speed**2], [1.0, 2.0 * damping * speed, speed**2]), ay - ay[0], time_s)
    assert _roll(ay, np.asarray(roll), gradient, 1e-3) == pytest.approx((1.7, 0.35), rel=0.01)


@pytest.mark.parametrize(("arm_m", "relaxation_m"), [(0.47, 0.5), (-0.03, 0.02)])
def test_the_arm_of_an_axle_whose_tyres_lag_is_found(arm_m, relaxation_m):
    time_s, speed_mps = np.arange(0.0, 5.0, 1e-3), 22.0
    roll = 0.02 * np.sin(2.0 * math.pi * 1.2 * time_s) * np.exp(-0.3 * time_s)
    rate_radpm = np.gradient(roll, time_s) / speed_mps
    unrolled = np.where(time_s < 2.5, 0.02, -0.02)
    inputs = unrolled - arm_m * rate_radpm + 0.01 * roll + 0.001
    _, slip, _ = lsim(([1.0], [relaxation_m / speed_mps, 1.0]), inputs - inputs[0], time_s)
    found_m = _roll_arm(np.asarray(slip) + inputs[0], unrolled, roll, rate_radpm, speed_mps * 1e-3)
    # The fit holds its inputs for a sample of 0.022 m, `lsim` interpolates them: 0.002 m.
    assert found_m == pytest.approx(arm_m, abs=0.005)


@pytest.mark.parametrize("vehicle", ["sedan", pytest.param("tesla_model_s", marks=pytest.mark.slow)])
def test_arms_in_a_vehicle_file_are_those_of_a_step(vehicle):
    """The sedan had 0.469 m, the arm of its contact points. Its tyres feel the slip of their wheel centres."""
    known, found = load_car(vehicle).config.two_track, two_track_of(vehicle, run_scenario)
    assert known is not None
    for axle in ("front", "rear"):
        assert getattr(found, f"{axle}_roll_arm_m") == pytest.approx(getattr(known, f"{axle}_roll_arm_m"), abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hardpoints", "measured", "other_tyres"])
def test_every_controller_drives_every_own_car(name, request):
    vehicle = request.getfixturevalue(name)
    drive_all(vehicle, "step_steer", {})
    drive_all(vehicle, "sine_with_dwell", {})
    seen = simulate("slalom", "observer", vehicle)
    error = seen["estimated_sideslip_rad"] - seen["sideslip_rad"]
    assert np.sqrt(np.mean(error**2)) < math.radians(0.5)
    steering = [name for name in NAMES if name not in WITHOUT_STEERING]
    assert all(each.margins.disk > 0.3 for each in loop_margins(steering, vehicle, [100.0]))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hardpoints", "measured", "other_tyres"])
def test_standard_gives_a_verdict_on_every_own_car(name, request):
    found = examine("fmvss126", ["lqr"], str(request.getfixturevalue(name)), jobs=2).findings["lqr"]
    assert found.passed is not None
    assert not found.error


@pytest.mark.slow
def test_tesla_of_the_package_has_what_every_controller_needs():
    drive_all(find_vehicle("tesla_model_s"), "step_steer", {})

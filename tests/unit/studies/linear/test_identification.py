"""Results of an identification: table, JSON, vehicle file, and the single-track model beside a run."""

from __future__ import annotations

import json
import math
import shutil

import numpy as np
import pytest

from activesteer.config import read_toml
from activesteer.controllers import SingleTrackParameters
from activesteer.core.files import json_text
from activesteer.resources import find_vehicle
from activesteer.scenario import load_car
from activesteer.studies.linear.identification import Identification, single_track_response, write_identified
from activesteer.theory.single_track import SingleTrack, TwoTrackParameters
from tests.unit.analysis.synthetic import step_steer

DEGPG = math.radians(1.0) / 9.81
PARAMETERS = SingleTrackParameters(1400.0, 2100.0, 1.1, 1.5, 90e3, 140e3, 23.0)
HANDLING = dict(
    understeer_gradient_radpmps2=2.5 * DEGPG,
    steer_gradient_radpmps2=5.0 * DEGPG,
    ackermann_gradient_radpmps2=2.5 * DEGPG,
    linear_range_mps2=4.0,
    characteristic_speed_mps=30.0,
    roll_gradient_radpmps2=4.0 * DEGPG,
    sideslip_gradient_radpmps2=-2.0 * DEGPG,
    front_slip_gradient_radpmps2=4.5 * DEGPG,
    rear_slip_gradient_radpmps2=2.0 * DEGPG,
    yaw_rate_gain_1ps=math.nan,
    steering_wheel_gain_mps2prad=math.nan,
    limit_acceleration_mps2=8.0,
)
TWO_TRACK = TwoTrackParameters(0.6, 1.51, 1.52, 0.55, 0.009, 2.0, 0.3, 0.4, 0.38, 0.005, 1.1)
RESULT = Identification("made up", {"100 m": HANDLING}, PARAMETERS, TWO_TRACK)


def test_json_is_in_display_units_and_leaves_out_what_is_not_defined():
    document = json.loads(json_text(RESULT.to_json()))
    metrics = {metric["name"]: metric for metric in document["metrics"]}
    assert metrics["understeer_gradient"]["value"] == pytest.approx(2.5)
    assert metrics["understeer_gradient"]["unit"] == "deg/g"
    assert metrics["characteristic_speed"]["value"] == pytest.approx(108.0)
    assert "yaw_rate_gain" not in metrics
    assert document["single_track"]["mass_kg"] == 1400.0


def test_table_shows_tests_and_parameters():
    lines = RESULT.table().splitlines()
    assert lines[0].split() == ["100", "m"]
    assert any(line.split() == ["understeer", "gradient", "deg/g", "2.500"] for line in lines)
    assert "characteristic_speed_kmh = 82.80" in lines


def test_vehicle_file_takes_the_parameters(tmp_path):
    path = tmp_path / "mine.toml"
    shutil.copy(find_vehicle("compact"), path)
    write_identified(path, RESULT, "activesteer identify --vehicle mine.toml", "2026-11-21")
    found = load_car(path).config
    assert found.single_track.front_stiffness_Nprad == 90e3
    assert found.single_track.characteristic_speed_mps == pytest.approx(23.0)
    assert found.two_track == TWO_TRACK
    others = dict.fromkeys(("single_track", "two_track"))
    assert read_toml(path)[0] | others == read_toml(find_vehicle("compact"))[0] | others


def test_single_track_model_beside_a_run_ends_at_its_steady_state():
    run = step_steer()
    run.channels["superposition_rad"] = np.zeros_like(run.time_s)
    found = single_track_response(run, PARAMETERS, 16.0)["yaw_rate_radps"]
    assert found.shape == run.time_s.shape
    gain = np.linalg.solve(
        *[sign * part for sign, part in zip((-1, 1), SingleTrack(PARAMETERS).matrices(22.0), strict=True)]
    )
    assert found[0] == 0.0
    assert found[-1] == pytest.approx(gain[0, 0] / 16.0, rel=1e-3)

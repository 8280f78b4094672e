"""Parameters from recordings: known values are inside their intervals; errors are reported before driving."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer.config import read_toml
from activesteer.errors import ActiveSteerError, StudyError
from activesteer.measured.fitting import fit
from activesteer.measured.pages import write_fit
from activesteer.recording import Recording
from tests.raising import raises

TRUTH = {"factors.tyre_cornering_stiffness": 0.9, "factors.yaw_inertia": 1.15}
NOISE = {"yaw_rate_radps": math.radians(0.2), "ay_mps2": 0.1}
STUDY: dict[str, Any] = {
    "maneuvers": ["a.mcap"],
    "overrides": {"settle_s": 0.3},
    "factors": {key: {"uniform": [0.6, 1.6]} for key in TRUTH},
    "fit": {"noise": {"yaw_rate_degps": 0.2, "ay_mps2": 0.1}},
}


def step_to_either_side() -> Recording:
    """Return a run with known parameters."""
    table = {
        "kind": "open_loop", "speed_kmh": 80.0, "duration_s": 1.6, "settle_s": 0.3, "hold_last": True,
        "steering": {"time_s": [0.1, 0.3, 0.7, 1.0], "steering_wheel_deg": [0.0, 40.0, 40.0, -40.0]},
    }  # fmt: skip
    return activesteer.simulate(table, overrides=TRUTH)


@pytest.fixture(scope="module")
def truth() -> Recording:
    return step_to_either_side()


def noisy(truth: Recording, path: Path, seed: int, **offsets: float) -> None:
    """Write the channels of a data logger, every 10 ms with noise and offsets; the inputs have 0.1 deg and 0.1 km/h
    of noise.
    """
    rng = np.random.default_rng(seed)
    rows = slice(None, None, 10)
    noise = {"steering_wheel_rad": math.radians(0.1), "speed_mps": 0.1 / 3.6, **NOISE}
    noise |= dict.fromkeys(offsets, math.radians(0.1))
    values = [
        truth[name][rows] + offsets.get(name, 0.0) + size * rng.standard_normal(len(truth.time_s[rows]))
        for name, size in noise.items()
    ]
    Recording([truth.channels[name] for name in noise], truth.time_s[rows], np.column_stack(values)).save(path)


@pytest.fixture
def folder(truth, tmp_path, monkeypatch) -> Path:
    noisy(truth, tmp_path / "a.mcap", 4)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_known_values_lie_in_their_intervals_and_are_written(folder):
    rounds = []
    found = fit(STUDY, jobs=1, progress=lambda *told: rounds.append(told))
    assert found.settled
    assert found.notes == ()
    for one in found.parameters:
        assert abs(one.value - TRUTH[one.key]) < one.half_width
        assert 0.002 < one.half_width < 0.1
    assert found.misfit == pytest.approx(1.0, abs=0.1)
    assert 0.1 < abs(found.correlations[0, 1]) < 0.99
    for each in found.compared:
        assert each.to_json()["rms"] == pytest.approx(NOISE[each.channel], rel=0.15)
        assert np.mean(each.before**2) > 1.3 * np.mean(each.after**2)
    assert rounds[-1][1:3] == (3, 3)  # done of all
    assert found.runs == 3 * found.rounds == len(rounds)

    assert [path.name for path in write_fit(found, "fit", folder / "out")] == ["fit.json", "overrides.toml", "fit.html"]
    assert read_toml(folder / "out" / "overrides.toml")[0] == {one.key: one.value for one in found.parameters}
    assert 'data-picture="0"' in (folder / "out" / "fit.html").read_text()


def test_the_offset_of_a_sensor_is_said_and_can_be_a_parameter(truth, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    noisy(truth, tmp_path / "a.mcap", 4, roll_rad=math.radians(-0.5))
    noise = {"yaw_rate_degps": 0.2, "roll_deg": 0.1}
    study = {**STUDY, "overrides": {**STUDY["overrides"], **TRUTH}, "fit": {"noise": noise}}
    factors = {"factors.anti_roll_bar": {"uniform": [0.6, 1.6]}}
    (note,) = (note for note in fit({**study, "factors": factors}, jobs=1).notes if "constant offset" in note)
    assert "roll angle in a" in note
    assert "zero_until_s of roll_rad" in note
    assert note.endswith("make sensor_offset.roll_deg a factor")  # the unit of the residual
    assert float(note.partition("simulated is ")[2].split()[0]) == pytest.approx(-0.5, abs=0.1)

    found = fit({**study, "factors": {"sensor_offset.roll_deg": {"uniform": [-2.0, 2.0]}}}, jobs=1)
    assert found.notes == ()
    assert found.parameters[0].value == pytest.approx(-0.5, abs=0.02)


def test_a_parameter_at_the_end_of_a_range_that_is_too_narrow_is_said(folder):
    found = fit({**STUDY, "factors": {"factors.yaw_inertia": {"uniform": [0.9, 1.0]}}}, jobs=1)
    assert found.parameters[0].at_end
    assert math.isnan(found.parameters[0].half_width)
    assert any("factors.yaw_inertia is at an end of its range" in note for note in found.notes)
    assert found.to_json()["parameters"]["factors.yaw_inertia"]["at_end"] is True


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"fit": {"noise": {}}}, "fit.noise"),
        ({"fit": {"noise": {"yaw_rate_dgps": 0.2}}}, "fit.noise.yaw_rate_dgps"),
        ({"fit": {"noise": {"roll_deg": 0.2}}}, "fit.noise.roll_deg"),
        ({"fit": {"noise": {"ay_mps2": 0.0}}}, "fit.noise.ay_mps2"),
        ({"fit": {"noise": {"yaw_rate_degps": 1, "yaw_rate_radps": 1}}}, "fit.noise.yaw_rate_radps"),
        ({"fit": {**STUDY["fit"], "from_s": 1.5}}, "yaw_rate_radps"),
        ({"fit": {**STUDY["fit"], "start": {"factors.yaw_inertia": 3.0}}}, "fit.start.factors.yaw_inertia"),
        ({"fit": {**STUDY["fit"], "start": {"mass": 1.0}}}, "fit.start.mass"),
        ({"factors": {}}, "factors"),
        ({"factors": {"factors.mass": {"grid": [0.9, 1.1]}}}, "factors.factors.mass.grid"),
        ({"factors": {"factors.mas": {"uniform": [0.9, 1.1]}}}, "factors.mas"),
        ({"factors": {"driver.preview_s": {"uniform": [0.9, 1.1]}}}, "factors.driver.preview_s"),
        ({"controllers": ["none", "ars"]}, "controllers"),
        ({"maneuvers": ["step_steer"]}, "maneuvers"),
        ({"maneuvers": ["b.mcap"]}, None),  # a file that is not there
    ],
)
def test_what_is_wrong_is_said_before_anything_is_driven(folder, change, key):
    driven = []
    with raises(ActiveSteerError, key=key):
        fit({**STUDY, **change}, jobs=1, progress=lambda *told: driven.append(told))
    assert driven == []


def test_a_study_without_the_table_is_no_fit():
    with raises(StudyError, key="fit"):
        fit({key: value for key, value in STUDY.items() if key != "fit"}, jobs=1)


def test_a_factor_that_no_channel_shows_is_named_after_the_first_round(folder):
    factors = {**STUDY["factors"], "driver.speed_gain_1ps": {"uniform": [8.0, 8.001]}}
    with raises(StudyError, key="factors.driver.speed_gain_1ps"):
        fit({**STUDY, "factors": factors}, jobs=1)


@pytest.mark.slow
def test_of_20_intervals_16_at_least_hold_the_truth(truth, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    held = dict.fromkeys(TRUTH, 0)
    for seed in range(20):
        noisy(truth, tmp_path / "a.mcap", seed)
        for one in fit(STUDY, jobs=1).parameters:
            held[one.key] += abs(one.value - TRUTH[one.key]) < one.half_width
    assert min(held.values()) >= 16


def test_factors_that_only_count_together_are_named_after_the_first_round(folder):
    # At one speed the desired yaw rate is a number times the steering wheel's angle, whatever goes into that number.
    factors = {
        "vehicle.single_track.characteristic_speed_kmh": {"uniform": [84.0, 90.0]},
        "vehicle.single_track.cg_to_front_m": {"uniform": [1.05, 1.11]},
    }
    overrides = {**STUDY["overrides"], "vehicle.controllers.ars.prediction_gain": 0.0}
    with raises(StudyError, key=f"factors.{next(iter(factors))}", value=list(factors)):
        fit({**STUDY, "controllers": ["ars"], "overrides": overrides, "factors": factors}, jobs=1)

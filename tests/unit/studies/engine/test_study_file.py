"""Study files: reading, checks, writing."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from activesteer.errors import ActiveSteerError, StudyError
from activesteer.resources import studies_dir
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.study_file import read_study
from tests.raising import raises

STEP = {"maneuvers": ["step_steer"], "factors": {"road.mu": {"grid": [0.8, 1.0]}}}


LARGE = {"around_paper_setting", "around_paper_setting_wide", "comparison", "match_paper", "no_harm", "population"}
"""Studies of thousands of runs, each of which is checked; `no_harm_uneven` has a part of the factors of `no_harm`."""
STUDIES = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if path.stem in LARGE else [])
    for path in sorted(studies_dir().glob("*.toml"))
]


@pytest.mark.parametrize("path", STUDIES)
def test_every_study_that_comes_along_can_be_begun(path: Path):
    study = read_study(path)
    assert len(Plan(study)) > 0
    again = read_study(tomllib.loads(study.to_toml()))
    assert again.to_table() == study.to_table()
    assert again.samples() == study.samples()


def test_paths_in_a_file_begin_at_its_folder(tmp_path, monkeypatch):
    folder = tmp_path / "studies"
    folder.mkdir()
    (folder / "study.toml").write_text(
        'maneuvers = ["own.toml"]\nvehicles = ["../car.toml"]\ncontrollers = ["mine.py:Mine?gain=2", "none"]\n'
        '[design]\ncases = "cases.csv"\n'
    )
    (folder / "cases.csv").write_text("road.mu\n0.8\n")
    monkeypatch.chdir(tmp_path)
    study = read_study("studies/study.toml")
    assert study.maneuvers == (str(folder / "own.toml"),)
    assert study.vehicles == (str(tmp_path / "car.toml"),)
    assert study.controllers == (f"{folder}/mine.py:Mine?gain=2", "none")


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"manoeuvres": []}, "manoeuvres"),
        ({"maneuvers": []}, "maneuvers"),
        ({"maneuvers": [3]}, "maneuvers"),
        ({"controllers": "none,ars", "vehicles": 3}, "vehicles"),
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "seed"),
        ({"timestep_s": 0.0}, "timestep_s"),
        ({"recordings": "some"}, "recordings"),
        ({"recordings": {"every": 0}}, "recordings"),
        ({"overrides": 3}, "overrides"),
        ({"overrides": {"road.mu": 0.9}}, "overrides.road.mu"),
        ({"claims": 1}, "claims"),
        ({"factors": 3}, "factors"),
        ({"factors": {"road.mu": 0.9}}, "factors.road.mu"),
    ],
)
def test_a_wrong_key_or_value_is_refused_with_its_key(change, key):
    with pytest.raises(StudyError) as caught:
        read_study({**STEP, **change})
    assert caught.value.key == key


def test_a_wrong_factor_is_told_with_its_line(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('maneuvers = ["step_steer"]\n\n[factors]\n"road.mu" = { unifrom = [0, 1] }\n')
    with pytest.raises(StudyError) as caught:
        read_study(path)
    assert (caught.value.file, caught.value.line) == ("study.toml", 4)


@pytest.mark.parametrize(
    "change",
    [
        {"factors": {"road.my": {"grid": [0.8, 1.0]}}},
        {"factors": {"road.mu": {"uniform": [0.8, 99.0]}}, "design": {"samples": 4}},
        {"factors": {"road.mu": {"grid": [0.8, "ice"]}}},
        {"design": {"cases": [{"road.mu": 0.8}, {"road.mu": 99.0}]}, "factors": {}},
        {"overrides": {"spede_kmh": 80}},
        {"maneuvers": ["step_stear"]},
        {"vehicles": ["compcat"]},
        {"controllers": ["arse"]},
        {"driver": "novise"},
        {"driver": 5},
        {"controllers": ["nowhere.py:Mine"]},
        {"maneuvers": ["step_steer", "step_steer"]},
        {"claims": True},
        # keys that change nothing
        {"factors": {"controllers.ars.limit_deg": {"grid": [2.0, 3.0]}}},
        {"factors": {"controllers.afs.limit_deg": {"grid": [2.0, 3.0]}}, "controllers": ["none", "ars"]},
        {"factors": {"controllers.desired_yaw_rate.delay_s": {"grid": [0.05, 0.06]}}},
        {"factors": {"controllers.servos.lag_s": {"grid": [0.02, 0.03]}}, "controllers": ["none", "esc"]},
        {"overrides": {"controllers.afs.limit_deg": 2.0}, "controllers": ["none", "ars"]},
        {"factors": {"single_track.yaw_inertia_kgm2": {"grid": [2000.0, 2100.0]}}},
        {"factors": {"driver.preview_s": {"grid": [1.0, 1.5]}}},
        {"factors": {"maneuver.title": {"grid": ["a", "b"]}}},
        {"factors": {"speed_kmh": {"grid": [70.0, 80.0]}, "speed_mps": {"grid": [20.0, 22.0]}}},
    ],
)
def test_keys_are_checked_before_anything_runs(change, monkeypatch):
    monkeypatch.setattr("activesteer.simulation.closed_loop.ClosedLoop.__init__", lambda *_: pytest.fail("it runs"))
    with pytest.raises(ActiveSteerError):
        Plan(read_study({**STEP, **change}))


def test_a_key_that_one_of_the_runs_reads_is_taken():
    for change in (
        {"factors": {"controllers.ars.limit_deg": {"grid": [2.0, 3.0]}}, "controllers": ["none", "ars"]},
        {"factors": {"controllers.servos.lag_s": {"grid": [0.02, 0.03]}}, "controllers": ["none", "lqr"]},
        {"factors": {"controllers.bus_delay_s": {"grid": [0.0, 0.01]}}, "controllers": ["afs"]},
        {"overrides": {"controllers.afs.limit_deg": 2.0}, "controllers": ["ars", "afs"]},
        {"factors": {"driver.preview_s": {"grid": [1.0, 1.5]}}, "maneuvers": ["step_steer", "slalom"]},
        {"factors": {"driver.speed_gain_1ps": {"grid": [2.0, 3.0]}}},
    ):
        assert len(Plan(read_study({**STEP, **change}))) >= 2


def test_keys_of_cases_may_only_make_sense_together():
    ends = [{"sweep.first_Hz": 0.1, "sweep.last_Hz": 0.5}, {"sweep.first_Hz": 1.0, "sweep.last_Hz": 4.0}]
    assert len(Plan(read_study({"maneuvers": ["sine_sweep"], "design": {"cases": ends}}))) == 2
    ends[1]["sweep.last_Hz"] = 0.9
    with raises(ActiveSteerError, key="sweep.last_Hz"):
        Plan(read_study({"maneuvers": ["sine_sweep"], "design": {"cases": ends}}))


def test_the_runs_are_every_combination_and_samples_stay_together():
    plan = Plan(read_study({**STEP, "controllers": ["none", "ars"], "vehicles": ["compact", "sedan"]}))
    requests = plan.requests(range(len(plan)))
    assert [request.run for request in requests] == list(range(8))
    assert len({(r.vehicle, r.controller, r.factors["road.mu"]) for r in requests}) == 8
    for first, second in zip(requests[::2], requests[1::2], strict=True):
        assert first.factors == second.factors
        assert (first.controller, second.controller) == (0, 1)


def test_everything_that_decides_the_result_is_in_the_digest(tmp_path):
    (tmp_path / "mine.py").write_text("from activesteer.controllers import NoControl as Mine\n")
    table = {**STEP, "controllers": [f"{tmp_path}/mine.py:Mine"]}
    found = {Plan(read_study(table)).digest}
    for change in (
        {"seed": 3},
        {"timestep_s": 0.0005},
        {"vehicles": ["sedan"]},
        {"overrides": {"speed_kmh": 70}},
        {"driver": "expert"},
    ):
        found.add(Plan(read_study({**table, **change})).digest)
    (tmp_path / "mine.py").write_text("from activesteer.controllers import NoControl as Mine  # changed\n")
    found.add(Plan(read_study(table)).digest)
    assert len(found) == 7
    assert Plan(read_study({**table, "title": "another"})).digest in found

"""Searches: the best set is found, stored, and the search resumes."""

from __future__ import annotations

import json

import pytest

from activesteer.errors import ActiveSteerError, StudyError
from activesteer.studies.engine.tuning import Trial, _dominates, tune
from tests.raising import raises
from tests.unit.studies.short import MANEUVER, RATIO, write_controller

GAINS = {
    "maneuvers": [MANEUVER],
    "controllers": ["none"],
    "factors": {"maneuver.steer.steering_wheel_deg": {"uniform": [5.0, 30.0]}},
    "design": {"samples": 4},
    "tune": {
        "trials": 12,
        "objectives": [{"name": "yaw", "terms": [{"metric": "yaw_rate_steady_state_radps", "controller": "none"}]}],
        "constraints": [{"metric": "ay_steady_state_mps2", "controller": "none", "low": 1.0}],
    },
}


def test_the_best_set_keeps_its_constraint(tmp_path):
    result = tune(GAINS, tmp_path, jobs=1)
    [best] = result.front
    assert result.done == 12
    assert best.violation == 0.0
    kept = [trial for trial in result.trials if trial.violation == 0.0]
    assert any(trial.violation > 0.0 for trial in result.trials)
    assert best.objectives["yaw"] == min(trial.objectives["yaw"] for trial in kept)
    assert json.loads((tmp_path / "front.json").read_text())[0]["values"] == best.values


def test_a_search_is_gone_on_with_and_another_is_refused(tmp_path):
    first = tune(GAINS, tmp_path, jobs=1, trials=3)
    second = tune(GAINS, tmp_path, jobs=1, trials=5)
    assert (first.done, second.done) == (3, 5)
    assert second.trials[:3] == first.trials
    with raises(StudyError, value=tmp_path):
        tune({**GAINS, "seed": 9}, tmp_path, jobs=1)


def test_a_set_whose_run_fails_is_counted_and_not_chosen(tmp_path):
    path = write_controller(tmp_path, 0.9)
    table = {**GAINS, "controllers": [f"{path}:Fails", "none"], "factors": {RATIO: {"choice": [0.8, 0.9]}}}
    table["tune"] = {**GAINS["tune"], "trials": 8, "constraints": []}
    result = tune(table, tmp_path / "t", jobs=1)
    assert result.failed > 0
    assert {trial.values[RATIO] for trial in result.trials} == {0.8}


@pytest.mark.parametrize(
    "change",
    [
        {"objectives": []},
        {"objectives": [{"name": "a", "terms": [{"metric": "x", "controller": "arse"}]}]},
        {"objectives": [{"name": "a", "terms": [{"metric": "x", "controller": "none", "maneuver": "slalon"}]}]},
        {"trials": 0},
        {"objectivs": []},
    ],
)
def test_a_wrong_table_is_refused_before_anything_runs(tmp_path, change):
    with pytest.raises(ActiveSteerError):
        tune({**GAINS, "tune": {**GAINS["tune"], **change}}, tmp_path, jobs=1)
    with raises(StudyError, file="study given as a table", key="tune"):
        tune({key: value for key, value in GAINS.items() if key != "tune"}, tmp_path, jobs=1)


def test_a_metric_that_the_runs_do_not_have_is_told_with_those_that_they_have(tmp_path):
    constraint = {"metric": "ay_steady_state_mps", "controller": "none", "low": 1.0}
    table = {**GAINS, "tune": {**GAINS["tune"], "constraints": [constraint]}}
    with raises(StudyError, key="tune.constraints.0.metric", value="ay_steady_state_mps") as told:
        tune(table, tmp_path, jobs=1)
    assert "ay_steady_state_mps2" in str(told.value)


def test_a_set_dominates_another_that_is_nowhere_better():
    a, b, c = (Trial(0, {}, {"x": x, "y": y}, 0.0) for x, y in ((1.0, 1.0), (1.0, 2.0), (0.5, 3.0)))
    assert _dominates(a, b)
    assert not _dominates(b, a)
    assert not _dominates(a, c)
    assert not _dominates(a, a)


def test_a_search_does_not_mix_its_files_with_those_of_a_study(tmp_path):
    (tmp_path / "study.toml").write_text("")
    with raises(StudyError, value=tmp_path):
        tune(GAINS, tmp_path, jobs=1, trials=1)
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]

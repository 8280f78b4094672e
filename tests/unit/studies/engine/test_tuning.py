"""Searches: objectives are minimised, statements satisfied and requirements violated; stored, and resumed."""

from __future__ import annotations

import json
import math
import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from activesteer.commands.cli import main
from activesteer.errors import ActiveSteerError, StudyError
from activesteer.studies.engine.factor_values import Plausibility, Prior
from activesteer.studies.engine.store import LOCK, locked
from activesteer.studies.engine.study_file import read_study
from activesteer.studies.engine.tuning import _plausible, _searches, read_tuning, tune
from tests.raising import raises
from tests.unit.studies.short import MANEUVER, RATIO, TIMESTEP_S, write_controller

WHEEL = "maneuver.steer.steering_wheel_deg"
STUDY: dict[str, Any] = {
    "maneuvers": [MANEUVER], "timestep_s": TIMESTEP_S, "controllers": ["none"],
    "factors": {WHEEL: {"uniform": [5.0, 30.0]}},
}  # fmt: skip
GAINS: dict[str, Any] = {
    **STUDY,
    "tune": {
        "trials": 12,
        "minimise": {"yaw": "abs(yaw_rate_steady_state_radps(none))"},
        "constraints": {"turns": "ay_steady_state_mps2(none) >= 1"},
    },
}
TURNS, GENTLE = "ay_steady_state_mps2(none) >= 2.4", "ay_steady_state_mps2(none) <= 2.7"
STATEMENTS: dict[str, Any] = {
    **STUDY,
    "factors": {WHEEL: {"uniform": [5.0, 60.0]}, "road.mu": {"uniform": [0.9, 1.0]}},
    "tune": {"trials": 8, "satisfy": {"turns": TURNS, "gentle": GENTLE}, "seeds": [{WHEEL: 30.0}]},
}
WORST: dict[str, Any] = {
    **STUDY, "tune": {"violate": "abs(ay_steady_state_mps2(controller)) <= 2.5", "trials": 14},
}  # fmt: skip


def changed(table: dict[str, Any], **lines: Any) -> dict[str, Any]:
    """Return a study with other lines in its table [tune]."""
    return {**table, "tune": {**table["tune"], **lines}}


def test_the_objectives_of_stored_runs_are_those_of_the_former_terms(tmp_path: Path):
    """The values come from the terms with `relative_to`, `weight` and `limit` of the file before expressions."""
    (search,) = _searches(read_study("tune_ars"), tmp_path, None, None)
    kept = []
    for one in json.loads((Path(__file__).parent / "tune_ars_runs.json").read_text()):
        found = search.judge.judged(one["rows"], {})
        assert found is not None
        assert found.objectives == list(one["objectives"].values())
        kept.append(min(found.constraints.values()) >= 0.0)
    assert kept == [True, False]


def test_the_best_set_keeps_its_constraint(tmp_path: Path):
    (result,) = tune(GAINS, tmp_path, jobs=1)
    [best] = result.front
    assert result.done == 12
    assert best.allowed
    kept = [trial for trial in result.trials if trial.allowed]
    assert len(kept) < 12
    assert best.objectives["yaw"] == min(trial.objectives["yaw"] for trial in kept)
    assert json.loads((tmp_path / "front.json").read_text())["front"][0]["values"] == best.values


@pytest.mark.parametrize("table", [GAINS, STATEMENTS], ids=["tpe", "cma_es"])
def test_a_search_is_resumed_from_all_whole_lines_and_another_is_refused(tmp_path: Path, table: dict[str, Any]):
    (first,) = tune(table, tmp_path, jobs=1, trials=3)
    with (tmp_path / "tune.journal").open("a") as file:
        file.write('{"op_code": 5, "tri')  # killed while writing
    assert read_tuning(table, tmp_path).trials == first.trials
    (second,) = tune(changed(table, trials=6), tmp_path, jobs=1)
    assert (first.done, second.done) == (3, 6)
    assert second.trials[:3] == first.trials
    with raises(StudyError, value=tmp_path):
        tune({**table, "seed": 9}, tmp_path, jobs=1)


def test_a_search_whose_files_have_changed_is_not_resumed_and_says_so(tmp_path: Path):
    tune(GAINS, tmp_path, jobs=1, trials=1)
    told = tmp_path / "tune.toml"
    told.write_text("# digest of other files\n" + told.read_text().partition("\n")[2])
    with raises(StudyError, value=tmp_path) as caught:
        tune(GAINS, tmp_path, jobs=1, trials=2)
    assert "holds this search with other versions of its files or of activesteer" in str(caught.value)
    with raises(StudyError, value=tmp_path) as caught:
        tune({**GAINS, "seed": 9}, tmp_path, jobs=1, trials=2)
    assert "holds another search" in str(caught.value)


def test_two_searches_do_not_work_in_one_folder(tmp_path: Path):
    with locked(tmp_path / LOCK), raises(StudyError, cause=BlockingIOError, value=tmp_path):
        tune(GAINS, tmp_path, jobs=1)
    assert not (tmp_path / "tune.journal").exists()


def test_a_set_whose_run_fails_is_counted_and_not_chosen(tmp_path: Path):
    path = write_controller(tmp_path, 0.9)
    table = {**GAINS, "controllers": [f"{path}:Fails", "none"], "factors": {RATIO: {"choice": [0.8, 0.9]}}}
    (result,) = tune(changed(table, sampler="grid", constraints={}), tmp_path / "t", jobs=1)
    assert (result.done, result.failed) == (2, 1)
    assert [trial.values for trial in result.trials] == [{RATIO: 0.8}]


def test_a_set_that_is_tried_again_is_listed_once(tmp_path: Path):
    table = {**GAINS, "factors": {WHEEL: {"grid": [10.0, 20.0]}}}
    (result,) = tune(changed(table, constraints={}), tmp_path, jobs=1, trials=6)
    assert len(result.trials) == 6
    assert [trial.values for trial in result.front] == [{WHEEL: 10.0}]


@pytest.mark.parametrize("sampler", ["nsga2", "random", "qmc"])
def test_every_sampler_stays_within_the_ranges(tmp_path: Path, sampler: str):
    (result,) = tune(changed(GAINS, sampler=sampler), tmp_path, jobs=1, trials=3)
    assert all(5.0 <= trial.values[WHEEL] <= 30.0 for trial in result.trials)


def test_statements_are_satisfied_and_the_most_plausible_sets_are_in_front(tmp_path: Path):
    (found,) = tune(STATEMENTS, tmp_path, jobs=1, trials=12)
    assert found.trials[1].values[WHEEL] == 30.0  # after the nominal values, the seed
    best = found.front[0]
    assert sorted(best.holding) == ["gentle", "turns"]
    sizes = [one.implausibility for one in found.front]
    assert sizes == sorted(sizes, reverse=True)
    assert found.plausibility in Plausibility
    assert found.never_together == []


def test_statements_that_exclude_each_other_are_named(tmp_path: Path):
    apart = changed(STATEMENTS, satisfy={"turns": TURNS, "calm": "ay_steady_state_mps2(none) <= 1.9"})
    (found,) = tune(changed(apart, seeds=[{WHEEL: 6.0}, {WHEEL: 50.0}]), tmp_path, jobs=1, trials=3)
    assert found.never_together == [("turns", "calm")]


def test_a_violation_is_found_with_the_command_that_repeats_it(tmp_path: Path):
    [found] = tune(WORST, tmp_path, jobs=1)
    assert found.violations
    assert found.runs == 14
    [worst] = found.front
    assert worst.values[WHEEL] == max(trial.values[WHEEL] for trial in found.trials)
    falls = [value for _, value in found.fall]
    assert falls == sorted(falls, reverse=True)
    assert falls[-1] == worst.margins["controller"] < 0.0
    command = f"activesteer run short -c none --set {WHEEL}={worst.values[WHEEL]}"
    assert shlex.split(found.commands["none"]) == command.split()
    assert json.loads((tmp_path / "none-short" / "worst.json").read_text())["violations"] == found.violations


def test_a_search_for_a_violation_resumes_within_its_budget_of_runs(tmp_path: Path):
    table = changed(WORST, violate="abs(ay_steady_state_mps2(controller)) - ay_steady_state_mps2(none) <= 9")
    [first] = tune(table, tmp_path, jobs=1, runs=6, controllers=["ars"])
    [second] = tune(table, tmp_path, jobs=1, runs=8, controllers=["ars"], maneuvers=["short"])
    assert (first.done, second.done, second.runs) == (3, 4, 8)
    assert second.trials[:3] == first.trials
    assert not second.violations
    with raises(StudyError, value=tmp_path / "ars-short"):
        tune(changed(table, violate="abs(ay_steady_state_mps2(controller)) <= 3"), tmp_path, controllers=["ars"])


def test_a_run_that_fails_with_the_controller_alone_violates(tmp_path: Path):
    path = write_controller(tmp_path, 0.9)
    table = {**WORST, "factors": {RATIO: {"choice": [0.8, 0.9]}}}
    table["tune"] = {"violate": "abs(ay_steady_state_mps2(controller)) - abs(ay_steady_state_mps2(none)) <= 0.1"}
    [found] = tune(table, tmp_path / "f", jobs=1, controllers=[f"{path}:Fails"], trials=4)
    assert found.front[0].values == {RATIO: 0.9}
    assert found.violations
    assert found.controller == "bad.py:Fails"


@pytest.mark.parametrize(
    ("own", "other", "margin"),
    [(math.nan, 1.0, -1e6), (1.0, math.nan, 1e6), (math.nan, math.nan, None), (2.0, 1.0, -1.0)],
)
def test_a_metric_that_only_the_examined_run_lacks_is_a_violation(
    tmp_path: Path, own: float, other: float, margin: float | None
):
    table = changed(WORST, violate="ay_peak_abs_mps2(controller) <= ay_peak_abs_mps2(none)")
    (search,) = _searches(read_study(table), tmp_path, ["ars"], None)
    about = {"maneuver": "short", "vehicle": "compact", "status": "ok"}
    values = {"ars": own, "none": other}
    rows = [{**about, "controller": name, "ay_peak_abs_mps2": value} for name, value in values.items()]
    found = search.judge.judged(rows, {})
    assert (found and found.margins["controller"]) == margin


@pytest.mark.parametrize(
    ("table", "key", "words"),
    [
        (changed(GAINS, minimise={}), "tune", "exactly one"),
        (changed(GAINS, violate="harm(controller) <= 1"), "tune", "minimise, violate"),
        (changed(GAINS, minimise={"a": "yaw_rate_overshoot(arse)"}), "tune.minimise.a", "known names: none"),
        (changed(GAINS, minimise={"a": "yaw_rate_overshoot(none, shirt)"}), "tune.minimise.a", "short"),
        (changed(GAINS, minimise={"a": 3}), "tune.minimise.a", "string"),
        (changed(GAINS, trials=0), "tune.trials", "1"),
        (changed(GAINS, objectivs={}), "tune.objectivs", "no such key"),
        (changed(GAINS, sampler="tpf"), "tune.sampler", "'nsga2'"),
        (changed(GAINS, sampler="grid"), "tune.sampler", "range"),
        (changed(GAINS, sampler="cma_es"), "tune.sampler", "nsga2"),
        (changed(GAINS, seeds=[{"factors.mass": 1.0}]), "tune.seeds.0.factors.mass", WHEEL),
        (changed(GAINS, seeds=[{WHEEL: 31.0}]), f"tune.seeds.0.{WHEEL}", "30.0"),
        (changed(WORST, violate="harm(controller, slalom) <= 1"), "tune.violate", "short"),
        (changed(STATEMENTS, satisfy={"S1": "claim(S1)"}), "tune.satisfy.S1", "claims = true"),
        (changed(GAINS, objectives=[{"name": "a", "terms": []}]), "tune.objectives", "[tune.minimise]"),
        (changed(GAINS, constraints=[{"metric": "ay", "low": 1.0}]), "tune.constraints", "[tune.constraints]"),
        ({**STUDY, "match": {"evaluations": 60}}, "match", "[tune.satisfy]"),
        ({**STUDY, "falsify": {"requirement": "harm(controller) <= 1"}}, "falsify", "violate ="),
        (STUDY, "tune", "minimise, satisfy or violate"),
    ],
)  # fmt: skip
def test_a_wrong_table_is_refused_before_anything_runs(tmp_path: Path, table: dict[str, Any], key: str, words: str):
    with raises(ActiveSteerError, key=key) as told:
        tune(table, tmp_path, jobs=1)
    assert words in str(told.value)


@pytest.mark.parametrize("option", ["controllers", "maneuvers"])
def test_only_a_search_for_a_violation_chooses_controllers_and_manoeuvres(tmp_path: Path, option: str):
    given: dict[str, Any] = {option: ["none"]}
    with raises(ActiveSteerError, key=f"--{option.removesuffix('s')}"):
        tune(GAINS, tmp_path, jobs=1, **given)


@pytest.mark.parametrize(
    ("table", "key"),
    [
        (changed(GAINS, constraints={"a": "lane_overstep_m(none) <= 0"}), "tune.constraints.a"),
        (changed(WORST, violate="lane_overstep_m(controller) <= 0"), "tune.violate"),
    ],
)
def test_a_metric_that_the_runs_do_not_have_is_told_with_those_that_they_have(tmp_path: Path, table: Any, key: str):
    with raises(StudyError, key=key, value="lane_overstep_m") as told:
        tune(table, tmp_path, jobs=1)
    assert "the runs of short have no such metric" in str(told.value)


def test_a_search_does_not_mix_its_files_with_those_of_a_study(tmp_path: Path):
    (tmp_path / "study.toml").write_text("")
    with raises(StudyError, value=tmp_path):
        tune(GAINS, tmp_path, jobs=1, trials=1)
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


def test_the_front_of_plausible_sets_has_fewer_statements_only_for_more_plausibility():
    """Each set in the front is the most plausible one of its number, and beats all that satisfy more."""
    sets = [((1, 2), 5.0), ((1, 2), 4.0), ((1,), 4.5), ((2,), 3.0), ((), 3.5), ((), 1.0)]
    trials: Any = [SimpleNamespace(holding=holding, implausibility=value) for holding, value in sets]
    front = [(len(one.holding), one.implausibility) for one in _plausible(trials)]
    assert front == [(2, 4.0), (1, 3.0), (0, 1.0)]
    assert [one.implausibility for one in _plausible(trials[:3])] == [4.0]


def test_distances_are_in_units_of_the_range_on_either_side():
    prior = Prior(read_study("match_paper"))
    nominal = prior.distances(prior.nominal)
    assert set(nominal.values()) == {0.0}
    assert prior.plausibility(prior.nominal) is Plausibility.ORDINARY
    high, low = ({**prior.nominal, "factors.mass": mass} for mass in (1.2, 0.95))
    assert prior.distances(high)["factors.mass"] == pytest.approx(1.0)
    assert prior.distances(low)["factors.mass"] == pytest.approx(-0.5)
    gain = "controllers.ars.corrector.proportional_gain_s"
    assert prior.distances({**prior.nominal, gain: math.sqrt(0.25 * 0.85)})[gain] == pytest.approx(0.5)
    assert prior.plausibility({**prior.nominal, "factors.mass": 1.3}) is Plausibility.EXTREME
    assert "lane.margin_m" not in prior.distances({**prior.nominal, "lane.path": "middle"})


@pytest.mark.slow
def test_command_says_what_it_found_and_fails_on_a_violation(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "r.toml"
    table = "\n".join(f"{key} = {json.dumps(value)}" for key, value in MANEUVER.items() if key != "steer")
    (tmp_path / "short.toml").write_text(table + "\n[steer]\nstart_s = 0.05\nsteering_wheel_deg = 20.0\n")
    head = f'maneuvers = ["short.toml"]\n[factors]\n"{WHEEL}" = {{ uniform = [5.0, 30.0] }}\n[tune]\ntrials = 12\n'
    file.write_text(f'{head}violate = "ay_steady_state_mps2(controller) <= 2.5"\n')
    arguments = ["tune", str(file), "-o", str(tmp_path / "found"), "--jobs", "1"]
    assert main(arguments) == 1
    text = capsys.readouterr().out
    assert "VIOLATED" in text
    assert "activesteer run" in text
    assert (tmp_path / "found" / "none-short" / "violations.png").stat().st_size > 10_000
    assert main([*arguments, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["violated"]
    file.write_text(file.read_text().replace("<= 2.5", "<= 50"))
    assert main([*arguments[:-3], str(tmp_path / "other"), "--jobs", "1"]) == 0
    file.write_text(f'{head}[tune.satisfy]\ngentle = "ay_steady_state_mps2(none) <= 2.5"\n')
    assert main([*arguments[:-3], str(tmp_path / "satisfied"), "--jobs", "1"]) == 0
    assert "1 of 1 hold, implausibility" in capsys.readouterr().out
    assert (tmp_path / "satisfied" / "front.svg").stat().st_size > 10_000

"""Matches: the search finds settings that agree with the statements, stores every evaluation, and resumes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from activesteer.cli import main
from activesteer.errors import ActiveSteerError, StudyError
from activesteer.studies.engine.match_store import FILE
from activesteer.studies.engine.matching import match, read_match
from activesteer.studies.engine.prior import Plausibility, Prior
from activesteer.studies.engine.store import LOCK, locked
from activesteer.studies.engine.study_file import read_study
from tests.raising import raises
from tests.unit.studies.short import MANEUVER

WHEEL = "maneuver.steer.steering_wheel_deg"
ABOVE = {"id": "turns", "criteria": [{"metric": "ay_steady_state_mps2", "controller": "none", "low": 2.0}]}
BELOW = {"id": "gentle", "criteria": [{"metric": "ay_steady_state_mps2", "controller": "none", "high": 2.5}]}
TABLE: dict[str, Any] = {
    "maneuvers": [MANEUVER],
    "controllers": ["none"],
    "factors": {WHEEL: {"uniform": [5.0, 60.0]}},
    "match": {"evaluations": 12, "population": 4, "spread": 0.2, "statements": [ABOVE, BELOW]},
}


def test_a_setting_is_found_in_which_all_statements_hold(tmp_path):
    found = match(TABLE, tmp_path, jobs=1)
    assert found.best is not None
    assert sorted(found.best.holding) == ["gentle", "turns"]
    ay_mps2 = next(iter(found.best.scenarios.values())).metrics["none"]["ay_steady_state_mps2"]
    assert 2.0 <= ay_mps2 <= 2.5
    sizes = [found.prior.implausibility(one.values) for one in found.front]
    assert sizes == sorted(sizes, reverse=True)
    assert [len(one.holding) for one in found.front] == sorted((len(one.holding) for one in found.front), reverse=True)


def test_a_match_is_resumed_from_all_whole_lines_and_another_is_refused(tmp_path):
    first = match(TABLE, tmp_path, jobs=1, evaluations=4)
    with (tmp_path / FILE).open("a") as file:
        file.write('{"candidate": 99, "orig')  # killed while writing
    again = read_match(TABLE, tmp_path)
    assert again.candidates == first.candidates
    assert match(TABLE, tmp_path, jobs=1, evaluations=8).evaluations >= 8
    with raises(StudyError, value=tmp_path):
        match({**TABLE, "seed": 9}, tmp_path, jobs=1)


def test_two_searches_do_not_work_in_one_folder(tmp_path):
    with locked(tmp_path / LOCK), raises(StudyError, cause=BlockingIOError, value=tmp_path):
        match(TABLE, tmp_path, jobs=1)
    assert not (tmp_path / FILE).exists()


def test_settings_are_drawn_in_which_enough_statements_hold(tmp_path):
    match(TABLE, tmp_path, jobs=1)
    drawn = match(TABLE, tmp_path, jobs=1, evaluations=18, least=2)
    kept = [one for one in drawn.candidates if one.origin == "sample2" and len(one.holding) == 2]
    assert kept
    low, middle, high = drawn.quantiles(2)[WHEEL]
    assert 5.0 <= low <= middle <= high <= 60.0
    near = match(TABLE, tmp_path, jobs=1, evaluations=22, neighbours=0.001)
    assert near.robustness[0] == near.robustness[1] >= 4
    with raises(StudyError):
        match({**TABLE, "seed": 3}, tmp_path / "empty", jobs=1, evaluations=4, least=2)


def test_a_hopeless_setting_is_given_up_before_its_other_scenarios(tmp_path):
    other = {**MANEUVER, "name": "other"}
    never = {"id": "never", "maneuver": "short", "criteria": [{**ABOVE["criteria"][0], "low": 90.0}]}
    table = {**TABLE, "maneuvers": [MANEUVER, other]}
    wanted = [{**ABOVE, "maneuver": "other"}, never, {**BELOW, "maneuver": "short"}]
    table["match"] = {**TABLE["match"], "statements": wanted, "slack": 0.1, "evaluations": 12}
    found = match(table, tmp_path, jobs=1)
    assert any(len(one.scenarios) == 1 for one in found.candidates)
    assert found.best is not None
    assert len(found.best.holding) == 2
    assert found.never_together == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"statements": []}, "statement"),
        ({"statements": [ABOVE, ABOVE]}, "twice"),
        ({"statements": [{"id": "x", "criteria": [{"metric": "ay", "controller": "none"}]}]}, "no bound"),
        ({"statements": [{"id": "x", "criteria": [{"metric": "ay", "controller": "arse", "low": 0.0}]}]}, "none"),
        ({"statements": [{**ABOVE, "maneuver": "slalom"}]}, "short"),
        ({"seeds": [{"factors.mass": 1.0}]}, WHEEL),
        ({"population": 1}, "population"),
    ],
)
def test_wrong_tables_are_named(tmp_path, change, words):
    with pytest.raises(ActiveSteerError, match=words):
        match({**TABLE, "match": {**TABLE["match"], **change}}, tmp_path, jobs=1)


def test_a_metric_that_the_runs_do_not_have_is_named(tmp_path):
    wrong = {"id": "x", "criteria": [{"metric": "ay_steady_state", "controller": "none", "low": 0.0}]}
    with pytest.raises(StudyError, match="ay_steady_state_mps2"):
        match({**TABLE, "match": {**TABLE["match"], "statements": [wrong]}}, tmp_path, jobs=1)


def test_the_command_needs_the_table(tmp_path, capsys):
    assert main(["match", "population", "-o", str(tmp_path)]) == 1
    assert "which statements should hold" in capsys.readouterr().err


def test_distances_are_in_units_of_the_range_on_either_side():
    prior = Prior(read_study("match_paper", "match"))
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


def test_a_setting_and_its_point_in_the_cube_are_the_same():
    prior = Prior(read_study("match_paper", "match"))
    point = np.random.default_rng(1).random(len(prior.searched))
    values = prior.values(point)
    again = prior.values(prior.point(values))
    for key, value in values.items():
        assert again[key] == (pytest.approx(value) if isinstance(value, float) else value)

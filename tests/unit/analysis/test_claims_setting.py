"""The paper's setting: a file with every number, its range and its reason; its runs are judged by its own list."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from activesteer.analysis.claims.judge import SCENARIOS, STATEMENTS, Claim
from activesteer.analysis.claims.scorecard import (
    LITERATURE,
    PAPER,
    Verdict,
    claims_for,
    read_setting,
    scorecard,
    setting_of,
)
from activesteer.errors import ParameterError
from activesteer.scenario import resolve, value_of
from activesteer.studies.reproduction import reproduce
from tests.raising import raises


def run_of(scenario: str, overrides: dict[str, Any]) -> Any:
    metadata = {"maneuver": {"name": scenario, "kind": "lane_change"}, "vehicle": {}, "overrides": overrides}
    return SimpleNamespace(metadata=metadata)


def test_every_number_has_a_reason_and_lies_in_its_range():
    numbers = read_setting(PAPER).numbers
    assert len(numbers) > 25
    for number in numbers:
        assert number.reason
        if number.low is not None and number.high is not None:
            assert isinstance(number.value, float)
            assert number.low <= number.value <= number.high


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_the_numbers_act_and_their_nominal_values_are_those_of_the_files(scenario):
    nominal, changed = resolve(scenario), resolve(scenario, overrides=read_setting(PAPER).overrides(scenario))
    for number in read_setting(PAPER).numbers:
        if not number.maneuvers or scenario in number.maneuvers:
            after = value_of(changed, number.key)
            assert after == (number.value if isinstance(after, str) else pytest.approx(number.value))
            before = value_of(nominal, number.key)
            assert before == (number.nominal if isinstance(before, str) else pytest.approx(number.nominal, rel=1e-3))


def test_a_run_is_of_the_setting_whose_numbers_it_has():
    overrides = read_setting(PAPER).overrides("slalom")
    assert setting_of(run_of("slalom", overrides)) == PAPER
    assert setting_of(run_of("slalom", {})) == LITERATURE
    assert setting_of(run_of("slalom", {**overrides, "cones.spacing_m": 30.0})) == ""
    assert setting_of(run_of("brake_in_turn", {})) == ""


def test_runs_of_the_paper_s_setting_are_judged_and_those_with_other_cones_are_not():
    overrides = read_setting(PAPER).overrides("slalom")
    assert claims_for(run_of("slalom", overrides)) is SCENARIOS["slalom"]
    assert claims_for(run_of("slalom", {**overrides, "cones.spacing_m": 30.0})) is None


def test_the_paper_s_setting_has_its_own_list():
    fails = read_setting(PAPER).fails
    claims = [Claim(statement, number not in fails, {}) for number, statement in STATEMENTS.items()]
    card = scorecard(claims, "compact", setting=PAPER)
    assert card.exit_status == 0
    assert card.to_json()["setting"] == PAPER
    assert {item.claim.id for item in card.judged if item.verdict is Verdict.NOT_REPRODUCED} == set(fails)


def test_the_setting_is_of_one_car(tmp_path):
    with raises(ParameterError, value="sedan"):
        reproduce(tmp_path, "sedan", setting=PAPER)
    with raises(ParameterError, value="papr"):
        read_setting("papr")

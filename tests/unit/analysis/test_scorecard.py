"""Verdicts, and the list of claims known as not reproduced."""

from __future__ import annotations

import json
import math

from activesteer.analysis.claims.judge import STATEMENTS, Claim, Statement
from activesteer.analysis.claims.scorecard import (
    NOT_REPRODUCED,
    PAPER,
    Verdict,
    not_reproduced,
    read_setting,
    scorecard,
)
from activesteer.config import read_toml


def claim(number: str, passed: bool, **values: float) -> Claim:
    statement = Statement(number, f"text of {number}", f"criterion of {number}", {}, ())
    return Claim(statement, passed, values)


def verdicts(known: dict[str, str], *claims: Claim) -> list[Verdict]:
    return [item.verdict for item in scorecard(claims, known=known).judged]


def test_a_failure_that_is_listed_is_not_reproduced_and_never_passed():
    card = scorecard([claim("D5", False)], known={"D5": "why"})
    assert [item.verdict for item in card.judged] == [Verdict.NOT_REPRODUCED]
    assert card.exit_status == 0
    entry = card.to_json()["claims"][0]
    assert (entry["passed"], entry["verdict"], entry["reason"]) == (False, "not reproduced", "why")
    assert "not reproduced" in card.to_text()
    assert "because: why" in card.to_text()
    assert "1 passed" not in card.to_text()


def test_a_failure_that_is_not_listed_fails_and_sets_the_exit_status():
    card = scorecard([claim("D4", False), claim("D3", True)], known={"D5": "why"})
    assert [item.verdict for item in card.judged] == [Verdict.FAILED, Verdict.PASSED]
    assert card.exit_status == 1
    assert "D4  FAILED" in card.to_text()


def test_a_listed_claim_that_passes_is_said_so():
    card = scorecard([claim("D5", True)], known={"D5": "why"})
    assert card.exit_status == 0
    assert card.to_json()["claims"][0]["verdict"] == "passed, though listed as not reproduced"
    assert "remove it from there" in card.to_text()


def test_all_passed():
    assert verdicts({}, claim("S1", True), claim("S2", True)) == [Verdict.PASSED] * 2
    assert scorecard([claim("S1", True)], known={}).exit_status == 0


def test_json_has_the_keys_and_no_nan():
    table = scorecard([claim("L1", False, none_x_m=math.nan, ars_x_m=1.0)], known={}).to_json()
    entry = table["claims"][0]
    keys = {"id", "text", "passed", "values", "criterion", "verdict", "reason", "kind", "obstacle"}
    assert keys == set(entry)
    assert entry["values"] == {"none_x_m": None, "ars_x_m": 1.0}
    assert table["verdicts"]["failed"] == 1
    json.dumps(table, allow_nan=False)


def test_text_shows_the_numbers_of_the_systems_beside_each_other_in_display_units():
    values = {"none_yaw_rate_peak_radps": math.radians(12.0), "ars_yaw_rate_peak_radps": math.nan}
    text = scorecard([claim("S1", True, **values, track_difference_none_ars_m=0.25)], known={}).to_text()
    lines = [line.strip() for line in text.splitlines()]
    assert "peak yaw rate: none 12  ars - deg/s" in lines
    assert "track difference, none and ars: 0.25 m" in lines
    assert lines[-1] == "1 claims: 1 passed"


def test_the_lists_in_the_package_name_claims_and_reasons():
    lists = [*read_toml(NOT_REPRODUCED)[0].values(), read_setting(PAPER).fails]
    for reasons in lists:
        assert set(reasons) <= set(STATEMENTS)
        assert all(isinstance(reason, str) and reason.strip() for reason in reasons.values())


def test_the_list_of_the_vehicle_is_looked_up_by_its_name():
    assert not_reproduced("compact")["S1"] != not_reproduced("tesla_model_s")["S1"]
    assert not_reproduced("a car that nobody knows") == {}
